"""Questions (execution: people): one queue per person, tiers, policies, late answers, people who come and go."""

from formiga_bt.engine.kernel.inputs import CancelGoal, NotifyPeople, SendGoal
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.testing import effects
from tests.golden import Wording
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import Yard
from tests.unit.engine.yard import task as task_text

ASK = "steps: [{ask: 'Ready?', of: [watchers], timeout: 10 min, save_as: got%s}, {notify: 'said ${got.answer}'}]\n"
ONE = "agents: {who: {type: person}}\nsteps: [{ask: 'Ready %s?', of: [who], timeout: 10 min}]\n"


def shown(yard: Yard, person: str) -> list[str]:
    return [str(g.fields["question"]) for g in effects(yard, SendGoal) if g.agent == person]


def notes(yard: Yard, to: str = "") -> list[str]:
    return [n.text for n in effects(yard, NotifyPeople) if not to or n.to == (to,)]


def test_a_person_sees_one_question_at_a_time_by_priority_then_time(make: Make) -> None:
    tasks = [task_text(ONE % name, name=name) for name in ("A", "B", "C", "D")]
    yard = make(*tasks)
    for name, priority in (("A", "medium"), ("B", "medium"), ("C", "high"), ("D", "medium")):
        yard.submit(name, {}, priority=priority)
        yard.run_for(1)

    for count in range(1, 5):
        assert len(shown(yard, "ann")) == count
        yard.ann.answer("yes")
        yard.run_for(0.2)

    assert shown(yard, "ann") == ["Ready A?", "Ready C?", "Ready B?", "Ready D?"]


def test_a_question_has_a_short_number_and_an_expiry(make: Make) -> None:
    yard = make(ONE % "x")
    yard.start()

    goal = effects(yard, SendGoal)[0]

    assert goal.goal_id == "Try-1/1/steps/steps[0]~ann"
    assert goal.fields["number"] == "Q1"
    assert goal.fields["expires_us"] == (yard.task("Try-1").times.active_at or 0) + 600_000_000
    yard.ann.answer("no")
    assert yard.end("Try-1") == ("SUCCEEDED", "")  # every answer is success


def test_any_takes_the_first_answer_and_tells_the_others(make: Make, wording: Wording) -> None:
    yard = make(ASK % "", people=2)
    task = yard.start()
    assert shown(yard, "ann") == shown(yard, "bob") == ["Ready?"]

    yard.people[1].answer("no")

    assert yard.end(task) == ("SUCCEEDED", "")
    wording(notes(yard, "ann"))
    assert [(c.agent, c.goal_id) for c in effects(yard, CancelGoal)] == [("ann", "Try-1/1/steps/steps[0]~ann")]


def test_all_waits_for_everybody_and_says_mixed(make: Make) -> None:
    yard = make(ASK % ", policy: all", people=2)
    task = yard.start()
    yard.ann.answer("yes")
    yard.run_for(30)
    assert yard.task(task).status == "ACTIVE"

    yard.people[1].answer("no")

    assert yard.end(task) == ("SUCCEEDED", "")
    assert "said mixed" in notes(yard)


def test_all_with_one_opinion_is_that_opinion(make: Make) -> None:
    yard = make(ASK % ", policy: all", people=2)
    task = yard.start()
    for person in yard.people:
        person.answer("yes")

    yard.end(task)

    assert "said yes" in notes(yard)


def test_escalation_opens_the_question_to_the_next_and_keeps_it_open_for_the_first(make: Make) -> None:
    text = "agents: {one: {type: person, id: '${whom}'}}\nparams: {whom: {type: agent, of: [person]}}\n"
    text += "steps: [{ask: Ready?, of: [one, watchers], escalate_after: 1 min, timeout: 10 min}]"
    yard = make(text, people=2)
    task = yard.start(whom=AgentRef("ann"))
    yard.run_for(59)
    assert shown(yard, "bob") == []
    yard.run_for(2)
    assert shown(yard, "bob") == ["Ready?"]
    assert shown(yard, "ann") == ["Ready?"]  # the same person is asked once

    yard.ann.answer("yes")

    assert yard.end(task) == ("SUCCEEDED", "")


