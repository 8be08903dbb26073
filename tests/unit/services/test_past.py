"""The past through HTTP: a running engine shows its journal, in the shapes of the present."""

from pathlib import Path

import msgspec
import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.cli.options import connect_source
from formiga_bt.cli.past import source_of
from formiga_bt.client import PastClient
from formiga_bt.services.http.past_routes import PastTask
from formiga_bt.services.kept.journaling import JournalAt
from formiga_bt.show.facts import Chart, Now, Stats, Timeline
from formiga_bt.show.replay.source import WINDOW_US
from tests.golden import Wording, timeless
from tests.unit.services.conftest import Start

pytestmark = pytest.mark.network


def test_a_running_engine_shows_its_past(start: Start, tmp_path: Path, wording: Wording) -> None:
    """Before and after an answer; nothing of it goes through the engine's thread."""
    with start(journal=JournalAt(durability="normal")) as service:
        task = service.submit("Ask")
        service.wait(lambda: service.get("/v1/inbox")["questions"])
        (question,) = service.get("/v1/inbox")["questions"]
        number, option, person = question["number"], question["options"][0], question["asked"][0]
        asked = service.get("/v1/health")["at"] // 1000
        service.post(f"/v1/inbox/{number}/answer", {"option": option, "by": person})
        service.wait(lambda: service.task(task)["ended_at"])
        service.wait(lambda: service.get(f"/v1/past/tasks/{task}")["picture"]["task"].get("ended_at"))

        before = msgspec.convert(service.get(f"/v1/past?at={asked}"), Now)
        after = msgspec.convert(service.get("/v1/past"), Now)
        assert [number] == [question.number for question in before.questions]
        assert after.questions == ()
        assert ("past", asked * 1000) == (before.engine, before.at)
        assert {task} == {one.id for one in after.tasks}

        then = msgspec.convert(service.get(f"/v1/past/tasks/{task}?at={task}%20start"), PastTask)
        now = msgspec.convert(service.get(f"/v1/past/tasks/{task}"), PastTask)
        assert "SUCCEEDED" == now.picture.task.status != then.picture.task.status
        assert now.because[0].code == "succeeded"
        line = msgspec.convert(service.get(f"/v1/past/timeline?task={task}"), Timeline)
        assert {task} == {row.task for row in (*line.actions, *line.waits)}
        assert msgspec.convert(service.get("/v1/past/chart"), Chart).site == "meadow"
        assert [one.name for one in msgspec.convert(service.get("/v1/past/stats"), Stats).tasks] == ["Ask"]

        past = PastClient(connect_source(url=service.url), f"{task} start")
        assert then.picture == past.task(task)
        assert (f"{task} {then.picture.task.status}", list(then.because)) == past.why(task)
        assert then.picture.at == past.now().at
        assert {task} == {row.id for row in past.timeline([task]).tasks}
        assert (past.chart().site, past.stats().tasks) == ("meadow", ())
        with pytest.raises(TaskError, match="Ask-99"):
            past.task("Ask-99")

        wrong = service.refused("GET", "/v1/past?at=noon")
        assert (wrong["code"], wrong["status"]) == ("bad_moment", 422)
        gone = service.refused("GET", "/v1/past/tasks/Ask-99")
        assert (gone["code"], gone["status"]) == ("unknown_task", 404)
        early = service.refused("GET", f"/v1/past/tasks/{task}?at=start")
        assert (early["code"], early["status"]) == ("not_yet", 404)
        assert early["text"].startswith(f"{task} was requested at ")
        wording(early["help"])


def test_a_task_that_a_running_engine_forgot_is_found_in_its_journal(
    start: Start, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with start(journal=JournalAt(durability="normal")) as service:
        task = service.submit("Ask")
        service.wait(lambda: service.get("/v1/inbox")["questions"])
        service.wait(lambda: any(one["id"] == task for one in service.get("/v1/past")["tasks"]))
        with service.host.view.reading() as state:
            state.tasks.pop(task)
        source = source_of(tmp_path)
        assert task == source.task(task).task.id
        assert f"the engine has forgotten {task}; this is from its journal\n" == capsys.readouterr().err
        assert source.why(task)[0].startswith(task)
        assert {task} == {row.id for row in source.timeline([task]).tasks}
        with pytest.raises(TaskError, match="Ask-99"):
            source.task("Ask-99")


def ended(stats: Stats) -> int:
    return sum(one.n + one.failed for one in stats.tasks)


def test_an_engine_that_was_started_again_counts_what_was_before(
    start: Start, tmp_path: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    """In the folder its journal tells; an engine that was never started again, or wants no more than it has, tells itself."""
    with start(journal=JournalAt(durability="normal")) as service:
        service.ends(service.submit("Hello"))
        first = source_of(tmp_path)
        assert [(one.name, one.n) for one in first.stats().tasks] == [("Hello", 1)]
        assert first.chart().tracks
        assert capsys.readouterr().err == ""

    with start(journal=JournalAt(durability="normal")) as service:
        service.ends(service.submit("Hello"))
        live = connect_source(url=service.url)
        assert (ended(live.stats()), "Hello-1" in {one.task for one in live.chart().tracks}) == (1, False)
        again = source_of(tmp_path)
        service.wait(lambda: ended(again.stats()) == 2)
        capsys.readouterr()
        day = again.stats()
        wording(timeless(capsys.readouterr().err))
        assert day.at - day.since < WINDOW_US
        assert {one.name: one.n for one in day.actions}["TakeOff"] == 2
        assert again.stats(task="Nothing").tasks == ()
        wording(timeless(capsys.readouterr().err))
        assert "Hello-1" in {one.task for one in again.chart().tracks}
        capsys.readouterr()
        moment = again.stats(hours=1e-9)
        assert (moment.tasks, capsys.readouterr().err) == ((), "")
        assert again.timeline(["Hello-1"]).actions


def test_an_engine_without_a_journal_says_so(start: Start, wording: Wording) -> None:
    with start() as service:
        none = service.refused("GET", "/v1/past")
        assert (none["code"], none["status"]) == ("no_history", 404)
        wording(none["text"])
