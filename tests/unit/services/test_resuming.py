"""A service that was killed goes on from its journal: what is open, under which numbers, in which versions of its tasks.

The kill is a copy of the site's folder, taken while the service runs: what a dead process leaves on disk.
"""

import json
import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.base.errors import FormigaError, SiteError
from formiga_bt.cli.author.starts import start
from formiga_bt.cli.inputs import read_task, read_world
from formiga_bt.engine.kernel.inputs import Duty, LockdownOrder, Operator
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.restart import resume
from formiga_bt.engine.restart.reconcile import Reconcile
from formiga_bt.lang.model import Catalogue
from formiga_bt.services.host import EngineHost
from formiga_bt.services.kept.journaling import JournalAt
from formiga_bt.services.kept.resuming import ALIVE, RESUMING, Blame, Sign, _check_catalogue, last_sign
from formiga_bt.show.replay.machine import TimeMachine
from formiga_bt.show.replay.source import JournalSource
from formiga_bt.show.replay.story import tale
from tests.copying import copied
from tests.golden import Wording, timeless
from tests.unit.services.conftest import TREES, Service
from tests.unit.services.wire import Wire

Up = Callable[..., AbstractContextManager[Service]]


@pytest.fixture
def up(tmp_path: Path) -> Up:
    """Start a service with a journal in a folder below `tmp_path`; `trees` replace task files."""

    @contextmanager
    def begin(
        where: str,
        trees: dict[str, str] | None = None,
        site: str = "",
        journal: bool = True,
        swap: tuple[tuple[str, str], ...] = (),
        **options: Any,
    ) -> Iterator[Service]:
        folder = tmp_path / where
        folder.mkdir(exist_ok=True)
        text = start("site").replace("@site", "meadow") + site
        for old, new in swap:
            assert old in text
            text = text.replace(old, new)
        (folder / "site.yaml").write_text(text, encoding="utf-8")
        world = read_world((), folder / "site.yaml")
        assert world.site is not None
        tasks, texts = {}, {}
        for name, text in {**TREES, **(trees or {})}.items():
            (folder / name).write_text(text, encoding="utf-8")
            read = read_task(folder / name, world)
            assert read.task is not None, read.diagnostics
            tasks[read.task.name], texts[read.task.name] = read.task, dict(read.sources)
        options = {"http": "127.0.0.1:0", "desk": {"watcher_1": "watcher"}, **options}
        at = JournalAt() if journal else None
        wire = Wire()
        with EngineHost(
            world.site, world.catalogue, tasks, beside=folder, wires=[wire], journal=at, texts=texts, **options
        ) as host:
            yield Service(host, wire)

    return begin


@pytest.fixture
def kill(tmp_path: Path) -> Callable[[str, str], Path]:
    """Leave what a service would leave that is killed now, in another folder; return its runtime folder."""

    def copy(where: str, to: str) -> Path:
        copied(tmp_path / where, tmp_path / to)
        return tmp_path / to / ".formiga" / "meadow"

    return copy


def open_questions(service: Service) -> list[tuple[str, str]]:
    return [(q["number"], q["task"]) for q in service.get("/v1/inbox")["questions"]]


TWO = """\
formiga: 1
task: Two
agents: {watcher: {type: watcher}}
steps:
  - {ask: Is it good?, of: [watcher], options: [yes_it_is, no_not_yet], timeout: 30 min}
  - {ask: Still?, of: [watcher], options: [yes_it_is, no_not_yet], timeout: 30 min}
"""


def seen(service: Service, task: str) -> tuple[list[str], list[str], list[str]]:
    """Return statuses of steps, why these agents, and what it waited for until then."""
    facts = service.get(f"/v1/tasks/{task}/picture")["steps"]
    steps = [step["status"] for step in facts if "[" in step["path"]]
    chosen = [one["text"] for one in service.get(f"/v1/tasks/{task}/why")["because"] if one["role"]]
    waits = [one["text"] for one in service.get(f"/v1/timeline?task={task}")["waits"] if one.get("end")]
    assert chosen
    assert waits
    return steps, chosen, waits


def shown_questions(service: Service) -> list[str]:
    return [q["number"] for q in service.get("/v1/inbox")["questions"] if q["shown"]]


