"""The outbox: which news a step has, that they are in its commit, in order, and made again are the same."""

from pathlib import Path

import pytest

from formiga_bt.engine.kernel.inputs import AcknowledgeAlarm, LockdownOrder
from formiga_bt.journal.keep import Retention, compact
from formiga_bt.journal.outbox import NewsItem, news_of
from formiga_bt.journal.store import Journal
from formiga_bt.journal.writer import Writer
from tests.unit.engine.ruled import SOS, Ruled

HELP = """\
formiga: 1
task: Help
params: {who: {type: agent, of: [picker, drone]}, spot: {type: place, optional: true}}
agents: {watcher: {type: watcher}}
steps:
  - ask: Shall ${who} be fetched?
    of: [watcher]
    options: [yes_do, no_leave_it]
    timeout: 1 min
  - fail: nobody_came
"""


def played(here: Path) -> Ruled:
    """Play an SOS whose question nobody answers, and a lockdown that somebody acknowledges."""
    bench = Ruled(here, SOS, tasks=(HELP,))
    bench.press()
    bench.run_until_ended()
    bench.ask(LockdownOrder("hold", by="ann"))
    bench.ask(AcknowledgeAlarm("A1", by="ann"))
    bench.ask(LockdownOrder("release", by="ann"))
    return bench


def told(items: list[NewsItem]) -> list[tuple[str, str, str]]:
    return [(item.kind, item.id, item.severity) for item in items]


def test_each_thing_is_news_once(tmp_path: Path) -> None:
    bench = played(tmp_path)
    items = [item for step in bench.steps for item in news_of(step)]
    (task,) = bench.tasks_of("sos")
    assert told(items) == [
        ("question.opened", "Q1", "warning"),
        ("task.ended", task.id, "warning"),
        ("alarm.raised", "A1", "critical"),
        ("alarm.acknowledged", "A1", "critical"),
        ("alarm.cleared", "A1", "critical"),
    ]
    assert len({(item.seq, item.n) for item in items}) == len(items)
    assert (items[1].code, items[1].by) == (bench.task(task.id).outcome.code, "rule:sos")


def test_news_are_in_the_commit_of_their_step(tmp_path: Path) -> None:
    bench = played(tmp_path)
    items = [item for step in bench.steps for item in news_of(step)]
    with Journal(tmp_path / "journal.db", "meadow") as journal:
        journal.take()
        writer = Writer(journal, lambda: bench.engine.state, wall=lambda: 0, clock=lambda: 0.0, outbox=True)
        assert writer.keep(bench.steps).durable
        urgent, rest = journal.news(0, urgent=True, most=100), journal.news(0, urgent=False, most=100)
        assert [*rest, *urgent] == items
        assert journal.news(urgent[0].seq, urgent=True, most=1) == [urgent[1]]
        assert journal.news(rest[-1].seq, urgent=False, most=100) == []


def test_a_page_has_whole_steps(tmp_path: Path) -> None:
    bench = played(tmp_path)
    with Journal(tmp_path / "journal.db", "meadow") as journal:
        journal.take()
        one = next(item for step in bench.steps for item in news_of(step))
        for n in range(3):
            row = journal._news_row(NewsItem(**{**_fields(one), "seq": 7, "n": n}))
            with journal._transaction(None, None) as connection:
                journal._hot.news.run(connection, row)
        assert [item.n for item in journal.news(0, urgent=False, most=1)] == [0, 1, 2]


@pytest.mark.parametrize("outbox", [True, False])
def test_news_go_with_the_steps_that_retention_removes(tmp_path: Path, *, outbox: bool) -> None:
    bench = played(tmp_path)
    with Journal(tmp_path / "journal.db", "meadow") as journal:
        journal.take()
        writer = Writer(journal, lambda: bench.engine.state, wall=lambda: 0, clock=lambda: 0.0, outbox=outbox)
        writer.begin()
        writer.keep(bench.steps)
        writer.end()
        assert bool(journal.news(0, urgent=False, most=9)) is outbox
        compact(journal, bench.now + 60 * 86_400_000_000, Retention(history_days=1.0))
        assert journal.news(0, urgent=False, most=9) == journal.news(0, urgent=True, most=9) == []


def _fields(item: NewsItem) -> dict[str, object]:
    return {name: getattr(item, name) for name in item.__struct_fields__}
