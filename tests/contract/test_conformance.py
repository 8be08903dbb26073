"""What every transport must do, with real peers: run over memory (virtual time) and over Zenoh (other processes)."""

import pytest
from rigs import Rig

from formiga_bt.transport.messages import (
    TERMINAL,
    AgentSeen,
    EventArrived,
    GoalReported,
    QueryReplied,
    SendFailed,
    SitePoint,
    StatusArrived,
)


def test_a_goal_is_accepted_and_succeeds_with_the_full_status(rig: Rig, peer: str) -> None:
    goal = rig.goal(peer, do="succeed", result={"found": 3, "at": {"east_m": 1.5, "north_m": -2.0}})
    end = rig.reported(goal, "succeeded")
    assert [event.state for event in rig.states(goal)] == ["accepted", "succeeded"]
    assert end.result == {"found": 3, "at": {"east_m": 1.5, "north_m": -2.0}, "starts": 1}
    assert end.status is not None
    assert end.status.position is not None
    assert (end.status.position.up_m, end.status.landed) == (3.0, "airborne")
    assert (end.status.last_goal, end.status.last_goal_state) == (goal, "succeeded")


def test_a_goal_is_rejected_with_the_agents_code(rig: Rig, peer: str) -> None:
    goal = rig.goal(peer, do="reject")
    assert rig.reported(goal, "rejected").code == "battery_low"


def test_an_unknown_action_is_rejected(rig: Rig, peer: str) -> None:
    assert rig.reported(rig.goal(peer, action="Sing"), "rejected").code == "unknown_action"


def test_a_second_goal_is_rejected_busy_and_a_safety_goal_supersedes(rig: Rig, peer: str) -> None:
    first = rig.goal(peer, do="hold")
    rig.reported(first, "accepted")
    assert rig.reported(rig.goal(peer, do="hold"), "rejected").code == "busy"
    safety = rig.goal(peer, do="succeed", safety=True)
    rig.reported(first, "superseded")
    rig.reported(safety, "succeeded")


def test_a_slow_accept_is_waited_for(rig: Rig) -> None:
    agent = rig.new_peer()
    goal = rig.goal(agent, do="hold", block_s=0.4)
    rig.reported(goal, "accepted")
    assert not [e for e in rig.log if isinstance(e, SendFailed)]


def test_an_accept_that_takes_too_long_leaves_the_outcome_unknown(rig: Rig) -> None:
    agent = rig.new_peer()
    goal = rig.goal(agent, do="succeed", block_s=1.5)
    assert rig.failure(goal).outcome == "unknown"
    assert rig.reported(goal, "succeeded").result["starts"] == 1, "the news arrives all the same"


def test_events_of_an_agents_own_come_in_order_and_none_is_lost(rig: Rig, peer: str) -> None:
    levels = list(range(40))
    rig.reported(rig.goal(peer, do="succeed", tell=levels), "succeeded")
    rig.event(EventArrived, lambda e: e.event.fields["level"] == levels[-1])
    told = [e.event for e in rig.log if isinstance(e, EventArrived) and e.event.agent == peer]
    assert [event.fields["level"] for event in told] == levels
    assert [event.n for event in told] == list(range(told[0].n, told[0].n + 40))
    assert {(event.event, event.agent) for event in told} == {("alarm", peer)}


def test_feedback_comes_in_order(rig: Rig, peer: str) -> None:
    values = [i / 50 for i in range(50)]
    goal = rig.goal(peer, do="succeed", feedback=values, step_s=0.002)
    rig.reported(goal, "succeeded")
    events = rig.states(goal)
    assert [event.progress for event in events if event.state == "running"] == values
    assert [event.n for event in events] == list(range(1, 53))
    assert events[1].phase == "moving"


def test_a_goal_fails_with_code_and_text(rig: Rig, peer: str) -> None:
    end = rig.reported(rig.goal(peer, do="fail"), "failed")
    assert (end.code, end.text) == ("motor", "the motor is hot")
    assert end.status is not None