def settled(service: Service) -> None:
    service.wait(lambda: service.host.driver.engine.state.resume is None)


class TestOpen:
    def test_a_question_stays_open_and_ids_go_on(
        self, up: Up, kill: Callable[[str, str], Path], wording: Wording
    ) -> None:
        with up("one") as first:
            mine = first.submit("Ask")
            first.wait(lambda: open_questions(first))
            kill("one", "two")
        with up("two") as second:
            assert second.host.resumed[0].startswith("resumed after ")
            wording(timeless(second.host.resumed[0]))
            settled(second)
            second.wait(lambda: open_questions(second))
            assert open_questions(second) == [("Q1", mine)]
            assert second.submit("Ask") == "Ask-2"
            second.wait(lambda: len(open_questions(second)) == 2)
            assert open_questions(second)[1] == ("Q2", "Ask-2")
            second.post("/v1/inbox/Q1/answer", {"option": "yes_it_is", "by": "watcher_1"})
            assert second.ends(mine)["status"] == "SUCCEEDED"

    def test_a_clean_end_is_gone_on_from_as_well(self, up: Up) -> None:
        with up("one") as first:
            mine = first.submit("Stay")
        with up("one") as second:
            assert second.task(mine)["status"] == "ACTIVE"
            assert second.submit("Stay") == "Stay-2"

    def test_what_was_before_the_kill_is_shown(self, up: Up, kill: Callable[[str, str], Path], tmp_path: Path) -> None:
        """Of a task that had ended, and of one that goes on: its steps, what it waited for, and in its story the kill."""
        with up("one", {"two.yaml": TWO}) as first:
            over, goes_on = first.submit("Ask"), first.submit("Two")
            first.wait(lambda: len(open_questions(first)) == 2)
            for question in ("Q1", "Q2"):
                first.wait(lambda question=question: question in shown_questions(first))
                first.post(f"/v1/inbox/{question}/answer", {"option": "yes_it_is", "by": "watcher_1"})
            first.ends(over)
            first.wait(lambda: [number for number, _ in open_questions(first)] == ["Q3"])
            shown = {one: seen(first, one) for one in (over, goes_on)}
            kill("one", "two")
        assert shown[over][0] == ["success", "success"]
        assert shown[goes_on][0] == ["success", "running"]
        with up("two", {"two.yaml": TWO}) as second:
            settled(second)
            assert seen(second, over) == shown[over]
            assert seen(second, goes_on) == shown[goes_on]
            second.wait(lambda: shown_questions(second) == ["Q3"])
            second.post("/v1/inbox/Q3/answer", {"option": "no_not_yet", "by": "watcher_1"})
            assert second.ends(goes_on)["status"] == "SUCCEEDED"
            assert seen(second, goes_on)[0] == ["success", "success"]
            second.wait(lambda: second.get(f"/v1/past/tasks/{goes_on}")["picture"]["task"].get("ended_at"))
            with TimeMachine(tmp_path / "two/.formiga/meadow/journal.db", "meadow") as machine:
                told = [one.text for one in tale(JournalSource(machine), goes_on).events]
                assert "engine ended" not in " ".join(one.text for one in tale(JournalSource(machine), over).events)
        kills = [text for text in told if "engine" in text]
        assert len(kills) == 1
        assert re.fullmatch(r"the engine ended without notice, started again after \d+\.\d s", kills[0])

    def test_without_a_journal_nothing_is_known(self, up: Up) -> None:
        with up("one", journal=False) as first:
            mine = first.submit("Stay")
        with up("one", journal=False) as second:
            assert second.host.resumed == []
            assert second.call("GET", f"/v1/tasks/{mine}")[0] == 404

    def test_lockdown_and_duty_stand(self, up: Up, kill: Callable[[str, str], Path]) -> None:
        site = "pilots: [{id: pia, max_airborne: 1}]\n"
        with up("one", site=site) as first:
            first.host.driver.ask(Duty("pia", on=True))
            first.host.driver.ask(LockdownOrder("return", "ann"))
            first.wait(lambda: first.get("/v1/health")["lockdown"]["on"])
            kill("one", "two")
            kill("one", "three")
        with up("two", site=site) as second:
            settled(second)
            assert second.get("/v1/health")["lockdown"]["by"] == "ann"
            assert list(second.host.driver.engine.state.duty) == ["pia"]
        with up("three", site=f"{site}resume_hold_after: 0 s\n") as third:
            settled(third)
            assert list(third.host.driver.engine.state.duty) == []


