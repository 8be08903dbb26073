"""What may happen while the engine is away: it is long, a machine restarts or is moved, a person answers, it dies once more."""

from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.records import GoalRecord, TaskRecord
from formiga_bt.engine.kernel.timers import NodeDue
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import check_rehearsal, packaged_world, task_of
from formiga_bt.show.why.front import explain
from tests.golden import Wording
from tests.missions.crashing import Crashing, Killed

SITE, CATALOGUE = packaged_world()
LONG_LEG = """\
imports: [lib/flying.yaml]
agents:
  drone: {type: lwd, id: lwd_1}
  watcher: {type: watcher}
steps:
  - do: drone.TakeOff
    with: {altitude: 60 m}
  - do: drone.GoTo
    with: {to: {east: 20 m, north: 300 m, height: 60 m}}
    retry: {attempts: 2}
    timeout: 5 min
  - ask: Seen?
    of: [watcher]
    options: ["yes", "no"]
    save_as: seen
  - do: drone.GoTo
    with: {to: {east: 60 m, north: 300 m, height: 60 m}}
  - notify: it is ${seen.answer}
  - call: ReturnHome
    with: {drone: "${drone}"}
finally:
  - notify: tidied up
"""


def begin(
    text: str = LONG_LEG,
    answers: list[dict[str, Any]] | None = None,
    site: Site = SITE,
    catalogue: Catalogue = CATALOGUE,
) -> tuple[Crashing, str]:
    task = task_of(text, site, catalogue)
    said = answers or [{"match": "Seen", "options": ["yes"], "after": "5 s"}]
    flight = Rehearsal(site, catalogue, [task], fleet_of(site, catalogue, scripts={"watcher_1": said}))
    flight.run_for(1)
    crashing = Crashing(flight)
    return crashing, flight.submit(task.name)


def leg(flown: Crashing, action: str = "GoTo") -> GoalRecord | None:
    goals = flown.flight.engine.state.goals.values()
    return next((g for g in goals if g.action == action and g.in_flight), None)


def in_flight(flown: Crashing, seconds: float = 3.0) -> None:
    """Fly until the first leg is under way."""
    assert flown.flight.run_until(lambda: (g := leg(flown)) is not None and g.state == "running")
    flown.flight.run_for(seconds)


def task(flown: Crashing, task_id: str) -> TaskRecord:
    return flown.flight.task(task_id)


def settled(flown: Crashing) -> None:
    """Run until it is known what happened meanwhile."""
    assert flown.flight.run_until(lambda: flown.flight.engine.state.resume is None, limit_s=60), flown.story()


def told(flown: Crashing) -> list[str]:
    return [e.text for step in flown.seen for e in step.effects if isinstance(e, inp.NotifyPeople)]


def ends(flown: Crashing, task_id: str, status: str = "SUCCEEDED") -> TaskRecord:
    assert flown.run(), flown.story()
    ended = task(flown, task_id)
    assert ended.status == status, flown.story()
    assert flown.twice() == []
    check_rehearsal(flown.flight)
    return ended


def test_no_timer_fires_and_no_goal_leaves_before_machines_have_told(wording: Wording) -> None:
    flown, id_ = begin()
    in_flight(flown)
    flown.die()
    first = flown.resume(away_s=3)
    assert flown.flight.engine.state.resume is not None
    assert flown.flight.engine.state.resume.phase == "asking"
    assert flown.flight.engine.state.resume.waits == ("lwd_1",)
    assert flown.flight.engine.next_deadline() is None
    assert not [e for e in first.effects if isinstance(e, inp.SendGoal)]
    settled(flown)
    queries = [e for s in flown.seen if s.seq > first.seq for e in s.effects if isinstance(e, inp.QueryGoal)]
    assert [(q.agent, q.goal_ids) for q in queries][:1] == [("lwd_1", (f"{id_}/1/steps/steps[1]@1",))]
    notices = [e.text for step in flown.seen for e in step.effects if isinstance(e, inp.NotifyPeople)]
    wording(notices)
    ends(flown, id_)


