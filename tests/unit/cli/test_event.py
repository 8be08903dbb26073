"""The command that tells an event: what it sends and prints. The engine is of paper."""

from pathlib import Path
from typing import Any

import pytest

from formiga_bt.cli.app import run
from formiga_bt.cli.orders import event
from formiga_bt.show.facts import OrderDone
from tests.golden import Wording
from tests.unit.cli.paper import PaperClient

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []

    class Paper(PaperClient):
        def take(self, path: str, body: Any) -> OrderDone:
            found.append((path, body))
            return OrderDone("picker_1 tells sos")

    def connect(site: Path | None = None) -> Paper:
        return Paper()

    monkeypatch.setattr(event, "connect", connect)
    return found


def test_it_sends_the_event_with_its_fields(sent: list[tuple[str, Any]], capsys: Capture) -> None:
    assert run(["event", "picker_1", "fell", "--field", "force=3 m", "-f", "at=camp"]) == 0

    assert sent == [("/v1/agents/picker_1/events", {"event": "fell", "fields": {"force": "3 m", "at": "camp"}})]
    assert capsys.readouterr().out == "picker_1 tells sos\n"


def test_a_field_without_a_value_is_not_sent(sent: list[tuple[str, Any]], capsys: Capture, wording: Wording) -> None:
    assert run(["event", "picker_1", "fell", "--field", "force"]) == 2

    assert sent == []
    wording(capsys.readouterr().err)