class TestHeld:
    def test_after_a_long_outage_tasks_wait_for_a_word(
        self, up: Up, kill: Callable[[str, str], Path], wording: Wording
    ) -> None:
        with up("one") as first:
            mine = first.submit("Stay")
            first.wait(lambda: first.task(mine)["status"] == "ACTIVE")
            kill("one", "two")
        with up("two", site="resume_hold_after: 0 s\n") as second:
            wording(second.host.resumed[1])
            settled(second)
            second.wait(lambda: second.task(mine)["held"])
            assert "held.resume" in second.codes(mine)
            second.host.driver.ask(Operator("continue", mine, "ann"))
            second.wait(lambda: not second.task(mine)["held"])

    def test_how_long_it_was_away_is_counted_from_the_last_sign_of_life(
        self, up: Up, kill: Callable[[str, str], Path]
    ) -> None:
        with up("one") as first:
            mine = first.submit("Stay")
            first.wait(lambda: first.task(mine)["status"] == "ACTIVE")
            first.host.pulse._give()
            folder = kill("one", "two")
        sign = last_sign(folder)
        assert sign is not None
        with up("two") as second:
            assert second.host._back is not None
            assert second.host._back.sign.wall >= sign.wall
            assert second.host.driver.now() >= sign.at


class TestVersions:
    CHANGED = TREES["stay.yaml"].replace("1 h", "2 h")

    def test_what_runs_goes_on_with_its_exact_text_and_new_requests_get_the_new_one(
        self, up: Up, kill: Callable[[str, str], Path]
    ) -> None:
        with up("one") as first:
            mine = first.submit("Stay")
            first.wait(lambda: first.task(mine)["status"] == "ACTIVE")
            old = first.host._tasks["Stay"].bundle
            kill("one", "two")
        with up("two", {"stay.yaml": self.CHANGED}) as second:
            state = second.host.driver.engine.state
            assert state.tasks[mine].request.bundle == old
            other = second.submit("Stay")
            assert state.tasks[other].request.bundle == second.host._tasks["Stay"].bundle != old
            assert (state.tasks[mine].request.version, state.tasks[other].request.version) == (1, 2)
            assert "version" in second.codes(mine)

    def test_and_once_more(self, up: Up, kill: Callable[[str, str], Path]) -> None:
        with up("one") as first:
            mine = first.submit("Stay")
            kill("one", "two")
        with up("two", {"stay.yaml": self.CHANGED}) as second:
            other = second.submit("Stay")
            kill("two", "three")
        with up("three", {"stay.yaml": self.CHANGED}) as third:
            state = third.host.driver.engine.state
            third.wait(lambda: third.task(mine)["status"] == third.task(other)["status"] == "ACTIVE")
            assert state.tasks[mine].request.bundle != state.tasks[other].request.bundle
            assert [one.n for one in state.library["Stay"]] == [1, 2]

    def test_files_that_were_not_kept_send_it_home(
        self, up: Up, kill: Callable[[str, str], Path], wording: Wording
    ) -> None:
        with up("one") as first:
            mine = first.submit("Stay")
            first.wait(lambda: first.task(mine)["status"] == "ACTIVE")
            journal = first.host.journaling.journal
            assert journal is not None
            (row,) = [row for row in journal.bundles() if row.name == "Stay"]
            journal.keep_bundle("Stay", row.bundle, "elsewhere.yaml", {"lost.yaml": "-"})
            kill("one", "two")
        with up("two", {"stay.yaml": self.CHANGED}) as second:
            wording(second.host.resumed[1])
            ended = second.ends(mine)
            assert (ended["status"], ended["code"]) == ("FAILED", "upgrade")


