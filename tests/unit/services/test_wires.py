"""The host makes its wires from the table of the site file."""

from importlib.metadata import EntryPoint, EntryPoints
from typing import Any

import pytest

import formiga_bt.base.wires as wires
from formiga_bt.base.errors import FormigaError
from formiga_bt.base.wires import GUARANTEES, WireKind, WireSetup
from formiga_bt.lang.model import Site
from formiga_bt.services.listening import make_wires
from formiga_bt.transport.zenoh import ZenohTransport


class Other:
    def __init__(self, setup: WireSetup) -> None:
        self.setup, self.name, self.guarantees = setup, "mqtt", ("epoch",)


class Liar(Other):
    def __init__(self, setup: WireSetup) -> None:
        super().__init__(setup)
        self.guarantees = GUARANTEES


def broken(setup: WireSetup) -> Any:
    raise RuntimeError("no broker")


MQTT = WireKind(name="mqtt", summary="", guarantees=("epoch",), make=f"{__name__}:Other")
LIAR = WireKind(name="liar", summary="", guarantees=("epoch",), make=f"{__name__}:Liar")
BROKEN = WireKind(name="broken", summary="", guarantees=(), make=f"{__name__}:broken")


@pytest.fixture(autouse=True)
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    entries = [EntryPoint(name, f"{__name__}:{name.upper()}", wires.GROUP) for name in ("mqtt", "liar", "broken")]
    found = EntryPoints(entries)
    monkeypatch.setattr(wires, "entry_points", lambda **given: found.select(**given))


def site(**transports: Any) -> Site:
    return Site("north", 66.5, 25.7, transports=transports)


def test_a_site_without_a_table_has_the_wire_that_ships() -> None:
    (made,) = make_wires(site())
    assert isinstance(made, ZenohTransport)
    assert made.endpoint == "tcp/127.0.0.1:7447"


def test_every_wire_of_the_table_is_made_with_its_options() -> None:
    zenoh, other = make_wires(site(zenoh={"listen": "tcp/127.0.0.1:1"}, mqtt={"broker": "b:1"}))
    assert isinstance(zenoh, ZenohTransport)
    assert zenoh.endpoint == "tcp/127.0.0.1:1"
    assert isinstance(other, Other)
    assert other.setup == WireSetup("north", {"broker": "b:1"})


def test_a_listen_of_the_command_line_is_for_zenoh() -> None:
    (made,) = make_wires(site(), "tcp/127.0.0.1:2")
    assert isinstance(made, ZenohTransport)
    assert made.endpoint == "tcp/127.0.0.1:2"
    with pytest.raises(FormigaError, match="--listen"):
        make_wires(site(mqtt={}), "tcp/127.0.0.1:2")


@pytest.mark.parametrize(("name", "word"), [("liar", "another"), ("broken", "no broker"), ("none", "no wire")])
def test_a_wire_that_cannot_be_made_is_an_error_that_names_it(name: str, word: str) -> None:
    with pytest.raises(FormigaError, match=word) as error:
        make_wires(site(**{name: {}}))
    assert name in str(error.value)
    assert error.value.help