def test_a_running_goal_is_canceled(rig: Rig, peer: str) -> None:
    goal = rig.goal(peer, do="hold")
    rig.reported(goal, "accepted")
    rig.transport.cancel_goal(peer, goal)
    rig.reported(goal, "canceled")
    assert [event.state for event in rig.states(goal)] == ["accepted", "canceling", "canceled"]


def test_a_cancel_may_be_refused_and_the_goal_goes_on(rig: Rig, peer: str) -> None:
    goal = rig.goal(peer, do="succeed", cancel="refuse", feedback=[0.1] * 20, step_s=0.02)
    rig.reported(goal, "accepted")
    rig.transport.cancel_goal(peer, goal)
    refusal = rig.event(GoalReported, lambda e: e.event.goal_id == goal and e.event.cancel_refused).event
    assert refusal.state in ("accepted", "running")
    rig.reported(goal, "succeeded")


def test_a_cancel_after_the_end_answers_the_recorded_state(rig: Rig, peer: str) -> None:
    goal = rig.goal(peer, do="succeed")
    end = rig.reported(goal, "succeeded")
    mark = len(rig.log)
    rig.transport.cancel_goal(peer, goal)
    again = rig.reported(goal, "succeeded", since=mark)
    assert (again.n, again.result) == (end.n, end.result)
    assert again.status is not None


def test_a_cancel_of_an_unknown_goal_bars_its_id(rig: Rig, peer: str) -> None:
    goal = "Test-1/0/steps/never#1"
    rig.transport.cancel_goal(peer, goal)
    rig.reported(goal, "unknown")
    rig.goal(peer, goal, do="succeed")
    assert rig.reported(goal, "canceled").code == "canceled_before_start"


def test_a_repeated_id_starts_nothing_and_answers_its_state(rig: Rig, peer: str) -> None:
    goal = rig.goal(peer, do="hold")
    rig.reported(goal, "accepted")
    mark = len(rig.log)
    rig.goal(peer, goal, do="hold")
    rig.reported(goal, "accepted", since=mark)
    rig.transport.cancel_goal(peer, goal)
    rig.reported(goal, "canceled")

    done = rig.goal(peer, do="succeed")
    end = rig.reported(done, "succeeded")
    mark = len(rig.log)
    rig.goal(peer, done, do="succeed")
    again = rig.reported(done, "succeeded", since=mark)
    assert (again.n, again.result["starts"]) == (end.n, 1)


def test_a_lower_epoch_is_refused(rig: Rig) -> None:
    agent = rig.new_peer()
    rig.reported(rig.goal(agent, do="succeed", epoch=7), "succeeded")
    late = rig.goal(agent, do="succeed", epoch=6)
    assert rig.reported(late, "rejected").code == "epoch_old"
    assert [event.state for event in rig.query(agent, late).goals] == ["unknown"], "the new engine may use this id"


def test_an_epoch_far_ahead_is_ignored_and_reported(rig: Rig) -> None:
    agent = rig.new_peer()
    rig.clock_until_heard(agent)
    rig.reported(rig.goal(agent, do="succeed"), "succeeded")
    mark = len(rig.log)
    own, rig.epoch = rig.epoch, 2**60
    rig.clock()
    said = rig.event(StatusArrived, lambda e: e.status.id == agent and e.status.epoch_ignored > 0, since=mark).status
    assert (said.epoch, said.epoch_ignored) == (own, 2**60)
    assert rig.reported(rig.goal(agent, do="succeed"), "rejected").code == "epoch_far"

    rig.epoch = own + 1000
    rig.reported(rig.goal(agent, do="succeed"), "succeeded")
    rig.epoch = own
    assert rig.reported(rig.goal(agent, do="succeed"), "rejected").code == "epoch_old"


def test_an_expired_goal_is_refused(rig: Rig, peer: str) -> None:
    rig.clock_until_heard(peer, beats=20)
    goal = rig.goal(peer, do="succeed", beat=rig.beat - 15, ttl_beats=10)
    assert rig.reported(goal, "rejected").code == "goal_expired"
    rig.reported(rig.goal(peer, do="succeed", beat=rig.beat - 10, ttl_beats=20), "succeeded")


