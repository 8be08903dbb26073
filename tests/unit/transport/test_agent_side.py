from collections.abc import Callable

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Position
from formiga_bt.base.machines import Mobility
from formiga_bt.transport.agent_side import REMEMBERED_GOALS, AgentSide
from formiga_bt.transport.messages import (
    AgentCard,
    AgentEvent,
    AgentStatus,
    ClockBeat,
    GoalEvent,
    GoalRequest,
    PreflightCheck,
)


class Link:
    def __init__(self) -> None:
        self.events: list[GoalEvent] = []
        self.statuses: list[AgentStatus] = []
        self.cards: list[AgentCard] = []
        self.told: list[AgentEvent] = []

    def publish_status(self, status: AgentStatus) -> None:
        self.statuses.append(status)

    def publish_event(self, event: GoalEvent) -> None:
        self.events.append(event)

    def publish_agent_event(self, event: AgentEvent) -> None:
        self.told.append(event)

    def publish_card(self, card: AgentCard) -> None:
        self.cards.append(card)


class Body:
    def __init__(self) -> None:
        self.started: list[str] = []
        self.refuses = ""
        self.in_start: Callable[[str], None] = lambda _: None
        self.in_cancel: Callable[[str], bool] = lambda _: True

    def start(self, request: GoalRequest) -> str:
        if self.refuses:
            return self.refuses
        self.started.append(request.goal_id)
        self.in_start(request.goal_id)
        return ""

    def cancel(self, goal_id: str) -> bool:
        return self.in_cancel(goal_id)


class Agent:
    def __init__(self, *, mobility: Mobility = "air", beat_us: int | None = None) -> None:
        self.time = 0
        self.link = Link()
        self.body = Body()
        card = AgentCard(id="a", type="drone", boot_id="b1", actions=("Go", "Confirm"), mobility=mobility)
        self.side = AgentSide(card, self.body, self.link, now=lambda: self.time, beat_us=beat_us)

    def goal(self, goal_id: str, **more: object) -> GoalEvent:
        return self.side.on_goal(GoalRequest(**{"goal_id": goal_id, "agent": "a", "action": "Go", **more}))

    def clock(self, beat: int, *, epoch: int = 0, engine_us: int = 0, speed: float = 1.0) -> None:
        self.side.on_clock(ClockBeat(wall_us=0, engine_us=engine_us, speed=speed, epoch=epoch, beat=beat))


@pytest.fixture
def agent() -> Agent:
    return Agent()


def test_the_card_and_a_standby_status_are_announced(agent: Agent) -> None:
    agent.side.announce()
    assert agent.link.cards == [agent.side.card]
    assert (agent.link.statuses[0].status, agent.link.statuses[0].boot_id) == ("STANDBY", "b1")


def test_the_status_names_the_running_goal(agent: Agent) -> None:
    agent.goal("g1", task_id="PickUp-1")
    agent.side.publish_status(battery=70.0, position=Position(1, 2, 3))
    status = agent.link.statuses[-1]
    assert (status.status, status.task_id, status.action_name, status.battery) == (
        "EXECUTING ACTION",
        "PickUp-1",
        "Go",
        70.0,
    )
    agent.side.finish("g1", "succeeded")
    agent.side.publish_status()
    after = agent.link.statuses[-1]
    assert (after.status, after.task_id, after.action_name) == ("STANDBY", "None", "")
    assert (after.last_goal, after.last_goal_state) == ("g1", "succeeded")
    assert after.seq > status.seq


def test_a_body_cannot_set_what_the_side_knows(agent: Agent) -> None:
    with pytest.raises(AssertionError, match="seq"):
        agent.side.set_status(seq=3)


def test_a_goal_may_end_while_it_is_being_begun(agent: Agent) -> None:
    agent.body.in_start = lambda goal: agent.side.finish(goal, "succeeded", result={"x": 1})
    reply = agent.goal("g1")
    assert (reply.state, reply.n, reply.result) == ("succeeded", 2, {"x": 1})
    assert [event.state for event in agent.link.events] == ["succeeded"]
    assert agent.side.active == ()


def test_a_goal_of_another_agent_is_refused(agent: Agent) -> None:
    assert agent.goal("g1", agent="b").code == "wrong_agent"


