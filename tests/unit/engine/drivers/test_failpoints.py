"""Where an engine kills itself: what is on disk there, and what has left."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.base.errors import SiteError
from formiga_bt.engine.drivers import failpoints
from formiga_bt.engine.drivers.failpoints import POINTS, Failpoint, named
from formiga_bt.engine.drivers.persist import DURABLE, Outcome, PersistAhead
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import TurnDue
from formiga_bt.journal.store import Journal
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import packaged_task, packaged_world
from tests.golden import Wording


class Died(Exception):  # noqa: N818 - it is no error
    """What dying is here."""


def die(text: str) -> None:
    raise Died(text)


class Flight:
    """A drone's flight whose engine has a failpoint; `left` is what its wire took."""

    def __init__(self, point: str, at: int) -> None:
        site, catalogue = packaged_world()
        self.flight = Rehearsal(site, catalogue, [packaged_task("move_task")], fleet_of(site, catalogue))
        self.flight.run_for(1)
        self.failpoint = Failpoint(point, at, die)
        self.kept: list[inp.EngineStep] = []
        self.left: list[str] = []
        self.name, self._wire = "noted", self.flight.hub.transport
        driver = self.flight.driver
        driver._persist = self.failpoint.persist(self, lambda: self.flight.engine.state)
        wire = self.failpoint.wire(self)  # type: ignore[arg-type]
        driver.switchboard._of = dict.fromkeys(driver.switchboard._of, wire)

    def keep(self, steps: Sequence[inp.EngineStep]) -> Outcome:
        self.kept += steps
        return DURABLE

    def send_goal(self, request: inp.SendGoal) -> None:
        self.left.append(request.goal_id)
        self._wire.send_goal(request)  # type: ignore[arg-type]

    def cancel_goal(self, agent: str, goal_id: str) -> None:
        self.left.append(f"cancel {goal_id}")
        self._wire.cancel_goal(agent, goal_id)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._wire, name)  # what a wire does besides

    @property
    def ordered(self) -> list[str]:
        """Return the goals whose orders are on disk."""
        return [effect.goal_id for step in self.kept for effect in step.effects if isinstance(effect, inp.SendGoal)]

    def until_death(self, abort_at: str = "") -> str:
        with pytest.raises(Died) as died:
            self._fly(abort_at)
        self.flight.close()
        return str(died.value)

    def _fly(self, abort_at: str) -> None:
        self.flight.submit("MoveTask", {"robot": AgentRef("lwd_1")})
        if abort_at:
            assert self.flight.run_until(lambda: any(abort_at in goal for goal in self.left), limit_s=600)
            self.flight.abort("MoveTask-1")
        self.flight.run_until_ended()