TWO = """\
imports: [lib/flying.yaml]
agents:
  one: {type: lwd, id: lwd_1}
  other: {type: lwd, id: lwd_2}
steps:
  - parallel:
      - sequence:
          - do: one.TakeOff
          - do: one.GoTo
            with: {to: {east: 20 m, north: 300 m, height: "${one.transit_height}"}}
          - call: ReturnHome
            with: {drone: "${one}"}
      - sequence:
          - do: other.TakeOff
          - do: other.GoTo
            with: {to: {east: -60 m, north: 80 m, height: "${other.transit_height}"}}
          - call: ReturnHome
            with: {drone: "${other}"}
"""


def test_no_order_leaves_while_another_machine_is_waited_for() -> None:
    flown, id_ = begin(TWO)
    flight = flown.flight
    assert flight.run_until(lambda: sum(g.action == "GoTo" for g in flight.engine.state.goals.values()) == 2)
    flight.run_for(1)
    flown.die()
    other, side = flight.sim["lwd_1"].side, flight.sim["lwd_2"].side
    assert side is not None
    assert other is not None
    other._silence_us = None  # it does not come home by itself
    while side.active:
        flown.away(0.5)
    flight.hub.cut("lwd_1", vanishes=False)
    flown.resume(away_s=0)
    before = len(flown.begun)
    flight.run_for(9)
    waiting = [g for g in flight.engine.state.goals.values() if g.state == "gated"]
    assert [(g.agent, g.code) for g in waiting] == [("lwd_2", "reconcile")]
    assert flown.begun[before:] == []
    flight.run_for(2)
    assert {one.agent for one in flown.begun[before:]} == {"lwd_2"}
    flight.hub.mend("lwd_1")
    ends(flown, id_)


def test_a_result_that_came_meanwhile_counts_before_a_deadline_that_passed() -> None:
    flown, id_ = begin(LONG_LEG.replace("5 min", "1 min"), site=replace(SITE, resume_hold_after_us=600_000_000))
    in_flight(flown)
    goal = leg(flown)
    assert goal is not None
    deadline = min(
        d.at
        for due, d in flown.flight.engine.state.deadlines.items()
        if isinstance(due, NodeDue) and "steps[1]" in due.node
    )
    flown.die()
    side = flown.flight.sim["lwd_1"].side
    assert side is not None
    side._silence_us = None  # it does not come home by itself
    while side.state_of(goal.id) == "running":
        flown.away(0.5)
    assert flown.flight.now < deadline
    step = flown.resume(away_s=(deadline - flown.flight.now) / 1e6 + 1)
    assert step.at > deadline
    settled(flown)
    ends(flown, id_)


def test_deadlines_that_passed_fire_in_their_order(wording: Wording) -> None:
    text = """\
agents: {watcher: {type: watcher}}
steps:
  - parallel:
      - sequence: [{wait: 12 s}, {notify: second}]
      - sequence: [{wait: 11 s}, {notify: first}]
      - sequence: [{wait: 12 s}, {notify: third}]
      - wait: 1 min
"""
    flown, id_ = begin(text)
    flown.flight.run_for(2)
    flown.die()
    flown.resume(away_s=20)
    settled(flown)
    notices = [e.text for step in flown.seen for e in step.effects if isinstance(e, inp.NotifyPeople)]
    assert notices[:3] == ["first", "second", "third"]
    wording(notices[3])
    ends(flown, id_)