def test_a_refused_safety_goal_leaves_the_running_one_alone(agent: Agent) -> None:
    agent.goal("g1")
    agent.body.refuses = "too_low"
    assert agent.goal("s1", safety=True).code == "too_low"
    assert agent.side.state_of("g1") == "accepted"
    assert agent.link.events == []


def test_a_safety_goal_that_ends_at_once_ends_after_the_one_it_replaced(agent: Agent) -> None:
    agent.goal("g1")
    agent.body.in_start = lambda goal: agent.side.finish(goal, "succeeded")
    agent.goal("s1", safety=True)
    assert [(event.goal_id, event.state) for event in agent.link.events] == [("g1", "superseded"), ("s1", "succeeded")]
    assert agent.side.status.last_goal == "s1"


def test_news_of_an_ended_goal_is_not_sent(agent: Agent) -> None:
    agent.goal("g1")
    agent.side.finish("g1", "failed", code="motor")
    agent.side.feedback("g1", progress=0.5)
    agent.side.finish("g1", "succeeded")
    agent.side.finish("never", "succeeded")
    assert [event.state for event in agent.link.events] == ["failed"]


def test_a_cancel_that_the_body_follows_at_once_answers_the_end(agent: Agent) -> None:
    def end(goal: str) -> bool:
        agent.side.finish(goal, "canceled")
        return True

    agent.body.in_cancel = end
    agent.goal("g1")
    assert agent.side.on_cancel("g1").state == "canceled"


def test_a_repeated_cancel_is_not_passed_on(agent: Agent) -> None:
    asked: list[str] = []
    agent.body.in_cancel = lambda goal: not asked.append(goal)
    agent.goal("g1")
    assert agent.side.on_cancel("g1") == agent.side.on_cancel("g1")
    assert asked == ["g1"]
    agent.side.feedback("g1", progress=0.9)
    assert agent.link.events[-1].state == "canceling"


def test_a_refused_cancel_may_be_asked_again(agent: Agent) -> None:
    agent.body.in_cancel = lambda _: False
    agent.goal("g1")
    replies = [agent.side.on_cancel("g1") for _ in range(2)]
    assert [(reply.state, reply.cancel_refused, reply.n) for reply in replies] == [
        ("accepted", True, 2),
        ("accepted", True, 3),
    ]
    assert not agent.side.on_query(["g1"])[0].cancel_refused


def test_a_higher_epoch_of_the_clock_bars_older_goals(agent: Agent) -> None:
    agent.clock(50, epoch=2)
    assert agent.goal("g1", epoch=1, beat=50).code == "epoch_old"
    assert agent.side.state_of("g1") == "unknown"
    assert agent.goal("g1", epoch=2, beat=50).state == "accepted"


def test_any_epoch_below_2_to_31_is_the_first_after_a_start_then_they_come_in_steps(agent: Agent) -> None:
    agent.clock(1, epoch=2**31)
    assert (agent.side.epoch, agent.side.status.epoch_ignored) == (0, 2**31)
    agent.clock(1, epoch=2**31 - 2000)
    assert agent.side.epoch == 2**31 - 2000
    for epoch, follows in ((2**31 - 999, False), (2**31 - 1000, True), (2**31, False), (2**60, False), (2**70, False)):
        agent.clock(1, epoch=epoch)
        assert (agent.side.epoch == epoch) is follows

    assert agent.side.status.epoch == 2**31 - 1000
    assert agent.side.status.epoch_ignored == 2**61, "the newest that was ignored, within what a message may say"


@pytest.mark.parametrize("by", ["clock", "goal"])
def test_one_far_epoch_deposes_no_engine(agent: Agent, by: str) -> None:
    agent.clock(7, epoch=3)
    if by == "clock":
        agent.clock(8, epoch=2**60)
    else:
        reply = agent.goal("g1", epoch=2**60)
        assert (reply.state, reply.code) == ("rejected", "epoch_far")
        assert agent.side.state_of("g1") == "unknown", "the engine may use this id"

    assert agent.goal("g1", epoch=3, beat=7).state == "accepted"
    assert agent.goal("g2", epoch=1003, beat=1, safety=True).state == "accepted"


def test_a_beat_far_ahead_is_believed_when_the_next_one_follows_on_it(agent: Agent) -> None:
    agent.clock(5, epoch=1)
    agent.clock(2**50, epoch=1)
    agent.clock(6, epoch=1)
    assert agent.side.beat == 6, "it was alone"

    agent.clock(30_000, epoch=1)
    agent.clock(30_001, epoch=1)
    assert agent.side.beat == 30_001, "the agent's machine slept for hours"