def test_an_update_changes_a_goal_that_runs_and_the_highest_number_wins(rig: Rig, peer: str) -> None:
    goal = rig.goal(peer, do="succeed", updates=True, to="a", feedback=[0.5] * 60, step_s=0.02)
    rig.reported(goal, "accepted")
    assert (rig.update(peer, goal, 2, to="c").code, rig.update(peer, goal, 2, to="d").stands) == ("", 2)
    late = rig.update(peer, goal, 1, to="b")
    assert (late.code, late.stands) == ("", 2)
    assert rig.update(peer, goal, 3, speed=1.0).code == "bad_field"
    end = rig.reported(goal, "succeeded")
    assert (end.result["to"], end.result["updates"], end.result["starts"]) == ("c", 1, 1)
    assert rig.update(peer, goal, 4, to="e").code == "goal_ended"


def test_an_update_that_cannot_be_leaves_the_goal_as_it_is(rig: Rig) -> None:
    agent = rig.new_peer()
    rig.epoch = 7
    goal = rig.goal(agent, do="hold", to="a")
    rig.reported(goal, "accepted")
    reply = rig.update(agent, goal, 1, to="b")
    assert (reply.code, reply.stands) == ("no_update", 0)
    assert rig.update(agent, "Test-1/0/steps/none", 1, to="b").code == "unknown_goal"
    assert rig.update(agent, goal, 2, to="b", epoch=6).code == "epoch_old"
    rig.clock_until_heard(agent, beats=20)
    assert rig.update(agent, goal, 3, to="b", beat=rig.beat - 15, ttl_beats=10).code == "goal_expired"
    assert rig.query(agent, goal).goals[0].state == "accepted"
    rig.transport.cancel_goal(agent, goal)
    rig.reported(goal, "canceled")


def test_an_agent_asks_for_the_site_when_it_connects_and_hears_of_each_change(rig: Rig) -> None:
    rig.tell_site(version="v1")
    agent = rig.new_peer()
    rig.event(StatusArrived, lambda e: e.status.id == agent and e.status.site == "v1")
    rig.tell_site(version="v2", no_fly=((SitePoint(1.0, 1.0), SitePoint(2.0, 1.0), SitePoint(2.0, 2.0)),))
    rig.event(StatusArrived, lambda e: e.status.id == agent and e.status.site == "v2")
    mark = len(rig.log)
    rig.tell_site(version="v0", epoch=rig.epoch - 1)
    rig.clock_until_heard(agent)
    said = {e.status.site for e in rig.log[mark:] if isinstance(e, StatusArrived) and e.status.id == agent}
    assert said == {"v2"}, "an earlier start of the engine told it"


def test_a_result_names_a_file_and_its_bytes_come_beside_it(rig: Rig, peer: str) -> None:
    end = rig.reported(rig.goal(peer, do="succeed", attach="what I saw"), "succeeded")
    (named,) = end.attachments
    assert (named.name, named.media_type, named.size) == ("note.txt", "text/plain", 10)
    said = rig.event(EventArrived, lambda e: e.event.event == "sent" and e.event.agent == peer).event
    assert said.fields == {"why": ""}
    assert rig.shelf.kept[named.sha256] == b"what I saw"


def test_bytes_of_another_hash_are_refused_and_the_agent_is_told(rig: Rig) -> None:
    agent = rig.new_peer()
    end = rig.reported(rig.goal(agent, do="succeed", attach="what I saw not", bad_hash=True), "succeeded")
    said = rig.event(EventArrived, lambda e: e.event.event == "sent" and e.event.agent == agent).event
    assert said.fields == {"why": "bad_hash"}
    assert end.attachments[0].sha256 not in rig.shelf.kept


