"""What is not kept of telemetry changes nothing that anybody decided by."""

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Position, distance_m
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import AgentStatusInput, EngineStep, GoalEventInput, WallDue
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord
from formiga_bt.engine.kernel.state import EngineState, fold, snapshot
from formiga_bt.engine.kernel.timers import AcceptDue, CancelDue, LiveDue
from formiga_bt.journal.thin import THINNED, Thinner, TrackPoint, lay_over, pack, point_of, unpack
from formiga_bt.nodes.blackboard import Blackboard
from formiga_bt.transport.messages import AgentStatus, GoalEvent
from tests.replay.missions import MISSIONS
from tests.unit.journal.conftest import steps_of


def without_thinned(state: EngineState) -> bytes:
    """Return a snapshot of a state in which what is thinned is blank."""
    blank = AgentRecord(id="", type="")
    agents = {
        name: replace(agent, **{field: getattr(blank, field) for field in THINNED})
        for name, agent in state.agents.items()
    }
    goals = {name: replace(goal, n=-1, progress=None) for name, goal in state.goals.items()}
    wall = {due: 0 if isinstance(due, LiveDue) else us for due, us in sorted(state.wall.items(), key=repr)}
    return snapshot(replace(state, agents=agents, goals=goals, wall=wall))


def laws(steps: Sequence[EngineStep]) -> tuple[int, int]:
    """Fold what is kept beside all; return how many steps are kept, and how many way points."""
    live, kept, board = EngineState(), EngineState(), Blackboard()
    thinner = Thinner(EngineState())
    points: dict[str, TrackPoint] = {}
    put: dict[str, int] = {}
    n_kept = n_points = 0
    for step in steps:
        fold(live, board, step)
        keeps = thinner.keeps(step)
        for block in thinner.blocks(live.now, all_=True):
            n_points += len(block.points)
            points[block.agent] = block.points[-1]
        if not keeps:
            assert not step.effects
            assert not step.reply
            continue
        n_kept += 1
        fold(kept, board, step)
        put.update({c.agent.id: step.seq for c in step.changes if isinstance(c, ch.AgentPut)})
        lay_over(kept, points, put)
        assert without_thinned(kept) == without_thinned(live)
        for name, agent in live.agents.items():
            near(kept.agents[name], agent)
        assert thinner.view(live) == kept
    return n_kept, n_points


def near(kept: AgentRecord, live: AgentRecord) -> None:
    assert (kept.position is None) == (live.position is None)
    if kept.position is not None and live.position is not None:
        assert distance_m(kept.position, live.position) < 0.1
    if live.battery is not None:
        assert kept.battery is not None
        assert abs(kept.battery - live.battery) <= 1  # both round to the same point, or a point is kept
    assert live.heard_at - kept.heard_at < 40 * SECOND


@pytest.mark.parametrize("name", MISSIONS)
def test_the_fold_of_what_is_kept_is_the_live_state_but_for_what_is_thinned(name: str) -> None:
    steps = steps_of(name)
    kept, _ = laws(steps)
    assert kept < len(steps)


def test_most_of_a_long_mission_is_telemetry() -> None:
    steps = steps_of("pick_up")
    kept, points = laws(steps)
    assert kept < 0.4 * len(steps)
    assert points > 20


AGENT = AgentRecord(id="lwd_1", type="lwd", landed="airborne", position=Position(1, 2, 3), battery=90.0, seq=1)


def status(seq: int, *changes: ch.Change, **more: object) -> EngineStep:
    said = AgentStatus(id="lwd_1", type="lwd", boot_id="b", seq=seq, stamp=0)
    step = EngineStep(seq, seq * SECOND, AgentStatusInput(said), changes, ())
    return replace(step, **more)


def moved(seq: int, **fields: object) -> ch.AgentPut:
    return ch.AgentPut(replace(AGENT, seq=seq, heard_at=seq * SECOND, **fields))


def thinner(agent: AgentRecord = AGENT, **options: bool) -> Thinner:
    return Thinner(EngineState(agents={agent.id: agent}), **options)


@pytest.mark.parametrize(
    "step",
    [
        status(2, moved(2, landed="grounded")),
        status(2, moved(2, liveness="ALIVE")),
        status(2, moved(2, position=None)),
        status(2, moved(2), ch.CounterSet("deadline", 4)),
        status(2, moved(2), reply="ok"),
        status(2, ch.AgentPut(replace(AGENT, id="other"))),
        EngineStep(2, 2, WallDue(LiveDue("lwd_1")), (ch.WallTimerSet(LiveDue("lwd_1"), None),), ()),
        EngineStep(2, 2, WallDue(LiveDue("x")), (ch.WallTimerSet(LiveDue("x"), None), moved(2)), ()),
        EngineStep(
            2,
            2,
            WallDue(CancelDue("g")),
            (ch.WallTimerSet(CancelDue("g"), None), ch.WallTimerSet(CancelDue("g"), 2)),
            (),
        ),
    ],
    ids=str,
)
def test_a_step_that_anything_may_depend_on_is_kept(step: EngineStep) -> None:
    assert thinner().keeps(step)