def test_a_new_epoch_starts_its_own_count_of_beats(agent: Agent) -> None:
    agent.clock(5000, epoch=1)
    assert agent.goal("g1", epoch=2, beat=3).state == "accepted"
    agent.clock(4, epoch=2)
    assert (agent.side.epoch, agent.side.beat) == (2, 4)
    agent.clock(9000, epoch=1)
    assert agent.side.beat == 4


def test_a_goal_lives_for_its_beats_and_not_longer(agent: Agent) -> None:
    agent.clock(15)
    assert agent.goal("g1", beat=5, ttl_beats=10).state == "accepted"
    agent.side.finish("g1", "succeeded")
    agent.clock(16)
    assert agent.goal("g2", beat=5, ttl_beats=10).code == "goal_expired"
    assert agent.goal("g1", beat=5, ttl_beats=10).state == "succeeded", "a recorded state is told all the same"


def test_beats_that_must_have_passed_unheard_count_too() -> None:
    agent = Agent(beat_us=SECOND)
    agent.clock(5)
    agent.time += 11 * SECOND
    assert agent.goal("g1", beat=5, ttl_beats=10).code == "goal_expired"
    assert agent.goal("g2", beat=16, ttl_beats=10).state == "accepted"


def test_beats_that_are_read_after_a_standstill_do_not_make_an_old_goal_young() -> None:
    """What was sent while it stood still lies in its ears in the order of sending: beats, the goal, more beats."""
    agent = Agent(beat_us=SECOND)
    agent.clock(5)
    agent.time += 60 * SECOND
    for beat in (6, 7):
        agent.clock(beat)
    assert agent.goal("g1", beat=7, ttl_beats=10).code == "goal_expired"
    for beat in range(8, 66):
        agent.clock(beat)
    assert agent.goal("g2", beat=65, ttl_beats=10).state == "accepted"


def test_an_engine_that_stood_still_is_followed_again_after_two_seconds() -> None:
    agent = Agent(beat_us=SECOND)
    agent.clock(5)
    agent.time += 60 * SECOND
    agent.clock(6)
    assert agent.goal("g1", beat=6, ttl_beats=10).code == "goal_expired"
    for beat in (7, 8):
        agent.time += SECOND
        agent.clock(beat)
    assert agent.goal("g2", beat=8, ttl_beats=10).state == "accepted"


def test_beats_that_come_late_now_and_then_cost_no_goal() -> None:
    agent = Agent(beat_us=SECOND)
    for beat in range(5, 60):
        agent.time = beat * SECOND + (beat * 7 % 5) * SECOND // 2
        if beat % 4:
            agent.clock(beat)
        assert agent.goal(f"g{beat}", beat=beat, ttl_beats=10).code in ("", "busy")


def test_engine_time_is_extrapolated_and_never_goes_back(agent: Agent) -> None:
    agent.time = 7
    assert agent.side.engine_now() == 7
    agent.clock(1, engine_us=1000 * SECOND, speed=10.0)
    agent.time += SECOND
    assert agent.side.engine_now() == 1010 * SECOND
    agent.clock(2, engine_us=1008 * SECOND, speed=0.0)
    assert agent.side.engine_now() == 1010 * SECOND
    agent.clock(1, engine_us=2000 * SECOND)
    assert agent.side.engine_now() == 1010 * SECOND, "a late beat is ignored"


def test_engine_time_that_was_far_ahead_steps_back(agent: Agent) -> None:
    """As after a sleep of the engine's machine: else it would stand still for as long as that was."""
    agent.clock(1, engine_us=1000 * SECOND)
    agent.time += 3600 * SECOND
    assert agent.side.engine_now() == 4600 * SECOND
    agent.clock(2, engine_us=1001 * SECOND)
    assert agent.side.engine_now() == 1001 * SECOND


def test_a_thousand_ended_goals_are_remembered_and_running_ones_never_forgotten() -> None:
    agent = Agent(mobility="people")
    agent.goal("kept", action="Confirm")
    for i in range(REMEMBERED_GOALS + 5):
        agent.goal(f"g{i}")
        agent.side.finish(f"g{i}", "succeeded")
    assert agent.side.state_of("kept") == "accepted"
    assert agent.side.state_of("g0") == "unknown"
    assert agent.side.state_of("g6") == "succeeded"


