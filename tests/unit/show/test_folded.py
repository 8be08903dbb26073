"""What a source says of a site: its list of tasks by urgency, a task, timeline, map, statistics; all of it travels as JSON."""

from typing import Any

import msgspec
import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.alarm_records import AlarmRecord, AlarmTurn
from formiga_bt.engine.kernel.causes import ClearanceHold, OperatorHold, TakeOverHold
from formiga_bt.engine.kernel.inputs import Alarm, EngineStep, Operator, Started
from formiga_bt.engine.kernel.records import (
    AgentRecord,
    AgentRequest,
    Deadline,
    GoalRecord,
    Lockdown,
    Question,
    StandingOrder,
    TaskAgents,
    TaskHold,
    TaskRecord,
    TaskRequest,
    TaskTimes,
)
from formiga_bt.engine.kernel.timers import ClearanceDue, LiveDue, OrderDue, TaskDue, Timer
from formiga_bt.lang.types import AgentRef
from formiga_bt.nodes.run import TaskOutcome
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import packaged_task, packaged_world
from formiga_bt.show.facts import ActionFact, Chart, Now, Stats, TaskPicture, Timeline
from formiga_bt.show.history.folded import FoldedSource
from formiga_bt.show.history.ledger import Ledger
from formiga_bt.show.source import Source
from tests.golden import Wording
from tests.unit.engine.yard import CART, TWO, Yard, yard
from tests.unit.show.scene import source_of

SITE, CATALOGUE = yard()


class Board:
    """A source over steps of changes, a second apart."""

    def __init__(self) -> None:
        self.ledger = Ledger()
        self.source: Source = FoldedSource(self.ledger, SITE, {}, CATALOGUE, desk=lambda: ("eve",))
        self.seq = 0

    def __call__(self, *changes: ch.Change, effects: tuple[Alarm, ...] = ()) -> None:
        self.seq += 1
        self.ledger.feed(EngineStep(self.seq, self.seq * SECOND, Started(1), changes, effects))


def task(number: int, status: str = "ACTIVE", **more: object) -> ch.TaskPut:
    section = "" if status == "PENDING" else "done" if status in ("SUCCEEDED", "FAILED") else "steps"
    given = {"section": section, "request": TaskRequest(bundle=""), "times": TaskTimes(submitted_at=number), **more}
    return ch.TaskPut(TaskRecord(id=f"T-{number}", name="T", order=number, status=status, **given))  # type: ignore[arg-type]


def question(number: int, of: int, lapses_s: int | None, **more: object) -> ch.QuestionPut:
    record = Question(
        id=f"T-{of}/1/steps/steps[0]", number=f"Q{number}", task=f"T-{of}", priority="medium", kind="ask",
        text="Ready?", options=("yes", "no"), tiers=(("eve", "bob"),), asked_at=SECOND,
        expires_at=None if lapses_s is None else lapses_s * SECOND, **more,  # type: ignore[arg-type]
    )  # fmt: skip
    return ch.QuestionPut(record)


def due(timer: Timer, at_s: int) -> ch.DeadlineSet:
    return ch.DeadlineSet(timer, Deadline(at_s * SECOND, 1))


def test_tasks_are_listed_by_who_needs_a_person_then_by_what_comes_then_by_status_and_age(wording: Wording) -> None:
    board = Board()
    board(
        task(1, "PENDING"),
        task(2),
        task(3),
        due(TaskDue("T-3", "timeout"), 90),
        task(4),
        due(TaskDue("T-4", "timeout"), 50),
        task(5),
        question(1, 5, 100),
        task(6),
        question(2, 6, None),
        task(7, "SUCCEEDED", times=TaskTimes(ended_at=SECOND)),
        task(8, "FAILED", times=TaskTimes(ended_at=2 * SECOND), outcome=TaskOutcome(code="timeout")),
        task(9, hold=TaskHold(causes=(OperatorHold(),))),
    )

    now = board.source.now()
    assert [(one.id, one.urgent) for one in now.tasks] == [
        ("T-5", "Q1 lapses"),
        ("T-6", ""),
        ("T-9", ""),
        ("T-4", "timeout"),
        ("T-3", "timeout"),
        ("T-2", ""),
        ("T-1", ""),
    ]
    wording([one.needs for one in now.tasks])
    assert now.counts == {"PENDING": 1, "ACTIVE": 6, "SUCCEEDED": 1, "FAILED": 1}
    assert [one.id for one in board.source.now(over=True).tasks][-3:] == ["T-1", "T-8", "T-7"]