class TestLong:
    def test_tasks_come_back_held_and_go_on_with_a_word(self, wording: Wording) -> None:
        flown, id_ = begin()
        assert flown.flight.run_until(lambda: bool(flown.flight.engine.state.questions))
        flown.die()
        flown.resume(away_s=31, wall=flown.flight.now + 31_000_000, since=flown.killed_at)
        settled(flown)
        assert "resume" in task(flown, id_).hold.words
        wording(told(flown)[-1])  # its machine came home by itself
        wording(flown.alarms())
        before = len(flown.begun)
        flown.flight.run_for(20)
        assert [one for one in flown.begun[before:] if one.action != "Confirm"] == []
        if any(cause.startswith("take-over") for cause in task(flown, id_).hold.words):  # it has gone home by itself
            with pytest.raises(TaskError) as refused:
                flown.flight.ask(inp.Operator("continue", id_, "watcher_1"))
            wording(refused.value)

    def test_an_outage_just_short_enough_holds_nothing(self) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.die()
        now = flown.flight.now
        flown.resume(away_s=2, wall=now + 30_000_000, since=now)
        settled(flown)
        assert task(flown, id_).hold.words == ()
        ends(flown, id_)

    def test_goals_in_flight_are_found_again_and_nothing_new_is_sent(self) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.die()
        now = flown.flight.now
        flown.resume(away_s=2, wall=now + 30_000_001, since=now)
        settled(flown)
        assert task(flown, id_).hold.words == ("resume",)
        assert leg(flown) is not None
        assert flown.flight.run_until(lambda: bool(flown.flight.engine.state.questions), limit_s=120)  # it arrives
        flown.flight.run_for(20)  # the question is asked, and answered
        assert flown.flight.engine.state.questions == {}
        waiting = [g for g in flown.flight.engine.state.goals.values() if g.state == "gated"]
        assert [(g.action, g.code) for g in waiting] == [("GoTo", "held")]
        flown.flight.ask(inp.Operator("continue", id_, "watcher_1"))
        ends(flown, id_)

    def test_continue_for_all_and_of_the_machine(self) -> None:
        for target in ("", "lwd_1"):
            flown, id_ = begin()
            in_flight(flown)
            flown.die()
            flown.resume(away_s=2, since=flown.flight.now - 60_000_000)
            settled(flown)
            flown.flight.ask(inp.Operator("continue", target, "watcher_1"))
            assert task(flown, id_).hold.words == ()
            ends(flown, id_)

    def test_a_person_may_abort_it_or_bring_it_home(self) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.die()
        flown.resume(away_s=2, since=flown.flight.now - 60_000_000)
        settled(flown)
        flown.flight.ask(inp.Operator("return", "lwd_1", "watcher_1"))  # safety goals pass
        assert flown.flight.run_until(
            lambda: flown.flight.engine.state.agents["lwd_1"].landed == "grounded", limit_s=300
        )
        flown.flight.abort(id_)
        ends(flown, id_, "CANCELED")

    def test_a_word_to_end_it_lets_its_cleanup_go(self) -> None:
        cleanup = """\
on_abort:
  - do: drone.GoTo
    with: {to: {east: 30 m, north: 100 m, height: 60 m}}
"""
        flown, id_ = begin(f"{LONG_LEG}{cleanup}")
        in_flight(flown)
        flown.die()
        flown.resume(away_s=2, since=flown.flight.now - 60_000_000)
        settled(flown)
        flown.flight.abort(id_)
        assert task(flown, id_).hold.words == ()
        ends(flown, id_, "CANCELED")
        assert any(one.goal == f"{id_}/1/on_abort/on_abort[0]" for one in flown.begun)

    def test_cleanup_waits_for_the_word_too(self) -> None:
        cleanup = """\
on_abort:
  - do: drone.GoTo
    with: {to: {east: 30 m, north: 100 m, height: 60 m}}
  - do: drone.GoTo
    with: {to: {east: 60 m, north: 100 m, height: 60 m}}
"""
        flown, id_ = begin(f"{LONG_LEG}{cleanup}")
        in_flight(flown)
        flown.flight.abort(id_)
        assert flown.flight.run_until(lambda: (g := leg(flown)) is not None and g.section == "on_abort")
        flown.die()
        flown.resume(away_s=2, since=flown.flight.now - 60_000_000)
        settled(flown)
        flown.flight.run_for(60)
        assert [g.code for g in flown.flight.engine.state.goals.values()] == ["held"]
        assert task(flown, id_).section == "on_abort"
        flown.flight.ask(inp.Operator("continue", id_, "watcher_1"))
        ends(flown, id_, "CANCELED")

    def test_recover_goes_on(self) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.flight.abort(id_)
        assert flown.flight.run_until(lambda: task(flown, id_).section == "recover")
        flown.flight.run_for(1)
        flown.die()
        flown.resume(away_s=2, since=flown.flight.now - 60_000_000)
        ends(flown, id_, "CANCELED")