def test_a_person_holds_many_questions_beside_one_other_goal() -> None:
    agent = Agent(mobility="people")
    assert [agent.goal(f"q{i}", action="Confirm").state for i in range(3)] == ["accepted"] * 3
    assert agent.goal("g1").state == "accepted"
    assert agent.goal("g2").code == "busy"
    assert agent.goal("s1", safety=True).state == "accepted"
    assert agent.side.state_of("g1") == "superseded"
    assert [goal.goal_id for goal in agent.side.active] == ["q0", "q1", "q2", "s1"]


def test_a_pilot_ends_all_goals_and_gives_back(agent: Agent) -> None:
    agent.goal("g1")
    agent.side.take_control("pilot")
    agent.side.take_control("pilot")
    assert [event.state for event in agent.link.events] == ["taken_over"]
    assert agent.link.events[0].status is not None
    assert agent.link.events[0].status.control == "pilot"
    assert len(agent.link.statuses) == 1
    assert agent.goal("s1", safety=True).code == "not_in_command"
    agent.side.take_control("engine")
    assert agent.goal("g2").state == "accepted"


# Link silence.


def test_silence_counts_from_the_newest_heartbeat(agent: Agent) -> None:
    agent.goal("g1", link_silence_s=10.0)
    agent.time = 8 * SECOND
    agent.clock(beat=1)
    assert agent.side.cut_off_at == 18 * SECOND
    agent.time = 18 * SECOND
    assert not agent.side.is_cut_off
    agent.time += 1
    assert agent.side.is_cut_off
    agent.clock(beat=2)
    assert not agent.side.is_cut_off


def test_no_silence_is_too_long_before_a_goal_says_so(agent: Agent) -> None:
    agent.goal("g1")
    agent.time = 3600 * SECOND
    assert (agent.side.cut_off_at, agent.side.is_cut_off) == (None, False)


def test_the_newest_begun_goal_says_what_silence_is_too_long(agent: Agent) -> None:
    agent.goal("g1", link_silence_s=10.0)
    agent.goal("busy", link_silence_s=1.0)
    assert agent.side.cut_off_at == 10 * SECOND
    agent.side.finish("g1", "succeeded")
    agent.goal("g2", link_silence_s=5.0)
    assert agent.side.cut_off_at == 5 * SECOND
    agent.side.finish("g2", "succeeded")
    agent.goal("g3")  # says nothing: the bound stays
    assert agent.side.cut_off_at == 5 * SECOND


def test_beats_of_an_older_engine_do_not_break_the_silence(agent: Agent) -> None:
    agent.goal("g1", link_silence_s=10.0, epoch=4)
    agent.time = 11 * SECOND
    agent.clock(beat=99, epoch=3)
    assert agent.side.is_cut_off


def test_what_ended_in_the_silence_is_said_again_when_the_link_is_back(agent: Agent) -> None:
    agent.goal("g1", link_silence_s=10.0)
    agent.time = 11 * SECOND
    agent.side.take_control("failsafe")
    agent.link.events.clear()
    agent.clock(beat=1)
    agent.clock(beat=2)
    assert [(e.goal_id, e.state, e.n) for e in agent.link.events] == [("g1", "taken_over", 2)]
    assert agent.link.events[0].status is not None
    assert agent.link.events[0].status.control == "failsafe"


def test_the_next_engine_is_told_again_what_the_last_one_may_have_died_with(agent: Agent) -> None:
    agent.clock(beat=1, epoch=4)
    agent.side.report_event("crossed")
    agent.clock(beat=2, epoch=4)
    agent.side.report_event("moved")
    agent.clock(beat=3, epoch=4)  # whoever beats twice since has "crossed" on disk
    agent.side.report_event("sos")
    agent.link.told.clear()
    agent.clock(beat=3, epoch=4)
    assert agent.link.told == []
    agent.time = 3600 * SECOND
    agent.side.report_event("sos")
    agent.link.told.clear()
    agent.clock(beat=1, epoch=5)
    agent.clock(beat=2, epoch=5)
    assert [(event.event, event.n) for event in agent.link.told] == [("sos", 3), ("sos", 4)]