def test_the_steps_timeout_withdraws_the_question_and_a_late_answer_changes_nothing(make: Make) -> None:
    yard = make("agents: {who: {type: person}}\nsteps: [{ask: Ready?, of: [who], timeout: 1 min}]")
    yard.ann.takes_cancel = False  # the withdrawal crosses with the answer
    task = yard.start()

    assert yard.end(task) == ("FAILED", "timeout")
    assert yard.engine.state.questions == {}
    assert len(effects(yard, CancelGoal)) == 1
    before = yard.task(task)
    yard.ann.answer("yes")
    yard.run_for(1)

    assert yard.task(task) == before
    assert any("answer_late" in note for note in notes(yard, "ann"))


def test_an_answer_that_is_no_option_is_none_and_not_asked_for_without_end(make: Make) -> None:
    yard = make(ONE % "x")
    task = yard.start()
    yard.ann.answer("maybe")
    yard.run_for(1)

    assert len(effects(yard, SendGoal)) == 1
    assert yard.task(task).status == "ACTIVE"
    yard.abort(task)


def test_an_app_that_slept_until_the_prompt_was_too_old_is_shown_it_again(make: Make) -> None:
    yard = make(ONE % "x")
    yard.ann.rejects = ["goal_expired"]

    task = yard.start()

    assert [g.goal_id for g in yard.ann.requests] == [f"{task}/1/steps/steps[0]~ann#2"]
    yard.ann.answer("yes")
    assert yard.end(task) == ("SUCCEEDED", "")


def test_a_question_that_an_engine_took_back_and_forgot_is_shown_again_once(make: Make) -> None:
    yard = make(ASK % "")
    task = yard.start()
    first = yard.ann.goal.goal_id

    yard.ann.side.finish(first, "canceled")  # as it answers the repeated id
    yard.run_for(0.2)
    assert yard.ann.goal.goal_id == f"{first}#2"
    yard.ann.side.finish(f"{first}#2", "canceled")
    yard.run_for(5)

    assert len(shown(yard, "ann")) == 2
    assert task in yard.engine.open_tasks


def test_an_app_that_refuses_is_not_asked_again_and_another_may_answer(make: Make) -> None:
    yard = make(ASK % "", people=2)
    yard.ann.rejects = ["no_screen"]
    task = yard.start()
    yard.run_for(5)
    assert len(shown(yard, "ann")) == 1

    yard.people[1].answer("yes")

    assert yard.end(task) == ("SUCCEEDED", "")


def test_a_person_who_starts_their_app_again_sees_the_question_again(make: Make) -> None:
    yard = make(ONE % "x")
    task = yard.start()
    yard.ann.kill()
    yard.run_for(20)

    yard.ann.boot()
    yard.run_for(1)
    assert len(yard.ann.requests) == 2
    yard.ann.answer("yes")

    assert yard.end(task) == ("SUCCEEDED", "")


def test_a_person_who_was_away_for_a_moment_is_not_asked_twice(make: Make) -> None:
    yard = make(ONE % "x")
    task = yard.start()
    yard.hub.freeze("ann")
    yard.run_for(60)
    yard.hub.thaw("ann")
    yard.run_for(1)

    assert len(yard.ann.requests) == 1
    yard.ann.answer("yes")
    assert yard.end(task) == ("SUCCEEDED", "")


def test_a_person_who_comes_while_the_question_is_open_is_shown_it(make: Make) -> None:
    yard = make(ASK % "", people=0)
    task = yard.start()
    yard.run_for(30)

    ann = yard.agent("ann", "person")
    ann.answer("yes")

    assert yard.end(task) == ("SUCCEEDED", "")


def test_an_abort_withdraws_every_question(make: Make) -> None:
    yard = make(ASK % "", people=2)
    task = yard.start()

    yard.abort(task)
    yard.run_for(1)

    assert yard.outcome(task) == ("CANCELED", "aborted")
    assert [p.side.active for p in yard.people] == [(), ()]


def test_a_retry_of_a_question_is_a_new_question(make: Make) -> None:
    text = "agents: {who: {type: person}}\nsteps:\n  - ask: Ready?\n    of: [who]\n    timeout: 10 min\n"
    text += "    retry: {attempts: 2, delay: 30 s}\n    expect: result.answer == 'yes'\n"
    yard = make(text)
    task = yard.start()
    yard.ann.answer("no")
    yard.run_for(31)
    yard.ann.answer("yes")

    assert yard.end(task) == ("SUCCEEDED", "")
    assert [g.fields["number"] for g in effects(yard, SendGoal)] == ["Q1", "Q2"]