def test_who_waits_for_agents_stands_behind_all_who_work_in_the_order_of_the_queue() -> None:
    board = Board()
    for n in range(1, 199):
        board(
            task(
                n,
                "PENDING",
                request=TaskRequest(bundle="", priority="high" if n == 150 else "medium"),
                times=TaskTimes(submitted_at=n),
            ),
            due(TaskDue(f"T-{n}", "wait"), 900),
        )
    board(
        task(200),
        due(TaskDue("T-200", "timeout"), 3600),
        task(201, "ASSIGNED"),
        task(202, "PENDING"),
        question(1, 202, None),
    )

    now = board.source.now()
    assert [one.id for one in now.tasks][:6] == ["T-202", "T-200", "T-201", "T-150", "T-1", "T-2"]
    assert (now.waiting, now.total) == (198, 201)
    assert board.source.now(find="t-15").waiting == 11


def test_a_page_is_a_part_of_the_same_order() -> None:
    board = Board()
    board(*(task(n) for n in range(1, 30)), *(due(TaskDue(f"T-{n}", "timeout"), n * 7 % 30) for n in range(1, 30)))
    board(task(40, "SUCCEEDED", times=TaskTimes(ended_at=1)))
    whole = [one.id for one in board.source.now(over=True).tasks]

    for first, count in ((0, 5), (5, 5), (25, 10), (29, 3), (60, 5), (0, 0)):
        page = board.source.now(first=first, count=count, over=True)
        assert [one.id for one in page.tasks] == whole[first : first + count]
        assert page.total == 30


@pytest.mark.parametrize(
    ("changes", "urgent", "at_s"),
    [
        ((ch.OrderPut("c1", StandingOrder(agent="c1", stop="hold", by="eve", scope="agent", at=1)), due(OrderDue("c1"), 60)),
         "c1 returns by itself", 60),
        ((due(ClearanceDue("c1"), 70),), "nobody said that people stand clear of c1", 70),
        ((ch.WallTimerSet(LiveDue("c1"), 27 * SECOND),), "c1 counts as lost", 28),
        ((due(TaskDue("T-1", "cleanup"), 5),), "its cleanup is cut off", 5),
        ((due(TaskDue("T-1", "expires"), 5), due(TaskDue("T-1", "wait"), 9)), "it expires", 5),
    ],
)  # fmt: skip
def test_what_cannot_be_taken_back(changes: tuple[ch.Change, ...], urgent: str, at_s: int) -> None:
    board = Board()
    board(
        task(1, agents=TaskAgents(roles={"cart": ("c1",)})),
        ch.AgentPut(AgentRecord(id="c1", type="cart", task="T-1", liveness="SUSPECT")),
    )
    assert board.source.now().tasks[0].urgent_at is None
    board.seq = 0
    board(*changes)

    (found,) = board.source.now().tasks
    assert (found.urgent, found.urgent_at) == (urgent, at_s * SECOND)


