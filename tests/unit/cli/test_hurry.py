"""Orders in a hurry: plain command lines are carried out without the command line library; the others are left to the verbs."""

import subprocess
import sys
from typing import Any

import pytest

from formiga_bt.cli.orders import hurry
from formiga_bt.client import UnknownId
from tests.unit.cli.paper import PaperClient, reply


class Paper(PaperClient):
    """A client that keeps what is sent; hwd_1 is the only machine."""

    def __init__(self) -> None:
        super().__init__()
        self.sent: list[tuple[str, Any]] = []

    def take(self, path: str, body: Any) -> Any:
        if path == "/v1/agents/PickUp-3/orders":
            raise UnknownId("unknown_agent", "there is none")
        self.sent.append((path, body))
        return reply()


@pytest.fixture
def paper(monkeypatch: pytest.MonkeyPatch) -> Paper:
    made = Paper()
    monkeypatch.setattr(hurry, "connect", lambda site: made)
    return made


@pytest.mark.parametrize(
    ("line", "path", "body"),
    [
        ("hold hwd_1 --by eve", "/v1/agents/hwd_1/orders", {"order": "hold", "by": "eve"}),
        ("return --by=eve PickUp-3", "/v1/tasks/PickUp-3/orders", {"order": "return", "by": "eve"}),
        ("land --all --by eve --json", "/v1/orders", {"order": "land", "by": "eve"}),
        ("continue --all --by eve", "/v1/orders", {"order": "continue", "by": "eve"}),
        ("lockdown --by eve", "/v1/lockdown", {"how": "return", "by": "eve"}),
        ("lockdown --hold --by eve", "/v1/lockdown", {"how": "hold", "by": "eve"}),
        ("lockdown release --by eve", "/v1/lockdown", {"how": "release", "by": "eve"}),
    ],
)
def test_plain_lines_are_carried_out(paper: Paper, line: str, path: str, body: dict[str, str]) -> None:
    verb, *words = line.split()

    assert hurry.quick(verb, words) == 0
    assert paper.sent == [(path, body)]


@pytest.mark.parametrize(
    "line",
    ["hold", "hold --help", "hold hwd_1 --all", "hold a b", "land --by", "lockdown status", "lockdown --hold --land",
     "lockdown release --hold", "hold --site --all", "return --wat hwd_1"],
)  # fmt: skip
def test_the_rest_is_left_to_the_verb(paper: Paper, line: str) -> None:
    verb, *words = line.split()

    assert hurry.quick(verb, words) is None
    assert paper.sent == []


def test_the_libraries_of_other_verbs_are_not_imported() -> None:
    look = "import sys; sys.argv[1:] = ['x']; import formiga_bt.cli.app, formiga_bt.cli.orders.hurry;" \
        " print([m for m in ('typer', 'pydantic', 'msgspec', 'yaml') if m in sys.modules])"  # fmt: skip

    assert subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=True).stdout == "[]\n"