@pytest.mark.parametrize(
    "step",
    [
        status(2, moved(2, position=Position(5, 5, 5), battery=80.0, wind=(1.0, 2.0))),
        status(2),
        EngineStep(
            2, 2, WallDue(LiveDue("x")), (ch.WallTimerSet(LiveDue("x"), None), ch.WallTimerSet(LiveDue("x"), 2)), ()
        ),
    ],
    ids=str,
)
def test_a_step_that_only_tells_where_is_not_kept_unless_all_are(step: EngineStep) -> None:
    assert not thinner().keeps(step)
    assert thinner(thin=False).keeps(step)


GOAL = GoalRecord(id="g", agent="lwd_1", action="GoTo", state="running", n=3, progress=0.5)


def news(*changes: ch.Change, **event: object) -> EngineStep:
    told = GoalEvent(goal_id="g", agent="lwd_1", state="running", **event)
    return EngineStep(2, 2, GoalEventInput(told), changes, ())


@pytest.mark.parametrize(
    ("step", "kept"),
    [
        (news(), False),
        (news(ch.GoalPut(replace(GOAL, n=4))), False),
        (news(ch.GoalPut(replace(GOAL, n=4, progress=0.55))), False),
        (news(ch.GoalPut(replace(GOAL, n=4, progress=0.61))), True),
        (news(ch.GoalPut(replace(GOAL, n=4, phase="descending"))), True),
        (news(ch.GoalPut(replace(GOAL, n=4)), ch.WallTimerSet(AcceptDue("g"), None)), True),
        (news(ch.GoalPut(replace(GOAL, id="other"))), True),
        (
            news(
                ch.GoalPut(replace(GOAL, n=4)), status=AgentStatus(id="lwd_1", type="lwd", boot_id="b", seq=1, stamp=0)
            ),
            True,
        ),
    ],
)
def test_news_that_a_goal_still_runs_is_not_kept(step: EngineStep, kept: bool) -> None:
    assert Thinner(EngineState(goals={"g": GOAL})).keeps(step) is kept
    assert Thinner(EngineState(goals={"g": GOAL}), thin=False).keeps(step)


def test_who_stands_still_makes_a_way_point_each_half_minute() -> None:
    one = thinner()
    for seq in range(2, 121):
        assert not one.keeps(status(seq, moved(seq, position=Position(1.01, 2.02, 3.04), battery=89.8)))
    (block,) = one.blocks(0, all_=True)
    assert [point.at // SECOND for point in block.points] == [30, 60, 90, 120]
    assert one.blocks(0, all_=True) == []


def test_way_points_wait_for_ten_seconds_or_for_many() -> None:
    one = thinner()
    for seq in range(2, 12):
        one.keeps(status(seq, moved(seq, position=Position(seq, 0, 0))))
        assert one.blocks(seq * SECOND) == []
    (block,) = one.blocks(12 * SECOND)
    assert (block.agent, len(block.points), block.points[0].position) == ("lwd_1", 10, Position(2.0, 0.0, 0.0))


def test_a_machine_on_the_ground_stood_where_its_way_point_is() -> None:
    on_ground = replace(AGENT, landed="grounded", position=Position(7.04, 8.0, 0.0))
    point = point_of(3, replace(on_ground, heard_at=9, seq=4, stamp=5, heard_wall=6))
    assert point.on(AGENT).stood_at == AGENT.stood_at
    laid = point.on(on_ground)
    assert (laid.stood_at, laid.heard_at, laid.seq, laid.stamp, laid.heard_wall) == (
        Position(7.0, 8.0, 0.0).ground, 9, 4, 5, 6,
    )  # fmt: skip


numbers = st.integers(-(2**40), 2**40)
maybe = st.none() | st.integers(-(10**6), 10**6)
points = st.builds(TrackPoint, numbers, numbers, maybe, maybe, maybe, maybe, maybe, maybe, numbers, numbers, numbers)


@given(st.lists(points, min_size=1, max_size=8))
def test_way_points_come_back(some: list[TrackPoint]) -> None:
    assert unpack(pack(some)) == tuple(some)