def test_tasks_are_found_by_id_agent_code_and_words() -> None:
    board = Board()
    board(
        task(1, agents=TaskAgents(roles={"cart": ("c1",)})),
        ch.GoalPut(GoalRecord(id="T-1/1/steps/steps[0]", agent="c1", action="Haul", task="T-1", state="running")),
        task(2, "PENDING"),
        ch.RequestPut("T-2", AgentRequest(holder="T-2", priority="medium", order=1, at=0, roles=())),
        task(3, "FAILED", outcome=TaskOutcome(code="agent_lost"), times=TaskTimes(ended_at=1)),
    )

    def found(text: str, over: bool = True) -> list[str]:
        return [one.id for one in board.source.now(find=text, over=over).tasks]

    assert found("c1") == ["T-1"]
    assert found("haul") == ["T-1"]
    assert found("Waits For Agents") == ["T-2"]
    assert found("agent_lost") == ["T-3"]
    assert found("agent_lost", over=False) == []
    assert found("t-") == ["T-1", "T-2", "T-3"]


def test_what_a_task_does_is_said_in_few_words(wording: Wording) -> None:
    board = Board()
    flight = GoalRecord(
        id="T-1/1/steps/steps[0]",
        agent="c1",
        action="Move",
        task="T-1",
        state="running",
        progress=0.4,
        phase="on its way",
    )
    board(
        task(1, hold=TaskHold(causes=(TakeOverHold("c1"),))),
        ch.GoalPut(flight),
        ch.AgentPut(AgentRecord(id="c1", type="cart", control="engine")),
    )
    (one,) = board.source.now().tasks
    wording(one.doing)
    assert one.needs == "hand c1 back"
    board(task(1, hold=TaskHold(causes=(ClearanceHold("c1"),))), question(4, 1, None), ch.GoalDrop(flight.id))
    (one,) = board.source.now().tasks
    wording(one.doing)
    (asked,) = board.source.now().questions
    assert (asked.number, asked.here, asked.options) == ("Q4", ("eve",), ("yes", "no"))


def test_a_machine_that_waits_for_people_to_stand_clear_gives_up_when_its_own_patience_ends() -> None:
    board = Board()
    asked = Question(
        id="clear/c1/1", number="Q1", task="T-1", priority="medium", kind="clearance", text="Clear?", options=("clear",),
        tiers=(("eve",),), asked_at=SECOND, expires_at=300 * SECOND,
    )  # fmt: skip
    board(task(1, hold=TaskHold(causes=(ClearanceHold("c1"),))), ch.QuestionPut(asked), due(ClearanceDue("c1"), 45))

    now = board.source.now()
    assert [(one.lapses_at, one.clears) for one in now.questions] == [(45 * SECOND, "c1")]
    assert (now.tasks[0].urgent_at, now.tasks[0].urgent) == (45 * SECOND, "Q1 lapses")
    assert board.source.task("T-1").questions[0].lapses_at == 45 * SECOND


def test_the_top_line_says_what_a_person_must_see_first(wording: Wording) -> None:
    board = Board()
    airborne = AgentRecord(id="c1", type="cart", landed="airborne", liveness="ALIVE", control="pilot", taken=True)
    board(
        task(1, hold=TaskHold(causes=(TakeOverHold("c1"),))),
        question(1, 1, None),
        ch.AgentPut(airborne),
        ch.AgentPut(AgentRecord(id="c2", type="cart", liveness="LOST", quarantine="lost")),
        ch.LockdownPut(Lockdown("hold", "eve", SECOND)),
        ch.AlarmPut(alarm("A1", "raised", "c1")),
        ch.AlarmPut(alarm("A2", "acknowledged", "c1")),
        ch.AlarmPut(alarm("A3", "cleared", "c2")),
    )
    board.seq = 30
    board()

    top = board.source.now().top
    assert (top.airborne, top.needs_you, top.longest_wait_us, top.alarms, top.held) == (1, 1, 30 * SECOND, 2, 1)
    assert top.taken == (("PILOT", "c1"),)
    wording(top.lockdown)
    assert [(one.id, one.state) for one in board.source.now().alarms] == [("A1", "raised"), ("A2", "acknowledged")]
    board(ch.AlarmPut(alarm("A1", "acknowledged", "c1")))
    assert board.source.now().top.alarms == 1  # the lost machine still is


