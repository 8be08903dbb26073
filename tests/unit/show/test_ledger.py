"""The fold itself: it is the engine's state, it is bounded, it goes on from a loaded state, and tells of waits and events."""

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Position
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.causes import ClearanceHold, LockdownHold, TakeOverHold
from formiga_bt.engine.kernel.inputs import Alarm, EngineStep, Operator, Started
from formiga_bt.engine.kernel.records import AgentRecord, Deadline, GoalRecord, TaskHold, TaskRecord, TaskRequest
from formiga_bt.engine.kernel.replies import Refusal
from formiga_bt.engine.kernel.state import snapshot
from formiga_bt.engine.kernel.timers import LiveDue, TaskDue
from formiga_bt.show.history.ledger import Bounds, Ledger
from tests.golden import Wording
from tests.reloading import reloaded
from tests.unit.engine.yard import CART, Yard
from tests.unit.show.scene import source_of, told

AT = Position(10.0, 20.0, 0.0)


class Feeder:
    """Feeds steps of changes, a second apart."""

    def __init__(self, bounds: Bounds | None = None) -> None:
        self.ledger = Ledger(bounds)
        self.seq = 0

    def __call__(self, *changes: ch.Change, effects: tuple[Alarm, ...] = ()) -> None:
        self.seq += 1
        self.ledger.feed(EngineStep(self.seq, self.seq * SECOND, Started(1), changes, effects))


def task(number: int, section: str = "steps", **more: object) -> ch.TaskPut:
    over = section == "done"
    record = TaskRecord(
        id=f"T-{number}",
        name="T",
        order=number,
        request=TaskRequest(bundle=""),
        status="SUCCEEDED" if over else "ACTIVE",
        section=section,
        **more,
    )  # type: ignore[arg-type]
    return ch.TaskPut(record)


def goal(number: int, state: str, code: str = "", text: str = "") -> ch.GoalPut:
    of = f"T-{number}"
    return ch.GoalPut(
        GoalRecord(
            id=f"{of}/1/steps/steps[0]", agent="hwd_1", action="GoTo", task=of, state=state, code=code, text=text
        )  # type: ignore[arg-type]
    )


def test_the_fold_is_the_engines_state_after_every_kind_of_end() -> None:
    bench = Yard(CART + "steps: [{do: cart.Move}, {wait: 3 s}]", carts=2)
    source = source_of(bench)
    for n in range(6):
        one = bench.start()
        if n % 3 == 0:
            bench.abort(one)
        elif n % 3 == 1:
            bench.carts[0].fail() if bench.carts[0].side.active else bench.carts[1].fail()
        bench.run_for(2)
    bench.run_for(10)

    assert snapshot(source.ledger.state) == snapshot(bench.engine.state)


def test_ended_tasks_beyond_a_number_are_forgotten_with_all_that_is_kept_of_them() -> None:
    feed = Feeder(Bounds(ended=2))
    for number in range(1, 6):
        feed(task(number), goal(number, "sent"), ch.ScopePut(f"T-{number}", "", {"n": 1}))
        feed(goal(number, "succeeded"), ch.GoalDrop(f"T-{number}/1/steps/steps[0]"), task(number, "done"))
    feed(task(9))

    assert list(feed.ledger.stories) == ["T-4", "T-5", "T-9"]
    assert list(feed.ledger.state.tasks) == ["T-4", "T-5", "T-9"]
    assert list(feed.ledger.state.scopes) == ["T-4", "T-5"]
    assert [row.state for row in feed.ledger.stories["T-5"].rows] == ["succeeded"]


def test_a_row_has_the_step_that_sent_it() -> None:
    feed = Feeder()
    feed(task(1), goal(1, "sent"))
    home = GoalRecord(id="T-1/1/recover:hwd_1#1/steps[0]", agent="hwd_1", action="LandIn", task="T-1", state="sent")
    feed(ch.GoalPut(home))

    assert [row.path for row in feed.ledger.stories["T-1"].rows] == ["steps/steps[0]", ""]


def test_a_wait_at_the_gate_is_a_row_unless_the_goal_leaves_at_once() -> None:
    feed = Feeder()
    feed(task(1), goal(1, "gated"), goal(1, "sent"))
    assert list(feed.ledger.stories["T-1"].waits) == []
    feed(ch.GoalDrop("T-1/1/steps/steps[0]"), goal(1, "gated"), goal(1, "gated", "leg_busy", "hwd_2"))
    feed(goal(1, "gated", "leg_busy", "hwd_2"))
    feed(goal(1, "gated", "spot_busy", "hwd_2"))
    feed(goal(1, "sent"))

    waits = [(row.start, row.end, row.agent, row.text) for row in feed.ledger.stories["T-1"].waits]
    assert waits == [
        (2 * SECOND, 4 * SECOND, "hwd_1", "waits until hwd_2 is out of its way"),
        (4 * SECOND, 5 * SECOND, "hwd_1", "waits until hwd_2 has left the landing place"),
    ]


