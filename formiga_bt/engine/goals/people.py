"""Questions to people: one queue per person, by task priority and time asked; how many show at once is the catalogue's word.

A question is shown to a person as a Confirm goal `<question>~<person>`. Withdrawing it is local and always succeeds.
"""

from typing import Any

import msgspec
from msgspec.structs import replace

from formiga_bt.base.asking import CONFIRM
from formiga_bt.engine.goals.wire_values import read_result
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import CancelGoal, NotifyPeople, SendGoal
from formiga_bt.engine.kernel.records import PRIORITIES, Answer, GoalRecord, Question
from formiga_bt.engine.kernel.timers import AcceptDue, EscalationDue
from formiga_bt.lang.forms import lack
from formiga_bt.nodes.run import AskOrder

TTL_BEATS = 30
SHOWN_FILES = 5
"""The newest files of its task go with a question."""
MAX_OPEN = 100
"""Questions that may be open for one person."""


class People:
    """All open questions."""

    def __init__(self, core: Core) -> None:
        self._core = core

    def of_role(self, site_role: str) -> tuple[str, ...]:
        """Return the people of a site role; without a list in the site file, `watchers` are all watchers known."""
        core = self._core
        listed = core.site.people.get(site_role)
        if listed is not None:
            return tuple(listed)
        kind = site_role.removesuffix("s")
        return tuple(a.id for a in core.state.agents.values() if a.human and a.type == kind)

    # -- the life of a question ----------------------------------------------------------------------------------
    def open(self, task_id: str, order: AskOrder, kind: str = "ask") -> None:
        """Open a question; it is shown when its turn comes with each person."""
        core = self._core
        question = Question(
            id=order.id,
            number=f"Q{core.count('question')}",
            task=task_id,
            priority=core.task(task_id).request.priority,
            kind=kind,  # type: ignore[arg-type]
            text=order.text,
            note=order.note,
            options=order.options,
            tiers=order.tiers,
            policy=order.policy,
            escalate_us=order.escalate_us,
            expires_at=order.expires_at,
            if_no_answer=order.if_no_answer,
            clears=order.clears,
            clears_on=order.clears_on,
            form=order.form,
            owner=order.owner,
            asked_at=core.now,
            order=core.count("asked"),
        )
        core.emit(ch.QuestionPut(question))
        if order.escalate_us is not None and len(order.tiers) > 1:
            core.set_deadline(EscalationDue(order.id), core.now + order.escalate_us)

    def escalate(self, question_id: str) -> None:
        """Open a question to the next group as well."""
        core = self._core
        question = core.state.questions.get(question_id)
        if question is None or question.reply is not None or question.tier + 1 >= len(question.tiers):
            return
        core.emit(ch.QuestionPut(replace(question, tier=question.tier + 1)))
        if question.tier + 2 < len(question.tiers) and question.escalate_us is not None:
            core.set_deadline(EscalationDue(question_id), core.now + question.escalate_us)

    def close(self, question_id: str) -> None:
        """Withdraw a question from everybody, or forget an answered one."""
        core = self._core
        question = core.state.questions.get(question_id)
        if question is None:
            return
        core.clear_deadline(EscalationDue(question_id))
        for person in question.asked:
            self._take_back(question.showing(person))
        core.emit(ch.QuestionDrop(question_id))

    def _take_back(self, goal_id: str) -> None:
        core = self._core
        goal = core.state.goals.get(goal_id)
        if goal is None:
            return
        core.set_wall(AcceptDue(goal_id), None)
        if goal.in_flight and not core.withdraw_send(goal_id):
            core.effect(CancelGoal(goal_id, goal.agent, goal.action))
        core.emit(ch.GoalDrop(goal_id))

    # -- showing -------------------------------------------------------------------------------------------------
    def invalidate(self, person: str) -> None:
        """A person came, went, or became free: look at that queue again."""
        self._core.index.free_people[person] = None

    def pump(self) -> None:
        """Show each reachable person what is next in their queue."""
        core, index = self._core, self._core.index
        if not index.free_people:
            return
        people, index.free_people = index.free_people, {}
        asked = dict.fromkeys(question for person in people for question in index.asked_of(person))
        if not asked:
            return
        concurrency = core.action(CONFIRM).concurrency
        queue = sorted((core.state.questions[one] for one in asked), key=lambda q: (PRIORITIES[q.priority], q.order))
        for question in queue:
            if question.reply is not None:
                continue
            for person in question.asked:
                if person not in people:
                    continue
                agent = core.state.agents.get(person)
                if agent is None or not agent.is_reachable or index.shown_to(person) >= concurrency:
                    continue
                if question.showing(person) in core.state.goals or person in question.declined:
                    continue
                if any(a.by == person for a in question.answers):
                    continue
                self._show(question, person)

    def _show(self, question: Question, person: str) -> None:
        core = self._core
        goal_id = question.showing(person)
        fields: dict[str, Any] = {
            "question": question.text,
            "options": list(question.options),
            "note": question.note,
            "number": question.number,
            "expires_us": question.expires_at,
            "if_no_answer": question.if_no_answer,
        }
        if question.form:
            fields["form"] = [msgspec.to_builtins(one) for one in question.form]
        task = core.state.tasks.get(question.task)
        if task is not None and task.files.found:
            fields["attachments"] = [msgspec.structs.asdict(one.file) for one in task.files.found[-SHOWN_FILES:]]
        goal = GoalRecord(
            id=goal_id, agent=person, action=CONFIRM, task=question.task, owner="!question", fields=fields,
            state="sent", order=core.count("goal"), at=core.now, sent_at=core.now,
        )  # fmt: skip
        core.emit(ch.GoalPut(goal))
        core.effect(SendGoal(goal_id, person, CONFIRM, fields, core.state.epoch, TTL_BEATS, task=question.task))
        core.set_wall(AcceptDue(goal_id), core.action(CONFIRM).accept_timeout_us)

    # -- answers -------------------------------------------------------------------------------------------------
    def on_goal_ended(self, goal_id: str) -> Question | None:
        """Take the end of a Confirm goal; return the question if it is now decided."""
        core = self._core
        goal = core.state.goals.get(goal_id)
        if goal is None:
            return None
        question = core.state.questions.get(goal_id.rsplit("~", 1)[0])
        core.emit(ch.GoalDrop(goal_id))
        if question is None or question.reply is not None:
            return None
        if goal.state in ("in_doubt", "lost"):
            return None  # their app was started again and remembers nothing: it is shown again
        withdrawn = goal.state == "canceled" and goal.agent not in question.again
        if (
            goal.code == "goal_expired" or withdrawn
        ):  # it slept, or an engine that forgot it took it back: the id is used up
            core.emit(ch.QuestionPut(replace(question, again=(*question.again, goal.agent))))
            return None
        answer = goal.result.get("answer")
        filled, wrong = _filled(question, goal.result.get("form")) if question.form else ({}, "")
        if goal.state != "succeeded" or answer not in question.options or wrong:
            core.emit(ch.QuestionPut(replace(question, declined=(*question.declined, goal.agent))))
            if wrong and goal.state == "succeeded":
                text = f"{question.number} is not answered: {wrong}"
                core.effect(NotifyPeople(text, (goal.agent,), "warning", question.task))
            return None
        question = replace(question, answers=(*question.answers, Answer(goal.agent, str(answer), core.now, filled)))
        question = replace(question, reply=decide(question))
        core.emit(ch.QuestionPut(question))
        if question.reply is None:
            return None
        core.clear_deadline(EscalationDue(question.id))
        for person in question.asked:
            if person != goal.agent and question.showing(person) in core.state.goals:
                self._take_back(question.showing(person))
                text = f"{question.number} is already answered: {question.reply['answer']} by {question.reply['by']}"
                core.effect(NotifyPeople(text, (person,), "info", question.task))
        return question

    def late(self, person: str, goal_id: str) -> None:
        """Tell a person, once, that an answer came after the end; it changes nothing.

        The same answer may come twice: by itself, and as the reply to the question's withdrawal.
        """
        agent = self._core.state.agents.get(person)
        if agent is not None and agent.told_late != goal_id:
            self._core.put_agent(person, told_late=goal_id)
            self._core.effect(NotifyPeople("answer_late: the question was closed before", (person,), "info"))


def decide(question: Question) -> "dict[str, object] | None":
    """Return `{answer, by, at, all}` and what was filled in, once the policy is met; else None.

    `all`: the common answer, or `mixed`.
    """
    answers = question.answers
    if not answers:
        return None
    everyone = tuple(dict.fromkeys(p for tier in question.tiers for p in tier))
    if question.policy == "all" and {a.by for a in answers} < set(everyone):
        return None
    last = answers[-1]
    words = dict.fromkeys(a.answer for a in answers)
    answer = last.answer if question.policy == "any" or len(words) == 1 else "mixed"
    every = tuple({"answer": a.answer, "by": a.by, "at": a.at, **a.form} for a in answers)
    own = last.form if question.policy == "any" else {}
    return {"answer": answer, "by": last.by, "at": last.at, "all": every, **own}


def _filled(question: Question, raw: Any) -> tuple[dict[str, Any], str]:
    """Return what a person filled in, as runtime values, and what is wrong with it, or ""."""
    try:
        values = read_result({one.name: one.kind for one in question.form}, raw or {})
    except ValueError as error:
        return {}, f"what was filled in cannot be read: {error}"
    return values, lack(question.form, values)