@pytest.fixture(autouse=True)
def no_sleep(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(failpoints, "LEAVES_S", 0.0)


@pytest.mark.parametrize(
    ("point", "kept", "left"), [("before_commit", 1, 1), ("after_commit", 2, 1), ("after_send", 2, 2)]
)
def test_an_order_is_kept_before_it_leaves(point: str, kept: int, left: int) -> None:
    one = Flight(point, 2)
    assert one.until_death() == f"{point}:2"
    assert (len(one.ordered), len(one.left)) == (kept, left)


class Parts:
    """Keeps steps in three parts."""

    def __init__(self) -> None:
        self.done: list[str] = []

    def keep(self, steps: Sequence[inp.EngineStep]) -> Outcome:
        raise AssertionError("it is kept in parts")

    def start(self, steps: Sequence[inp.EngineStep]) -> bool:
        self.done.append("start")
        return True

    def commit(self) -> None:
        self.done.append("commit")

    def finish(self) -> Outcome:
        self.done.append("finish")
        return DURABLE


@pytest.mark.parametrize(("point", "done"), [("before_commit", []), ("after_commit", ["start", "commit", "finish"])])
def test_what_is_kept_in_parts_has_the_same_points(point: str, done: list[str]) -> None:
    parts, order = Parts(), inp.CancelGoal("MoveTask-1/1/steps/steps[0]", "lwd_1")
    failing = Failpoint(point, 1, die).persist(parts, EngineState)
    assert isinstance(failing, PersistAhead)
    with pytest.raises(Died):
        keep_in_parts(failing, inp.EngineStep(1, 0, inp.TimerDue(TurnDue()), (), (order,)))
    assert parts.done == done


def keep_in_parts(persist: PersistAhead, step: inp.EngineStep) -> None:
    persist.start([step])
    persist.commit()
    persist.finish()


def test_a_result_that_was_taken_is_not_on_disk() -> None:
    one = Flight("after_result", 1)
    assert one.until_death() == "after_result:1"
    ends = [
        step
        for step in one.kept
        if isinstance(step.input, inp.GoalEventInput) and step.input.event.state == "succeeded"
    ]
    assert (ends, len(one.left)) == ([], 1)


def test_cleanup_is_what_follows_an_abort() -> None:
    one = Flight("in_cleanup", 1)
    assert one.until_death(abort_at="[0]") == "in_cleanup:1"
    assert "/recover:lwd_1" in one.ordered[-1]
    assert one.ordered[-1] not in one.left


def test_a_flight_without_cleanup_passes_none() -> None:
    one = Flight("in_reconcile", 1)
    one.flight.submit("MoveTask", {"robot": AgentRef("lwd_1")})
    one.flight.run_until_ended()
    assert one.failpoint.passed == 0
    one.flight.close()


def test_reconcile_is_while_agents_are_asked() -> None:
    one = Flight("in_reconcile", 2)
    one.flight.submit("MoveTask", {"robot": AgentRef("lwd_1")})
    assert one.flight.run_until(lambda: one.left, limit_s=60)
    driver, now = one.flight.driver, one.flight.now
    driver.feed(inp.Resumed(epoch=2, at=now, since=now, wall=now, heard=now))
    with pytest.raises(Died):
        driver.feed(inp.Resumed(epoch=3, at=now, since=now, wall=now, heard=now))
    one.flight.close()


def test_a_snapshot_that_was_not_committed_is_not_there(tmp_path: Path) -> None:
    with Journal(tmp_path / "j.db", "s") as journal:
        journal.take()
        journal.begin(EngineState(), 0)
        journal.in_snapshot = lambda: Failpoint("in_snapshot", 1, die).passing("in_snapshot")
        with pytest.raises(Died):
            journal.snapshot(EngineState(seq=1), 1)
        assert journal.snapshots() == [(0, 0)]


def test_without_the_variable_there_is_none() -> None:
    assert named({}, "simulation") is None
    assert named({"FORMIGA_FAILPOINT": " "}, "real") is None


@pytest.mark.parametrize(("text", "at"), [("before_commit:17", 17), ("in_cleanup", 1)])
def test_the_variable_names_a_point_and_a_passing(text: str, at: int) -> None:
    found = named({"FORMIGA_FAILPOINT": text}, "simulation")
    assert found is not None
    assert (found.point, found.at) == (text.partition(":")[0], at)


def test_an_unknown_point_is_refused_with_those_there_are(wording: Wording) -> None:
    with pytest.raises(SiteError) as refused:
        named({"FORMIGA_FAILPOINT": "in_flight:3"}, "simulation")
    said = str(refused.value).splitlines()
    wording(said[:2])
    assert [line.split()[0] for line in said[2:]] == list(POINTS)


@pytest.mark.parametrize("number", ["0", "-1", "x", "1.5", "²"])
def test_what_is_no_number_is_refused(number: str) -> None:
    with pytest.raises(SiteError) as refused:
        named({"FORMIGA_FAILPOINT": f"after_send:{number}"}, "simulation")
    text = f"FORMIGA_FAILPOINT=after_send:{number}: {number!r} is no number from 1\n  help: FORMIGA_FAILPOINT=after_send:17"
    assert str(refused.value) == text


def test_a_real_site_has_none(wording: Wording) -> None:
    with pytest.raises(SiteError) as refused:
        named({"FORMIGA_FAILPOINT": "after_send"}, "real")
    wording(str(refused.value))


def test_every_point_is_in_the_documents() -> None:
    text = (Path(__file__).parents[4] / "docs" / "reliability.md").read_text(encoding="utf-8")
    rows = text.partition("### Failpoints")[2].partition("\n## ")[0].splitlines()
    assert [row.split("`")[1] for row in rows if row.startswith("| `")] == list(POINTS)