def test_a_query_tells_what_the_agent_knows(rig: Rig, peer: str) -> None:
    done = rig.goal(peer, do="succeed")
    rig.reported(done, "succeeded")
    running = rig.goal(peer, do="hold")
    rig.reported(running, "accepted")
    reply = rig.query(peer, done, "Test-9/0/steps/none", running)
    assert [event.state for event in reply.goals] == ["succeeded", "unknown", "accepted"]
    assert [event.goal_id for event in reply.goals] == [done, "Test-9/0/steps/none", running]
    assert reply.boot_id
    assert reply.goals[0].result["starts"] == 1
    rig.transport.cancel_goal(peer, running)
    rig.reported(running, "canceled")


def test_a_lost_result_is_found_in_the_status(rig: Rig, peer: str) -> None:
    goal = rig.goal(peer, do="succeed", lose=True)
    found = rig.event(StatusArrived, lambda e: e.status.last_goal == goal).status
    assert found.last_goal_state == "succeeded"
    assert not [event for event in rig.states(goal) if event.state in TERMINAL]
    assert rig.query(peer, goal).goals[0].result["starts"] == 1


def test_a_killed_peer_is_gone_and_cannot_be_reached(rig: Rig) -> None:
    agent = rig.new_peer()
    goal = rig.goal(agent, do="hold")
    rig.reported(goal, "accepted")
    rig.kill(agent)
    rig.gone(agent)
    assert rig.failure(rig.goal(agent, do="succeed")).outcome == "unreachable"
    rig.transport.cancel_goal(agent, goal)
    assert rig.failure(goal, "cancel").outcome == "unreachable"
    rig.transport.query_goals(agent, [goal])
    assert rig.event(SendFailed, lambda e: e.what == "query" and e.agent == agent).outcome == "unreachable"


def test_a_peer_killed_before_it_answers_leaves_the_outcome_unknown(rig: Rig) -> None:
    agent = rig.new_peer()
    goal = rig.goal(agent, do="succeed", block_s=0.9)
    rig.kill(agent)
    assert rig.failure(goal).outcome == "unknown"


def test_a_peer_that_comes_back_has_another_boot_id_and_forgot(rig: Rig) -> None:
    agent = rig.new_peer()
    goal = rig.goal(agent, do="hold")
    rig.reported(goal, "accepted")
    before = rig.query(agent, goal)
    rig.kill(agent)
    rig.gone(agent)
    boot_id = rig.restart(agent)
    reply = rig.query(agent, goal)
    assert reply.boot_id == boot_id != before.boot_id
    assert [event.state for event in reply.goals] == ["unknown"]
    rig.event(StatusArrived, lambda e: e.status.id == agent and e.status.boot_id == boot_id)


def test_a_peer_frozen_for_a_while_refuses_what_grew_old(rig: Rig) -> None:
    agent = rig.new_peer()
    rig.clock_until_heard(agent)
    rig.freeze(agent)
    old = rig.goal(agent, do="succeed", ttl_beats=0)
    assert rig.failure(old).outcome == "unknown"
    rig.thaw(agent)
    reply = rig.query(agent, old)
    assert [(event.state, event.code) for event in reply.goals] == [("rejected", "goal_expired")]


def test_a_peer_frozen_for_long_is_gone_and_comes_back_with_its_memory(rig: Rig) -> None:
    agent = rig.new_peer()
    running = rig.goal(agent, do="hold")
    rig.reported(running, "accepted")
    boot_id = rig.query(agent, running).boot_id
    rig.clock_until_heard(agent)
    rig.freeze(agent)
    mark = len(rig.log)
    old = rig.goal(agent, do="succeed", safety=True, ttl_beats=0)
    rig.gone(agent, since=mark)
    assert rig.failure(old).outcome == "unknown"
    mark = len(rig.log)
    rig.thaw(agent)
    assert rig.event(AgentSeen, lambda e: e.card.id == agent, since=mark).card.boot_id == boot_id
    rig.event(StatusArrived, lambda e: e.status.id == agent, since=mark)
    reply = rig.query(agent, running, old)
    assert reply.goals[0].state == "accepted"
    assert reply.goals[1].state in ("unknown", "rejected"), "what was sent to it meanwhile is lost or refused"