def alarm(ident: str, state: Any, agent: str) -> AlarmRecord:
    return AlarmRecord(
        id=ident, code="x", severity="alarm", state=state, text="look", task="T-1", agent=agent, raised_at=1, at=1,
        history=(AlarmTurn(1, "raised"),),
    )  # fmt: skip


@pytest.fixture(scope="module")
def flown() -> tuple[FoldedSource, str]:
    site, catalogue = packaged_world()
    run = Rehearsal(site, catalogue, [packaged_task("pick_up")], fleet_of(site, catalogue))
    source = source_of(run)
    run.run_for(1)
    one = run.submit("PickUp", {"target": site.places["east_field"], "user": AgentRef("picker_1")})
    assert run.run_until_ended(one)
    return source, one


def test_a_flown_task_in_time(flown: tuple[FoldedSource, str], wording: Wording) -> None:
    source, one = flown
    timeline = source.timeline([one])

    hwd = [row for row in timeline.actions if row.action != "Confirm"]
    assert [row.action for row in hwd] == ["TakeOff", *["GoTo"] * 3, "LandIn", "TakeOff", *["GoTo"] * 2, "LandIn"]
    assert {row.path for row in timeline.actions if row.code == "loaded"} == {"steps/steps[2]"}
    assert [wait.kind for wait in timeline.waits] == ["question", "gate", "question"]
    wording([wait.text for wait in timeline.waits])
    assert all(isinstance(row, ActionFact) and row.end is not None and row.end >= row.start for row in timeline.actions)


def test_a_flown_task_on_the_map(flown: tuple[FoldedSource, str]) -> None:
    source, one = flown
    chart = source.chart([one])

    assert [track.agent for track in chart.tracks if track.task == one] == ["hwd_2"]
    machine = next(track for track in chart.tracks if not track.human)
    assert max(point.up_m for point in machine.points) == pytest.approx(60.0, abs=1.0)
    assert [mark.name for mark in chart.marks if mark.kind in ("landing", "event")] == [
        "Q1",
        "hwd_2 landed",
        "Q2",
        "hwd_2 landed",
    ]
    kinds = [shape.kind for shape in chart.shapes]
    assert kinds.count("fence") == 1
    assert "region" in kinds
    assert {mark.name for mark in chart.marks if mark.kind == "place"} >= {"camp", "east_field"}
    assert len(source.chart().tracks) > len(chart.tracks)


def test_a_flown_task_in_words(flown: tuple[FoldedSource, str]) -> None:
    source, one = flown
    picture = source.task(one)

    assert picture.values[""] == {
        "target": "east_field", "user": "picker_1", "height": "60 m",
        "drone": "hwd_2", "picker": "picker_1", "watcher": "watcher_1",
    }  # fmt: skip
    assert picture.task.agents == ("hwd_2", "picker_1", "watcher_1")
    assert [agent.id for agent in picture.agents] == ["hwd_2", "picker_1", "watcher_1"]
    assert picture.lines[-1].text == f"{one} SUCCEEDED"
    assert source.why(one)[0] == f"{one} SUCCEEDED"


def test_how_long_things_took(flown: tuple[FoldedSource, str]) -> None:
    source, one = flown
    stats = source.stats()

    (whole,) = stats.tasks
    record = source.ledger.state.tasks[one]
    assert record.times.ended_at is not None
    assert record.times.active_at is not None
    assert (whole.name, whole.n, whole.median_s) == (
        "PickUp",
        1,
        pytest.approx((record.times.ended_at - record.times.active_at) / SECOND, abs=0.001),
    )
    assert [(spread.name, spread.group, spread.n) for spread in stats.actions] == [
        ("GoTo", "hwd", 5),
        ("LandIn", "hwd", 2),
        ("TakeOff", "hwd", 2),
    ]
    (answers,) = stats.answers
    assert (answers.name, answers.n) == ("picker_1", 2)
    (gaps,) = stats.gaps
    assert (gaps.name, gaps.n, gaps.least_s, gaps.most_s) == ("PickUp", 8, 0.0, pytest.approx(3.04))
    assert source.stats(task="MoveTask").actions == ()
    assert [spread.name for spread in source.stats(hours=1 / 3600).actions] == ["LandIn"]


