"""A channel in virtual time: in order, again until taken, the urgent first, quiet by night, each message with its own id."""

import asyncio
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import Any

import msgspec
import pytest

from formiga_bt.base.errors import JournalError
from formiga_bt.base.severities import Severity
from formiga_bt.engine.kernel.news_marks import NewsMark
from formiga_bt.journal.outbox import NewsItem
from formiga_bt.lang.model.news import Channel, Quiet, SecretAt, Webhook
from formiga_bt.services.news.channel import LOOK_S, MOST_WAIT_S, TRIES_OF_REFUSED, ChannelWork
from formiga_bt.services.news.log import NewsLog
from formiga_bt.services.news.message import Message, message_of
from formiga_bt.services.news.sending import Outcome

TO = Webhook(url=SecretAt(env="U"), secret=SecretAt(env="S"))
GOOD, DEAD = Outcome("delivered", "200"), Outcome("failed", "nobody there")


def item(seq: int, severity: Severity = "info", n: int = 0, **more: Any) -> NewsItem:
    return NewsItem(
        seq=seq, n=n, at=seq * 1_000_000, what="alarms", kind="alarm.raised", severity=severity, id=f"A{seq}",
        state="raised", **more,
    )  # fmt: skip


class Bench:
    """A channel, its receiver, and a clock that the test moves."""

    def __init__(
        self, *, mark: NewsMark | None = None, kept: int = 2000, outbox: Sequence[NewsItem] | None = None, **of: Any
    ) -> None:
        self.now_s = 1000.0
        self.hour = datetime(2026, 11, 28, 12, 0, tzinfo=UTC)
        self.took: list[Message] = []
        self.says: list[Outcome] = []
        self.closed = 0
        self.outbox = outbox
        self.news = NewsLog(0, self.read if outbox is not None else None, kept)
        self.channel = Channel(name="room", to=TO, **of)
        self.work = self.begin(mark or NewsMark(0, 0))

    def begin(self, mark: NewsMark) -> ChannelWork:
        """Begin anew, as after a kill."""
        self.work = ChannelWork(
            self.channel, self, self.news, mark, lambda one, channel: message_of(one, channel, "meadow", "e1"),
            hour=lambda: self.hour, clock=lambda: self.now_s, chance=lambda: 1.0,
        )  # fmt: skip
        return self.work

    def read(self, after: int, urgent: bool, most: int) -> list[NewsItem]:
        assert self.outbox is not None
        return [one for one in self.outbox if one.seq > after and one.urgent is urgent][:most]

    async def send(self, message: Message) -> Outcome:
        said = self.says.pop(0) if self.says else GOOD
        if said.how == "delivered":
            self.took.append(message)
        return said

    async def close(self) -> None:
        self.closed += 1

    def go(self, turns: int = 100) -> float:
        """Work until there is nothing to do now; return for how long."""
        for _ in range(turns):
            wait_s = asyncio.run(self.work.turn())
            if wait_s > 0:
                return wait_s
        return 0.0

    @property
    def ids(self) -> list[str]:
        return [str(msgspec.json.decode(one.body)["data"]["id"]) for one in self.took]


def test_news_go_in_order_and_once_and_the_mark_says_how_far() -> None:
    bench = Bench()
    for seq in (3, 5, 9):
        bench.news.add([item(seq)])
    assert bench.go() == LOOK_S
    assert bench.ids == ["A3", "A5", "A9"]
    assert bench.work.mark == NewsMark(9, 0)
    assert len({one.id for one in bench.took}) == 3


def test_a_dead_receiver_is_tried_ever_less_often_and_nothing_is_lost() -> None:
    bench = Bench()
    bench.news.add([item(3)])
    bench.says = [DEAD] * 12
    waits = []
    while not bench.took:
        wait_s = bench.go()
        waits.append(wait_s)
        assert bench.work.mark == NewsMark(0, 0) or bench.took
        bench.now_s += wait_s / 2
        if not bench.took:
            assert bench.go() == pytest.approx(wait_s / 2)  # woken meanwhile it waits on
        bench.now_s += wait_s / 2
    assert waits[:3] == [0.5, 1.0, 2.0]
    assert max(waits) == MOST_WAIT_S
    assert bench.ids == ["A3"]
    assert bench.work.stands.failing_since is None


def test_a_receiver_may_ask_for_time_but_not_for_a_week() -> None:
    bench = Bench()
    bench.news.add([item(3)])
    bench.says = [Outcome("failed", "busy", after_s=30.0), Outcome("failed", "busy", after_s=700_000.0)]
    assert bench.go() == 30.0
    bench.now_s += 30
    assert bench.go() == 600.0


def test_after_a_kill_what_was_not_marked_is_told_again_with_the_same_id() -> None:
    outbox = [item(3), item(5), item(5, n=1), item(9)]
    bench = Bench(outbox=outbox)
    bench.news.add(outbox[:1])
    bench.news.add(outbox[1:3])
    bench.go(2)  # the second of step 5 is on its way when it is killed
    assert bench.work.mark == NewsMark(4, 0)
    first = [one.id for one in bench.took]
    bench.news = NewsLog(9, bench.read)
    bench.begin(bench.work.mark)
    bench.go()
    assert bench.ids == ["A3", "A5", "A5", "A5", "A9"]
    assert bench.took[2].id == first[1]
    assert len({one.id for one in bench.took}) == len(outbox)