class TestMachines:
    def test_one_that_was_started_anew_waits_for_a_word_and_flies_its_next_attempt(self, wording: Wording) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.die()
        flown.flight.sim.kill("lwd_1")
        flown.flight.sim.restart("lwd_1")
        flown.resume(away_s=2)
        settled(flown)
        assert task(flown, id_).hold.words == ("resume",)
        wording(flown.alarms())
        goals = [g for g in flown.flight.engine.state.goals.values() if g.agent == "lwd_1"]
        assert [(g.state, g.code) for g in goals] == [("interrupted", "in_doubt")]
        wording(told(flown)[-1])
        flown.flight.run_for(10)
        flown.flight.ask(inp.Operator("continue", id_, "watcher_1"))
        ends(flown, id_)
        assert flown.again_begun() == [f"{id_}/1/steps/steps[1]"]

    def test_one_whose_action_may_not_be_repeated_cannot_be_continued(self, wording: Wording) -> None:
        text = LONG_LEG.replace("5 min", "30 min").replace(
            "  - do: drone.GoTo\n    with: {to: {east: 20 m, north: 300 m, height: 60 m}}\n    retry: {attempts: 2}\n",
            "  - do: drone.Explore\n    with: {region: '${site.regions.bog}', altitude: 60 m}\n",
        )
        flown, id_ = begin(text)
        assert flown.flight.run_until(lambda: (g := leg(flown, "Explore")) is not None and g.state == "running")
        flown.die()
        flown.flight.sim.kill("lwd_1")
        flown.flight.sim.restart("lwd_1")
        flown.resume(away_s=2)
        settled(flown)
        wording(flown.alarms(), told(flown)[-1])
        with pytest.raises(TaskError) as said:
            flown.flight.ask(inp.Operator("continue", id_, "watcher_1"))
        wording(said.value)
        assert said.value.code == "cannot_continue"
        flown.flight.abort(id_)
        ends(flown, id_, "CANCELED")

    def test_one_that_never_answers_is_lost_as_after_any_silence(self) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.die()
        flown.flight.sim.kill("lwd_1")
        flown.resume(away_s=2)
        for seconds, phase in ((9.5, "asking"), (1, "watching")):
            flown.flight.run_for(seconds)
            assert flown.flight.engine.state.resume is not None
            assert flown.flight.engine.state.resume.phase == phase
        ended = ends(flown, id_, "FAILED")
        assert ended.outcome.code == "agent_lost"
        assert flown.flight.engine.state.resume is None

    def test_one_that_a_pilot_took_waits_for_the_handback(self, wording: Wording) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.die()
        flown.flight.sim.take_over("lwd_1")
        flown.resume(away_s=2)
        settled(flown)
        assert set(task(flown, id_).hold.words) == {"resume", "take-over:lwd_1"}
        wording(flown.alarms(), told(flown)[-1])
        flown.flight.sim.hand_back("lwd_1")
        flown.flight.run_for(1)
        flown.flight.ask(inp.Operator("handback_continue", "lwd_1", "watcher_1"))
        assert task(flown, id_).hold.words == ("resume",)
        flown.flight.ask(inp.Operator("continue", id_, "watcher_1"))
        ends(flown, id_)

    def test_one_that_a_pilot_took_and_gave_back_meanwhile_waits_too(self) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.die()
        flown.flight.sim.take_over("lwd_1")
        flown.away(1)
        flown.flight.sim.hand_back("lwd_1")
        flown.resume(away_s=1)
        settled(flown)
        assert "take-over:lwd_1" in task(flown, id_).hold.words

    @pytest.mark.parametrize("long", [False, True], ids=["short", "long"])
    def test_one_that_came_home_by_itself_between_two_goals_is_told_and_its_task_begins_anew(
        self, long: bool, wording: Wording
    ) -> None:
        flown, id_ = begin(WAITS_UP_THERE)
        drone = flown.flight.engine.state.agents
        assert flown.flight.run_until(lambda: drone["lwd_1"].landed == "airborne" and not drone["lwd_1"].goal)
        flown.flight.run_for(2)
        flown.die()
        flown.away(60)  # its link is silent: it comes home by itself, and lands
        for _ in range(2):
            flown.flight.driver._publish_clock()  # its link is there again, and the drone the engine's
            flown.away(1)
        flown.resume(away_s=0, since=flown.flight.now - (60_000_000 if long else 18_000_000))
        settled(flown)

        ways = f"formiga restart {id_} or formiga abort {id_}"
        landed = f"lwd_1 landed while the engine was away; {id_} waits: {ways}"
        assert task(flown, id_).hold.words == ("resume",)
        assert (landed in flown.alarms()) is not long  # after a long outage all wait, and `why` tells it of each
        wording(why(flown, id_)[0])

        flown.flight.ask(inp.Operator("restart", id_, "watcher_1"))

        assert task(flown, id_).hold.found == {}
        assert ends(flown, id_).run == 2


