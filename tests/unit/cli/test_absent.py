"""Nobody is simulated twice: who an engine hears already is named, with the command that leaves them out."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from formiga_bt.base.errors import FormigaError
from formiga_bt.cli.app import run
from formiga_bt.cli.integrator import absent, sim_fleet, sim_live
from formiga_bt.cli.integrator.absent import check_absent
from formiga_bt.client import NoEngine
from formiga_bt.show.facts import AgentFact, AgentList
from tests.golden import Wording
from tests.unit.cli.paper import PaperClient
from tests.unit.cli.paper import agents as listed

Capture = pytest.CaptureFixture[str]


def agent(name: str, *, desk: bool = False, liveness: str = "ALIVE") -> AgentFact:
    return AgentFact(id=name, type="hwd", at_desk=desk, liveness=liveness)


class Engine(PaperClient):
    """Tells of these agents, one list after the other; none: it does not answer."""

    def __init__(self, *lists: list[AgentFact]) -> None:
        super().__init__()
        self.lists = list(lists)

    def look(self, path: str, query: Mapping[str, Any]) -> AgentList:
        assert path == "/v1/agents"
        if not self.lists:
            raise NoEngine("none")
        return listed(*(self.lists.pop(0) if len(self.lists) > 1 else self.lists[0]))


@pytest.mark.parametrize(
    ("agents", "said", "help_"),
    [
        (
            [agent("ann", desk=True), agent("lwd_1", liveness="LOST")],
            "ann answers at the engine's desk: nobody is simulated twice",
            "leave it out: formiga sim --without ann; or start the engine without --desk ann",
        ),
        (
            [agent("ann", desk=True), agent("ben", desk=True), agent("lwd_1")],
            "ann, ben answer at the engine's desk; the engine hears lwd_1 already, from another process: "
            "nobody is simulated twice",
            "leave them out: formiga sim --without ann --without ben --without lwd_1; or start the engine without --desk ann "
            "--desk ben; or end what simulates them first: formiga sim, formiga up --sim",
        ),
    ],
)
def test_who_is_there_is_named_with_what_to_do(agents: list[AgentFact], said: str, help_: str) -> None:
    everybody = ["ann", "ben", "lwd_1"]
    with pytest.raises(FormigaError) as refused:
        check_absent(Engine(agents), everybody, can_leave_out=True, wait_s=0)  # type: ignore[arg-type]
    assert str(refused.value) == f"{said}\n  help: {help_}"
    with pytest.raises(FormigaError) as refused:
        check_absent(Engine(agents), everybody, can_leave_out=False, wait_s=0)  # type: ignore[arg-type]
    assert "--without" not in str(refused.value)


def test_who_goes_or_is_another_is_no_hindrance(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(absent, "LOOK_EVERY_S", 0.0)
    going = Engine([agent("lwd_1")], [agent("lwd_1")], [agent("lwd_1", liveness="SUSPECT"), agent("ann", desk=True)])
    check_absent(going, ["lwd_1"], can_leave_out=True, wait_s=60)  # type: ignore[arg-type]
    check_absent(Engine(), ["lwd_1"], can_leave_out=True, wait_s=0)  # type: ignore[arg-type]


def test_both_kinds_of_simulation_ask_first(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["init"]) == 0
    engine = Engine([agent("watcher_1", desk=True)])
    address = SimpleNamespace(endpoint="tcp/127.0.0.1:1")
    monkeypatch.setattr(sim_fleet, "read_address", lambda _: address)
    monkeypatch.setattr(sim_fleet, "Client", lambda _: engine)
    assert run(["sim"]) == 1
    wording(capsys.readouterr().err)

    engine.address = replace(engine.address, site="rovaniemi")
    monkeypatch.setattr(sim_live, "_client", lambda _: engine)
    assert run(["sim", "demo"]) == 1
    wording(capsys.readouterr().err)