def test_an_engine_that_is_first_heard_by_its_goal_is_told_too(agent: Agent) -> None:
    agent.clock(beat=1, epoch=4)
    agent.side.report_event("sos")
    agent.link.told.clear()
    agent.goal("g1", epoch=5)
    agent.clock(beat=1, epoch=5)
    assert [event.n for event in agent.link.told] == [1]


def test_what_was_told_in_the_silence_is_told_again_to_the_same_engine(agent: Agent) -> None:
    agent.goal("g1", link_silence_s=10.0)
    agent.side.report_event("sos")
    agent.time = 11 * SECOND
    agent.side.report_event("sos")
    agent.link.told.clear()
    agent.clock(beat=1)
    agent.clock(beat=2)
    assert [event.n for event in agent.link.told] == [1, 2]


def test_of_many_events_that_nobody_heard_the_newest_are_told(agent: Agent) -> None:
    agent.clock(beat=1, epoch=4)
    for _ in range(130):
        agent.side.report_event("sos")
    agent.link.told.clear()
    agent.clock(beat=1, epoch=5)
    assert [event.n for event in agent.link.told] == list(range(31, 131))


def test_a_standstill_of_the_process_is_no_silence_of_the_engine(agent: Agent) -> None:
    agent.goal("g1", link_silence_s=10.0)
    agent.time = 60 * SECOND
    agent.side.excuse_silence()
    assert not agent.side.is_cut_off
    agent.time = 71 * SECOND
    assert agent.side.is_cut_off


def test_the_body_tells_of_wind_and_checks(agent: Agent) -> None:
    checks = (PreflightCheck("gnss", False, "3 satellites"),)
    agent.side.publish_status(wind_east_m_s=3.0, wind_north_m_s=-1.0, checks=checks)
    status = agent.link.statuses[-1]
    assert (status.wind_east_m_s, status.wind_north_m_s, status.checks) == (3.0, -1.0, checks)


# -- one engine -------------------------------------------------------------------------------------------------------
def hears(agent: Agent, engine: str, beat: int, epoch: int = 5) -> None:
    agent.side.on_clock(ClockBeat(wall_us=0, engine_us=0, speed=1.0, epoch=epoch, beat=beat, engine_id=engine))


def test_an_agent_keeps_to_the_first_engine_that_says_its_name(agent: Agent) -> None:
    hears(agent, "one", 1)
    hears(agent, "two", 900, epoch=9)
    assert (agent.side.epoch, agent.side.beat, agent.side.status.engine_id) == (5, 1, "one")
    assert agent.goal("g", engine_id="two", epoch=9, beat=900).code == "other_engine"
    assert [one.state for one in agent.side.on_query(("g",))] == ["unknown"], (
        "the engine that it follows may use this id"
    )
    assert agent.goal("g", engine_id="one", epoch=5, beat=1).state == "accepted"
    assert agent.body.started == ["g"]


def test_its_engine_is_the_same_after_a_restart_with_a_higher_epoch(agent: Agent) -> None:
    hears(agent, "one", 40)
    hears(agent, "one", 1, epoch=6)
    assert (agent.side.epoch, agent.side.beat) == (6, 1)


def test_another_engine_is_followed_after_30_s_of_silence_with_its_own_count_of_epochs(agent: Agent) -> None:
    hears(agent, "one", 400, epoch=70)
    agent.time = 29 * SECOND
    hears(agent, "two", 1, epoch=1)
    assert agent.side.engine_id == "one"
    agent.time = 30 * SECOND
    hears(agent, "two", 2, epoch=1)
    assert (agent.side.engine_id, agent.side.epoch, agent.side.beat) == ("two", 1, 2)
    assert agent.goal("g", engine_id="one", epoch=70, beat=400).code == "other_engine"
    assert agent.goal("g", engine_id="two", epoch=1, beat=2).state == "accepted"


def test_beats_of_another_engine_are_no_sign_of_life_of_its_own(agent: Agent) -> None:
    hears(agent, "one", 1)
    agent.goal("g", engine_id="one", epoch=5, beat=1, link_silence_s=10.0)
    for second in range(1, 12):
        agent.time = second * SECOND
        hears(agent, "two", second)
    assert agent.side.is_cut_off


def test_a_message_without_an_engines_name_counts_as_its_own(agent: Agent) -> None:
    hears(agent, "one", 1)
    hears(agent, "", 2)
    assert agent.side.beat == 2
    assert agent.goal("g", epoch=5, beat=2).state == "accepted"