WAITS_UP_THERE = """\
imports: [lib/flying.yaml]
agents:
  drone: {type: lwd, id: lwd_1}
steps:
  - do: drone.TakeOff
    with: {altitude: 20 m}
  - wait: 90 s
  - do: drone.GoTo
    with: {to: {east: 60 m, north: 300 m, height: 60 m}}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""


def test_an_order_that_is_too_old_is_not_sent_again() -> None:
    flown, id_ = begin(LONG_LEG.replace("    retry: {attempts: 2}\n", ""))
    assert flown.flight.run_until(
        lambda: leg(flown, "TakeOff") is not None and leg(flown, "TakeOff").state == "running"
    )  # type: ignore[union-attr]
    steps = len(flown.seen)  # an equal flight tells which step sends the leg
    probe, _ = begin(LONG_LEG.replace("    retry: {attempts: 2}\n", ""))
    assert probe.flight.run_until(lambda: leg(probe) is not None)
    flown.kill_at(len(probe.seen) - steps)  # the step that sends the leg: it never leaves
    assert not flown.run()
    flown.flight.sim["lwd_1"].drone.on_link_loss = "hold"
    flown.resume(away_s=9, since=flown.killed_at - 2_000_000)
    settled(flown)
    ended = ends(flown, id_, "FAILED")
    assert ended.outcome.code == "goal_expired"


class TestOutbox:
    """What was committed in the last step, and never left."""

    def test_a_cancel_is_sent_again_under_the_same_id(self) -> None:
        flown, id_ = begin()
        in_flight(flown)
        goal = leg(flown)
        assert goal is not None
        flown.kill_at(1)
        with pytest.raises(Killed):
            flown.flight.abort(id_)
        flown.die()
        flown.resume(away_s=2)
        flown.flight.run_for(0.2)  # before a lost cancel would be sent again by itself
        cancels = [e for step in flown.seen for e in step.effects if isinstance(e, inp.CancelGoal)]
        assert [(c.goal_id, c.agent) for c in cancels] == [(goal.id, "lwd_1")] * 2
        side = flown.flight.sim["lwd_1"].side
        assert side is not None
        assert side.state_of(goal.id) == "canceled"
        ends(flown, id_, "CANCELED")

    def test_a_cancel_that_is_never_confirmed_still_ends_in_a_quarantine(self) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.flight.sim.never_confirm_cancel("lwd_1")
        flown.flight.abort(id_)
        flown.flight.run_for(5)
        flown.die()
        flown.resume(away_s=2)
        flown.flight.run_for(40)  # the grace of a cancel, from the restart on
        lwd_1 = flown.flight.engine.state.agents["lwd_1"]
        assert (lwd_1.pool, lwd_1.quarantine) == ("QUARANTINED", "cancel_unconfirmed")
        assert task(flown, id_).status == "CANCELED"

    def test_a_notice_is_told_again(self) -> None:
        flown, id_ = begin()
        assert flown.flight.run_until(lambda: bool(flown.flight.engine.state.questions))
        before = len(flown.seen)
        probe, _ = begin()
        assert probe.run()
        said = next(
            s.seq for s in probe.seen for e in s.effects if isinstance(e, inp.NotifyPeople) and e.text == "it is yes"
        )
        flown.kill_at(said - flown.seen[before - 1].seq)
        assert not flown.run()
        first = flown.resume(away_s=2)
        assert [e.text for e in first.effects if isinstance(e, inp.NotifyPeople)] == ["it is yes"]
        ends(flown, id_)

    def test_a_question_that_was_withdrawn_is_withdrawn_again(self) -> None:
        flown, id_ = begin(answers=[{"match": "Seen", "never": True}])
        assert flown.flight.run_until(lambda: bool(flown.flight.engine.state.questions))
        flown.flight.run_for(1)
        (question,) = flown.flight.engine.state.questions
        flown.kill_at(1)
        with pytest.raises(Killed):
            flown.flight.abort(id_)
        flown.die()
        flown.resume(away_s=2)
        flown.flight.run_for(1)
        side = flown.flight.sim["watcher_1"].side
        assert side is not None
        assert side.state_of(f"{question}~watcher_1") == "canceled"
        ends(flown, id_, "CANCELED")

    def test_a_machine_that_was_being_asked_after_a_quarantine_is_asked_again(self) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.flight.hub.cut("lwd_1")
        assert flown.flight.run_until(lambda: flown.flight.engine.state.agents["lwd_1"].pool == "QUARANTINED")
        flown.flight.hub.mend("lwd_1")
        assert flown.flight.run_until(lambda: flown.flight.engine.state.agents["lwd_1"].quarantine == "asked")
        flown.die()
        flown.resume(away_s=2)
        assert flown.flight.run_until(lambda: flown.flight.engine.state.agents["lwd_1"].pool == "STANDBY", limit_s=600)
        assert task(flown, id_).outcome.code == "agent_lost"


class TestPeople:
    def test_an_answer_given_meanwhile_counts_and_nobody_is_asked_again(self) -> None:
        flown, id_ = begin(answers=[{"match": "Seen", "options": ["no"], "after": "2 s"}])
        assert flown.flight.run_until(lambda: bool(flown.flight.engine.state.questions))
        flown.flight.run_for(0.5)
        flown.die()
        flown.resume(away_s=5)
        ends(flown, id_)
        assert [one.goal for one in flown.begun if one.action == "Confirm"] == [f"{id_}/1/steps/steps[2]~watcher_1"]
        notices = [e.text for step in flown.seen for e in step.effects if isinstance(e, inp.NotifyPeople)]
        assert "it is no" in notices

    def test_an_open_question_stays_open_under_its_number(self) -> None:
        flown, id_ = begin(answers=[{"match": "Seen", "options": ["no"], "after": "20 s"}])
        assert flown.flight.run_until(lambda: bool(flown.flight.engine.state.questions))
        flown.flight.run_for(0.5)
        flown.die()
        flown.resume(away_s=5)
        settled(flown)
        assert [q.number for q in flown.flight.engine.state.questions.values()] == ["Q1"]
        ends(flown, id_)
        assert len([one for one in flown.begun if one.action == "Confirm"]) == 1


def test_it_dies_once_more_while_it_asks() -> None:
    flown, id_ = begin()
    in_flight(flown)
    side = flown.flight.sim["lwd_1"].side
    assert side is not None
    side._silence_us = None  # it does not come home by itself, which would hold its task, too
    flown.die()
    flown.resume(away_s=20)
    flown.kill_at(1)
    assert not flown.run()
    flown.resume(away_s=11)  # together too long: nobody watched for 31 s
    settled(flown)
    assert "resume" in task(flown, id_).hold.words
    assert flown.flight.engine.state.epoch == 3


class TestGivenUp:
    def test_a_task_that_stops_the_engine_goes_home_without_its_tree(self, wording: Wording) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.die()
        flown.resume(away_s=2, poison=(id_,))
        ended = ends(flown, id_, "FAILED")
        assert ended.outcome.code == "exception"
        wording(ended.outcome.reason)
        assert flown.flight.engine.state.agents["lwd_1"].landed == "grounded"
        assert any(text.startswith(f"{id_} is not resumed, its machines come home") for text in flown.alarms())
        assert not [
            e for step in flown.seen for e in step.effects if isinstance(e, inp.NotifyPeople) and "tidied" in e.text
        ]

    def test_a_task_of_another_version_goes_home(self, wording: Wording) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.die()
        flown.resume(away_s=2, node_state=0, poison=())
        ended = ends(flown, id_, "FAILED")
        assert ended.outcome.code == "upgrade"
        wording(ended.outcome.reason)

    def test_at_any_moment_of_a_mission(self) -> None:
        counted, _ = begin()
        before = len(counted.seen)
        assert counted.run()
        for step in range(1, len(counted.seen) - before, 12):
            flown, id_ = begin()
            flown.kill_at(step)
            assert not flown.run()
            flown.resume(away_s=2, node_state=0)
            assert flown.run(), flown.story()
            assert flown.twice() == []
            assert task(flown, id_).status in ("FAILED", "SUCCEEDED"), flown.story()
            check_rehearsal(flown.flight)

    def test_recover_itself_is_begun_anew(self) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.flight.abort(id_)
        assert flown.flight.run_until(lambda: task(flown, id_).section == "recover")
        flown.flight.run_for(3)
        flown.die()
        flown.resume(away_s=2, poison=(id_,))
        assert flown.run(), flown.story()
        assert flown.flight.engine.state.agents["lwd_1"].landed == "grounded"
        check_rehearsal(flown.flight)


class TestStanding:
    def test_lockdown_and_orders_stand(self) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.flight.ask(inp.Operator("hold", "lwd_1", "watcher_1"))
        flown.flight.run_for(2)
        flown.die()
        flown.resume(away_s=2)
        settled(flown)
        assert flown.flight.engine.state.orders["lwd_1"].stop == "hold"
        assert task(flown, id_).hold.words == ("operator:lwd_1",)
        flown.flight.ask(inp.LockdownOrder("return", "watcher_1"))
        flown.die()
        flown.resume(away_s=2)
        assert flown.flight.engine.state.lockdown is not None
        assert flown.flight.run_until(
            lambda: flown.flight.engine.state.agents["lwd_1"].landed == "grounded", limit_s=600
        )


class TestWhy:
    def test_it_tells_that_machines_are_asked(self, wording: Wording) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.die()
        flown.resume(away_s=3)
        wording(why(flown, id_)[0])
        settled(flown)
        assert not [text for text, _ in why(flown, id_) if "away" in text]

    def test_it_tells_how_a_held_task_goes_on(self, wording: Wording) -> None:
        flown, id_ = begin()
        in_flight(flown)
        flown.die()
        flown.flight.sim.kill("lwd_1")
        flown.flight.sim.restart("lwd_1")
        flown.resume(away_s=2)
        settled(flown)
        told = why(flown, id_)
        wording(told[0])
        assert (
            "lwd_1.GoTo was interrupted: its process was started anew while the engine was away; `continue` sends it again",
            "",
        ) in told


def why(flown: Crashing, of: str) -> list[tuple[str, str]]:
    engine = flown.flight.engine
    _, lines = explain(engine.state, engine.core.models, of, flown.flight.now, catalogue=CATALOGUE)
    return [(line.text, line.hint) for line in lines]


def test_a_way_that_ended_while_no_engine_was_there_is_no_way_that_does_not_get_on() -> None:
    types = {
        name: replace(kind, limits={**kind.limits, "link_silence_s": 600.0}) for name, kind in CATALOGUE.types.items()
    }
    site = replace(SITE, resume_hold_after_us=600_000_000)
    flown, id_ = begin(site=site, catalogue=replace(CATALOGUE, types=types))
    in_flight(flown)
    flown.die()
    flown.resume(away_s=200)
    ends(flown, id_)
    assert not [text for text in flown.alarms() if "does not get on" in text]


WAITS = """\
agents:
  picker: {type: picker, id: picker_1}
steps:
  - wait_for: picker.sos
    timeout: 1 h
"""


@pytest.mark.parametrize("away_s", [3.0, 300.0])
def test_an_event_that_was_told_while_no_engine_was_there_is_told_to_the_next(away_s: float) -> None:
    flown, id_ = begin(WAITS)
    flown.flight.run_for(5)
    flown.die()
    flown.away(1.0)
    flown.flight.sim.agents["picker_1"].body.tell("sos", {})
    flown.resume(away_s=away_s)
    settled(flown)
    flown.flight.run_for(5)
    if "resume" in task(flown, id_).hold.words:
        flown.flight.ask(inp.Operator("continue", id_, "watcher_1"))
    flown.flight.run_for(5)
    ended = task(flown, id_)
    assert ended.status == "SUCCEEDED", flown.story()
    assert len(flown.flight.engine.state.agent_events["picker_1"]) == 1
    flown.flight.close()