def test_a_frozen_peer_does_not_hold_up_the_others(rig: Rig, peer: str) -> None:
    agent = rig.new_peer()
    rig.freeze(agent)
    stuck = [rig.goal(agent, do="succeed", padding="x" * 10_000) for _ in range(20)]
    rig.reported(rig.goal(peer, do="succeed"), "succeeded")
    assert not [event for goal in stuck for event in rig.states(goal)]
    assert {rig.failure(goal).outcome for goal in stuck} <= {"unknown", "unreachable"}
    rig.kill(agent)


def test_a_pilot_who_takes_over_ends_the_goal_and_bars_new_ones(rig: Rig) -> None:
    agent = rig.new_peer()
    goal = rig.goal(agent, do="takeover")
    rig.reported(goal, "taken_over")
    assert rig.reported(rig.goal(agent, do="succeed", safety=True), "rejected").code == "not_in_command"
    rig.event(StatusArrived, lambda e: e.status.id == agent and e.status.control == "pilot")
    mark = len(rig.log)
    rig.event(StatusArrived, lambda e: e.status.id == agent and e.status.control == "engine", since=mark)
    rig.reported(rig.goal(agent, do="succeed"), "succeeded")


def test_an_agent_that_hears_no_heartbeat_acts_by_itself(rig: Rig) -> None:
    agent = rig.new_peer()
    rig.clock_until_heard(agent)
    goal = rig.goal(agent, do="hold", link_silence_s=1.0)
    assert rig.reported(goal, "taken_over").status.control == "failsafe"
    mark = len(rig.log)
    assert rig.reported(rig.goal(agent, do="succeed"), "rejected").code == "not_in_command"
    rig.clock()
    rig.event(StatusArrived, lambda e: e.status.id == agent and e.status.control == "engine", since=mark)
    rig.kill(agent)


@pytest.mark.parametrize("vanishes", [True, False])
def test_what_ended_while_the_wire_was_cut_is_told_when_it_is_back(rig: Rig, vanishes: bool) -> None:
    agent = rig.new_peer()
    rig.clock_until_heard(agent)
    mark = len(rig.log)
    goal = rig.goal(agent, do="hold", link_silence_s=1.0, deaf_s=6.0, vanishes=vanishes)
    if vanishes:
        rig.gone(agent, since=mark)
    while not any(isinstance(event, SendFailed) and event.agent == agent for event in rig.log):
        since = len(rig.log)
        rig.transport.query_goals(agent, [goal])
        rig.event((SendFailed, QueryReplied), lambda e: e.agent == agent, since=since)  # until the wire is cut
    unheard = rig.goal(agent, do="succeed")
    assert rig.failure(unheard).outcome in ("unknown", "unreachable")
    assert [event.state for event in rig.states(goal)] == ["accepted"]

    rig.event(StatusArrived, lambda e: e.status.id == agent and e.status.last_goal == goal, since=mark)
    if vanishes:
        rig.event(AgentSeen, lambda e: e.card.id == agent, since=mark)
    rig.clock()
    assert rig.reported(goal, "taken_over").status.last_goal_state == "taken_over"
    assert rig.query(agent, unheard).goals[0].state == "unknown"
    rig.kill(agent)


def test_an_agent_nobody_has_seen_is_unreachable(rig: Rig) -> None:
    failure = rig.failure(rig.goal("ghost", do="succeed"))
    assert failure.outcome == "unreachable"


def test_too_long_a_goal_is_not_sent(rig: Rig, peer: str) -> None:
    failure = rig.failure(rig.goal(peer, do="succeed", padding="x" * 300_000))
    assert failure.outcome == "unreachable"
    assert "262144" in failure.text


@pytest.mark.parametrize("count", [8])
def test_many_agents_answer_at_once(rig: Rig, peer: str, count: int) -> None:
    agents = [rig.new_peer() for _ in range(2)]
    goals = [rig.goal(agent, do="succeed") for agent in agents]
    assert {rig.reported(goal, "succeeded").agent for goal in goals} == set(agents)
    asked = [rig.query(peer, goals[0]) for _ in range(count)]
    assert len(asked) == count