def test_all_of_it_travels_as_json(flown: tuple[FoldedSource, str]) -> None:
    source, one = flown
    for fact, kind in (
        (source.now(over=True), Now),
        (source.task(one), TaskPicture),
        (source.timeline(), Timeline),
        (source.chart(), Chart),
        (source.stats(), Stats),
    ):
        assert msgspec.json.decode(msgspec.json.encode(fact), type=kind) == fact


def test_an_id_that_is_not_there_is_told_with_those_that_look_alike(
    flown: tuple[FoldedSource, str], wording: Wording
) -> None:
    source, _ = flown
    for ask in (source.task, lambda one: source.timeline([one]), lambda one: source.chart([one]), source.why):
        with pytest.raises(TaskError) as raised:
            ask("PickUp-11")
        wording(raised.value)
        assert raised.value.code == "unknown_task"


def test_a_silence_of_wall_time_ends_sooner_on_a_fast_clock() -> None:
    board = Board()
    board.source = FoldedSource(board.ledger, SITE, {}, CATALOGUE, speed=20.0)
    silent = AgentRecord(id="c1", type="cart", task="T-1", liveness="SUSPECT")
    board(
        task(1, agents=TaskAgents(roles={"cart": ("c1",)})),
        ch.AgentPut(silent),
        ch.WallTimerSet(LiveDue("c1"), 27 * SECOND),
    )

    assert board.source.now().tasks[0].urgent_at == (1 + 27 * 20) * SECOND


def test_an_agent_where_a_task_is_wanted_is_told_as_one(flown: tuple[FoldedSource, str], wording: Wording) -> None:
    source, _ = flown
    with pytest.raises(TaskError) as refused:
        source.chart(["hwd_1"])
    wording(refused.value)


def test_failures_and_what_was_taken_back_are_counted_apart() -> None:
    bench = Yard(CART + "steps: [{do: cart.Move, retry: {attempts: 3}}, {do: cart.Home}]")
    source, one = source_of(bench), bench.start()
    bench.run_for(1)
    bench.cart.fail()
    bench.run_for(1)
    bench.run_for(2)
    bench.cart.succeed()
    bench.run_for(1)
    bench.abort(one)
    bench.run_for(5)

    moves, homes = (
        {s.name: s for s in source.stats().actions}["Move"],
        {s.name: s for s in source.stats().actions}.get("Home"),
    )
    assert (moves.n, moves.failed) == (1, 1)
    assert 2.5 < moves.median_s < 4.0
    assert homes is None or homes.failed == 0
    assert source.stats().tasks == ()


def test_a_person_who_is_asked_sees_what_lapses_and_when() -> None:
    bench = Yard(TWO + "steps: [{ask: Ready?, of: [ann], options: [yes, no], timeout: 2 min}]")
    source = source_of(bench)
    bench.start(who=AgentRef("ann"))
    bench.run_for(10)

    (one,) = source.now().tasks
    assert (one.needs, one.urgent) == ("Q1", "Q1 lapses")
    assert one.urgent_at is not None
    assert 105 * SECOND < one.urgent_at - source.now().at < 112 * SECOND


def test_an_order_on_a_machine_is_told_in_words(wording: Wording) -> None:
    bench = Yard(CART + "steps: [{do: cart.Rise}, {wait: 1 h}, {do: cart.Home}]")
    source, one = source_of(bench), bench.start()
    bench.cart.succeed()
    bench.run_for(1)
    bench.ask(Operator("hold", "c1", "ann"))
    bench.run_for(1)

    now = source.now()
    wording(now.agents[0].order)
    (shown,) = now.tasks
    assert shown.id == one
    wording(shown.needs, shown.urgent)
    (note,) = (step.note for step in source.task(one).steps if step.path == "steps/steps[1]")
    assert note.endswith("left, stands still")
