"""`formiga watch` from the command line: where it may run, which call each order becomes, and an engine that is found anew."""

import sys
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.cli.app import run
from formiga_bt.cli.operator import watch as module
from formiga_bt.client import ApiError, NoEngine
from formiga_bt.show.facts import OrderDone, OrderedFact, SkippedFact
from formiga_bt.show.watch.orders import WatchOrder, WatchReply
from tests.golden import Wording
from tests.unit.cli.paper import PaperClient, reply

PLACE = module.EngineOptions(None, "", None)


class Paper(PaperClient):
    """A client that keeps what is sent and answers as it is told."""

    def __init__(self, reply: Any) -> None:
        super().__init__()
        self.sent: list[tuple[str, dict[str, Any]]] = []
        self.reply = reply

    def take(self, path: str, body: dict[str, Any]) -> Any:
        self.sent.append((path, body))
        if isinstance(self.reply, Exception):
            raise self.reply
        return self.reply


def order(verb: str, kind: str = "agent", target: str = "hwd_1", **more: str) -> WatchOrder:
    return WatchOrder(verb=verb, kind=kind, target=target, **more)  # type: ignore[arg-type]


def sent(monkeypatch: pytest.MonkeyPatch, given: WatchOrder, reply: Any) -> WatchReply:
    monkeypatch.setattr(module, "connect", lambda *_: Paper(reply))
    return module.RemoteOrders(PLACE, "eve").send(given)


@pytest.mark.parametrize(
    ("given", "path", "body"),
    [
        (order("hold"), "/v1/agents/hwd_1/orders", {"order": "hold", "by": "eve"}),
        (order("return", "task", "PickUp-3"), "/v1/tasks/PickUp-3/orders", {"order": "return", "by": "eve"}),
        (order("land", "all", ""), "/v1/orders", {"order": "land", "by": "eve"}),
        (order("continue", "task", "A/B"), "/v1/tasks/A%2FB/orders", {"order": "continue", "by": "eve"}),
        (
            order("cut", confirmed="hwd_1"),
            "/v1/agents/hwd_1/orders",
            {"order": "cut", "by": "eve", "confirmed": "hwd_1"},
        ),
        (order("abort", "task", "T-1"), "/v1/tasks/T-1/abort", {"how": "", "confirmed": False, "by": "eve"}),
        (order("handback", how="end"), "/v1/agents/hwd_1/handback", {"how": "end", "by": "eve"}),
        (order("clear"), "/v1/agents/hwd_1/clear", {"by": "eve"}),
        (order("lockdown", "all", ""), "/v1/lockdown", {"how": "return", "by": "eve"}),
        (order("release", "all", ""), "/v1/lockdown", {"how": "release", "by": "eve"}),
        (order("answer", "question", "Q7", how="clear"), "/v1/inbox/Q7/answer", {"option": "clear", "by": ""}),
        (order("answer", "question", "Q7", how="no", by="bob"), "/v1/inbox/Q7/answer", {"option": "no", "by": "bob"}),
    ],
)
def test_the_call_of_each_order(given: WatchOrder, path: str, body: dict[str, Any]) -> None:
    paper = Paper(reply())
    assert module.carry(paper, given, "eve")
    assert paper.sent == [(path, body)]


def test_a_reply_says_who_got_it_and_what_comes_next(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    said = reply(
        OrderedFact("hwd_1", "hwd_1 hovers"),
        text="hold is ordered for 1 machine",
        next=("formiga continue PickUp-3", "formiga abort PickUp-3"),
    )
    came = sent(monkeypatch, order("hold"), said)
    assert came.good
    wording(came.text)


def test_a_machine_in_the_air_that_did_not_get_it_is_no_good_reply(
    monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    skipped = SkippedFact(who="hwd_2", code="agent_lost", text="hwd_2 is lost", may_be_airborne=True)
    said = sent(monkeypatch, order("hold"), reply(text="hold is ordered for 0 machines", skipped=(skipped,)))
    assert said.good is False
    wording(said.text)


def test_a_refusal_is_a_reply_and_silence_is_not(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    refused = sent(monkeypatch, order("clear"), ApiError("not_quarantined", "hwd_1 is not quarantined"))
    assert not refused.good
    wording(refused.text)
    assert sent(monkeypatch, order("clear"), OrderDone("hwd_1 is asked what it still does")).good
    with pytest.raises(NoEngine):
        sent(monkeypatch, order("hold"), NoEngine("it does not answer"))


def test_an_engine_that_went_away_is_looked_for_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    class Gone:
        def now(self, **_: Any) -> str:
            raise NoEngine("it does not answer")

    class Back:
        def now(self, **_: Any) -> str:
            return "now"

    found = [Gone(), Back()]
    monkeypatch.setattr("formiga_bt.cli.options.connect_source", lambda *_: found.pop(0))
    engine = module.HttpSource(PLACE)
    with pytest.raises(NoEngine):
        engine.now()
    assert [engine.now(), engine.now()] == ["now", "now"]
    assert found == []


def test_without_a_terminal_it_says_what_scripts_do_instead(
    capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    assert run(["watch"]) == 2
    wording(capsys.readouterr().err)


def test_without_an_engine_it_says_how_to_start_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        monkeypatch.setattr(stream, "isatty", lambda: True, raising=False)
    assert run(["watch"]) == 1
    assert "formiga up" in capsys.readouterr().err