class TestSite:
    def test_who_is_admitted_and_where_is_as_the_site_file_says_now(
        self, up: Up, kill: Callable[[str, str], Path]
    ) -> None:
        with up("one") as first:
            state = first.host.driver.engine.state
            first.wire.add("lwd_1", "lwd", first.host.site.ports["p1"].at)
            first.wait(lambda: "lwd_1" in state.agents)
            assert (state.agents["lwd_1"].home, state.agents["lwd_1"].refused) == ("p1", "")
            kill("one", "two")
        swap = (
            ("lwd_1: {type: lwd, home: p1}", "lwd_1: {type: lwd, home: p2}"),
            ("lwd_2: {type: lwd, home: p2}", "lwd_2: {type: lwd, home: p1}"),
        )
        with up("two", swap=swap) as second:
            settled(second)
            assert second.host.driver.engine.state.agents["lwd_1"].home == "p2"

    def test_a_catalogue_without_what_works_is_refused(self, wording: Wording) -> None:
        state = EngineState(agents={"hwd_1": AgentRecord(id="hwd_1", type="hwd", task="PickUp-1")})
        with pytest.raises(SiteError) as said:
            _check_catalogue(state, Catalogue())
        wording(str(said.value))
        state = EngineState(goals={"g": GoalRecord(id="g", agent="hwd_1", action="Dance", task="PickUp-1")})
        with pytest.raises(SiteError) as refused:
            _check_catalogue(state, Catalogue())
        wording(refused.value)


class TestBlame:
    def test_a_tree_that_cannot_be_rebuilt_stops_nothing_else(
        self, up: Up, kill: Callable[[str, str], Path], monkeypatch: pytest.MonkeyPatch, wording: Wording
    ) -> None:
        with up("one") as first:
            mine, other = first.submit("Stay"), first.submit("Stay")
            first.wait(lambda: first.task(other)["status"] == "ACTIVE")
            kill("one", "two")
        restore = resume._restore

        def breaks(core: Any, runs: Any, recovery: Any, task: Any) -> None:
            if task.id == mine:
                raise KeyError("steps[0]")
            restore(core, runs, recovery, task)

        monkeypatch.setattr(resume, "_restore", breaks)
        with up("two") as second:
            ended = second.ends(mine)
            assert ended["code"] == "upgrade"
            wording(ended["reason"])
            assert second.task(other)["status"] == "ACTIVE"

    def test_a_task_that_stops_the_engine_twice_is_not_resumed_a_third_time(
        self, up: Up, kill: Callable[[str, str], Path], monkeypatch: pytest.MonkeyPatch, wording: Wording
    ) -> None:
        with up("one") as first:
            mine, other = first.submit("Stay"), first.submit("Stay")
            first.wait(lambda: first.task(other)["status"] == "ACTIVE")
            folder = kill("one", "two")
        begin = Reconcile.begin

        def breaks(self: Reconcile, given: Any) -> None:
            begin(self, given)
            if mine not in given.poison:
                self._core.at_work = mine
                raise RuntimeError("a bug")

        monkeypatch.setattr(Reconcile, "begin", breaks)
        for tries in (1, 2):
            with pytest.raises(FormigaError, match="a bug"):
                self.run(up("two"))
            assert json.loads((folder / RESUMING).read_text())["tries"] == {mine: tries}
        with up("two") as third:
            wording(third.host.resumed[-1])
            assert third.ends(mine)["code"] == "exception"
            assert third.task(other)["status"] == "ACTIVE"
            third.wait(lambda: not (folder / RESUMING).exists())

    @staticmethod
    def run(up: AbstractContextManager[Service]) -> None:
        with up as service:
            service.wait(service.host.is_over)
            service.host.check()

    def test_a_process_that_dies_while_it_rebuilds_a_task_counts(self, tmp_path: Path) -> None:
        for tries in (1, 2):
            Blame(tmp_path).look("Stay-1")  # and then it dies
            assert Blame(tmp_path).tries == {"Stay-1": tries}
        assert Blame(tmp_path).poison == ("Stay-1",)
        Blame(tmp_path).look("")
        assert Blame(tmp_path).poison == ("Stay-1",)


def test_a_sign_of_life_that_cannot_be_read_is_none(tmp_path: Path) -> None:
    assert last_sign(tmp_path) is None
    (tmp_path / ALIVE).write_text("{", encoding="utf-8")
    assert last_sign(tmp_path) is None
    (tmp_path / ALIVE).write_text('{"wall": 5, "at": 7}', encoding="utf-8")
    assert last_sign(tmp_path) == Sign(5, 7)