def test_a_hold_is_a_row_for_each_cause_and_a_clearance_is_told_as_its_question() -> None:
    feed = Feeder()
    feed(task(1))
    feed(task(1, hold=TaskHold(causes=(ClearanceHold("hwd_1"),))))
    feed(task(1, hold=TaskHold(causes=(ClearanceHold("hwd_1"), TakeOverHold("hwd_1")))))
    feed(task(1, hold=TaskHold(causes=(LockdownHold(),))))
    feed(task(1, "done"))

    waits = [(row.kind, row.start, row.end, row.text) for row in feed.ledger.stories["T-1"].waits]
    assert waits == [
        ("held", 3 * SECOND, 4 * SECOND, "a pilot, or its own failsafe, has taken hwd_1 over"),
        ("held", 4 * SECOND, 5 * SECOND, "the site is locked down"),
    ]
    assert feed.ledger.waiting == {}


def test_landings_and_alarms_are_marked_where_they_happened(wording: Wording) -> None:
    feed = Feeder()
    up = AgentRecord(id="hwd_1", type="hwd", task="T-1", position=replace(AT, up_m=60.0), landed="airborne")
    feed(task(1), ch.AgentPut(up))
    feed(ch.AgentPut(replace(up, position=AT, landed="grounded")))
    feed(effects=(Alarm("lost", "hwd_1 is lost", "T-1", "hwd_1"), Alarm("nowhere", "nobody", "", "hwd_9")))

    marks = [(event.mark.kind, event.mark.name, event.task, event.mark.at.east_m) for event in feed.ledger.events]
    wording(marks, [line.text for line in feed.ledger.alarms])


def test_a_machine_that_waits_for_a_person_is_stuck_since_then() -> None:
    feed = Feeder()
    agent = AgentRecord(id="hwd_1", type="hwd", control="pilot", taken=True)
    feed(ch.AgentPut(agent))
    assert feed.ledger.stuck == {}  # its pilot has it
    back = replace(agent, control="engine")
    feed(ch.AgentPut(back))
    feed(ch.AgentPut(replace(back, battery=50.0)))
    assert feed.ledger.stuck == {"hwd_1": 2 * SECOND}
    feed(ch.AgentPut(replace(back, taken=False, quarantine="lost")))
    assert feed.ledger.stuck == {}  # it comes back by itself
    feed(ch.AgentPut(replace(back, taken=False, quarantine="recover_failed")))
    assert feed.ledger.stuck == {"hwd_1": 5 * SECOND}
    away = replace(back, taken=False, quarantine="removed")
    feed(ch.AgentPut(replace(away, liveness="LOST")))
    assert feed.ledger.stuck == {}  # nobody can do anything until it is back
    feed(ch.AgentPut(replace(away, liveness="ALIVE")))
    assert feed.ledger.stuck == {"hwd_1": 7 * SECOND}


def test_a_ledger_goes_on_from_a_loaded_state(wording: Wording) -> None:
    bench = Yard(CART + "steps: [{do: cart.Move, retry: {attempts: 2}}, {wait: 3 s}]")
    one = bench.start()
    whole = source_of(bench)
    ledger = Ledger(state=reloaded(bench.engine.state))
    bench.driver.listeners.append(ledger.feed)
    bench.cart.succeed()
    bench.run_for(1)

    facts = {fact.path: fact.status for fact in ledger.stories[one].progress.facts()}
    assert facts == {fact.path: fact.status for fact in whole.task(one).steps}
    wording(told(whole, one)["steps/steps[1]"])


def test_a_refused_order_is_a_line_of_its_task(wording: Wording) -> None:
    feed = Feeder()
    feed(task(1))
    feed.ledger.feed(
        EngineStep(2, 2 * SECOND, Operator("hold", "T-1", "eve"), (), (), Refusal("cut", "its motors are off"))
    )

    (line,) = feed.ledger.stories["T-1"].lines
    assert line.severity == "warning"
    wording(line.text)


def test_what_is_folded_has_the_deadlines_of_the_engine() -> None:
    feed = Feeder()
    feed(
        ch.DeadlineSet(TaskDue("T-1", "timeout"), Deadline(5, 1, "T-1")), ch.WallTimerSet(LiveDue("hwd_1"), 3 * SECOND)
    )
    assert feed.ledger.wall_set == {LiveDue("hwd_1"): SECOND}
    feed(ch.WallTimerSet(LiveDue("hwd_1"), None))
    assert feed.ledger.wall_set == {}
    assert feed.ledger.state.deadlines == {TaskDue("T-1", "timeout"): Deadline(5, 1, "T-1")}