def test_what_is_critical_overtakes_the_rest() -> None:
    bench = Bench()
    for seq in range(1, 6):
        bench.news.add([item(seq)])
    bench.go(2)
    bench.news.add([item(6, "critical")])
    bench.go()
    assert bench.ids == ["A1", "A2", "A6", "A3", "A4", "A5"]
    assert bench.work.mark == NewsMark(5, 6)


def test_by_night_only_what_is_critical_goes_out_and_in_the_morning_the_rest() -> None:
    bench = Bench(quiet=Quiet(22 * 60, 6 * 60))
    bench.hour = bench.hour.replace(hour=23)
    bench.news.add([item(1, "alarm")])
    bench.news.add([item(2, "critical")])
    bench.go()
    assert bench.ids == ["A2"]
    bench.begin(bench.work.mark)  # killed by night
    bench.go()
    assert bench.ids == ["A2"]
    bench.hour += timedelta(hours=7)
    bench.go()
    assert bench.ids == ["A2", "A1"]


@pytest.mark.parametrize(("at", "holds"), [("21:59", False), ("22:00", True), ("05:59", True), ("06:00", False)])
def test_quiet_hours_end_on_the_next_day(at: str, *, holds: bool) -> None:
    hour, minute = map(int, at.split(":"))
    assert Quiet(22 * 60, 6 * 60).holds(hour * 60 + minute) is holds


def test_a_message_that_the_receiver_cannot_take_holds_up_the_others_only_a_while() -> None:
    bench = Bench()
    bench.news.add([item(1)])
    bench.news.add([item(2)])
    bench.says = [Outcome("refused", "400")] * TRIES_OF_REFUSED
    for _ in range(TRIES_OF_REFUSED):
        bench.now_s += bench.go()
    bench.go()
    assert bench.ids == ["A2"]
    assert (bench.work.stands.passed_over, bench.work.mark) == (1, NewsMark(2, 0))


def test_only_what_the_channel_is_for() -> None:
    bench = Bench(severity="warning", tasks=("PickUp",), what=("alarms",))
    bench.news.add([item(1, "warning", task="PickUp-12")])
    bench.news.add([item(2, "info", task="PickUp-12")])
    bench.news.add([item(3, "alarm", task="Survey-1")])
    bench.news.add([item(4, "alarm")])
    bench.news.add([msgspec.structs.replace(item(5, "alarm", task="PickUp-1"), what="ends")])
    bench.go()
    assert bench.ids == ["A1"]
    assert bench.work.mark == NewsMark(5, 0)


def test_an_escalation_goes_to_its_channel_only_and_nothing_else_does() -> None:
    mine, other = Bench(unacknowledged_us=1), Bench()
    for bench in (mine, other):
        bench.news.add([item(1, "critical")])
        bench.news.add([item(2, "critical", to="room")])
        bench.news.add([item(3, "critical", to="elsewhere")])
        bench.go()
    assert mine.ids == ["A2"]
    assert other.ids == ["A1", "A2"]  # its name is room, too


def test_memory_is_bounded_and_the_rest_comes_from_the_outbox() -> None:
    everything = [item(seq, "critical" if seq % 10 == 0 else "info") for seq in range(1, 501)]
    bench = Bench(kept=20, outbox=everything)
    for one in everything:
        bench.news.add([one])
    bench.go(1000)
    assert len(bench.took) == 500
    assert bench.ids[:50] == [f"A{seq}" for seq in range(10, 501, 10)]
    assert bench.ids[50:] == [f"A{seq}" for seq in range(1, 501) if seq % 10]


def test_an_outbox_that_cannot_be_read_is_tried_again() -> None:
    bench = Bench(kept=1, outbox=[item(1), item(2), item(3)])
    for one in bench.outbox or ():
        bench.news.add([one])
    good = bench.read

    def broken(*_: Any) -> list[NewsItem]:
        raise JournalError("no disk")

    bench.news._read = broken
    wait_s = bench.go()
    assert (bench.took, bench.work.stands.text) == ([], "the outbox cannot be read: no disk")
    bench.news._read = good
    bench.now_s += wait_s
    bench.go()
    assert bench.ids == ["A1", "A2", "A3"]


def test_names_and_texts_stay_here_unless_the_site_says_otherwise() -> None:
    told = item(
        1, text="picker Anna fell", person="picker_1", by="ann", note="I go", about="anna", agent="", code="notify"
    )
    quiet, loud = Bench(), Bench(text=True)
    for bench in (quiet, loud):
        bench.news.add([told])
        bench.go()
    data = msgspec.json.decode(quiet.took[0].body)
    assert data == {
        "type": "alarm.raised", "timestamp": "1970-01-01T00:00:01.000Z",
        "data": {"site": "meadow", "id": "A1", "state": "raised", "severity": "info", "code": "notify"},
    }  # fmt: skip
    assert b"Anna" in loud.took[0].body
    assert b"picker_1" in loud.took[0].body
