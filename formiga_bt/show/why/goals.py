"""Single lines about goals, questions and silent agents: what something waits for, or does."""

from collections.abc import Iterator

from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, Question, TaskRecord
from formiga_bt.engine.kernel.timers import EscalationDue
from formiga_bt.show.facts import Because
from formiga_bt.show.lapse import lapses_at
from formiga_bt.show.why.scene import WhyScene
from formiga_bt.show.why.unanswered import then
from formiga_bt.show.why.words import GATE, say, span

RUNNING_HINT = "is its process running, and connected to this engine? formiga agents"


def goal_line(scene: WhyScene, goal: GoalRecord) -> Because:
    """Return what a goal waits for at the gate, or what it does."""
    if goal.state != "gated":
        return Because(f"goal.{goal.state}", flight(scene, goal), agent=goal.agent)
    code = "control:handback" if (goal.code, goal.text) == ("control", "handback") else goal.code
    words = say(GATE, code, text=goal.text or "another machine", agent=goal.agent)
    since = f" (since {span(scene.now - goal.at)})" if goal.at and scene.now - goal.at >= 1_000_000 else ""
    return Because(f"gate.{goal.code or 'open'}", f"{goal.agent}.{goal.action} {words}{since}", agent=goal.agent)


def flight(scene: WhyScene, goal: GoalRecord) -> str:
    """Return what an agent does for a goal, since when, how far it has come."""
    since = span(scene.now - (goal.sent_at if goal.sent_at is not None else goal.at))
    more = [goal.phase] if goal.phase else []
    if goal.progress is not None:
        more.append(f"{goal.progress * 100:.0f} %" if goal.progress <= 1 else f"{goal.progress:.0f} %")
    tail = f" ({', '.join(more)})" if more else ""
    return f"{goal.agent} does {goal.action} since {since}{tail}"


def silent(scene: WhyScene, agents: list[str]) -> Iterator[Because]:
    """Tell of those agents that are not heard of."""
    for agent_id in dict.fromkeys(agents):
        agent = scene.state.agents.get(agent_id)
        if agent is not None and agent.liveness != "ALIVE":
            yield silence_line(scene, agent)


def silence_line(scene: WhyScene, agent: AgentRecord) -> Because:
    """Return for how long an agent is not heard of, and when it counts as lost."""
    silence, lost_after = scene.silence(agent), scene.lost_after(agent)
    text = f"{agent.id} is not heard of" if silence is None else f"{agent.id} has not been heard of for {span(silence)}"
    lost = agent.liveness == "LOST"
    if lost:
        text += "; it counts as lost"
    elif lost_after is not None:
        text += f"; it counts as lost after {span(lost_after)}"
    removed = f" If you have taken it away: formiga agents removed {agent.id}" if lost else ""
    return Because("lost" if lost else "suspect", text, RUNNING_HINT + removed, agent.id)


def questions(scene: WhyScene, task: TaskRecord, *, name_task: bool = False) -> Iterator[Because]:
    """Tell of the open questions of a task."""
    for question in scene.state.questions.values():
        if question.task == task.id and question.reply is None:
            yield question_line(scene, question, name_task=name_task)


def question_line(scene: WhyScene, question: Question, *, name_task: bool = False) -> Because:
    """Return whom a question asks, since when, when it lapses and what then; the hint answers it, where that is done here."""
    shown = [p for p in question.asked if question.showing(p) in scene.state.goals]
    who = ", ".join(question.asked) or "nobody"
    of = f" of {question.task}" if name_task else ""
    text = f"{question.number}{of} waits for an answer of {who} since {span(scene.now - question.asked_at)}"
    text += "".join(f"; {answer.by} said {answer.answer}" for answer in question.answers)
    if not shown:
        text += f"; it is not shown to anyone yet{_unseen(scene, question)}"
    escalates = scene.state.deadlines.get(EscalationDue(question.id))
    if escalates is not None and question.tier + 1 < len(question.tiers):
        text += f"; in {span(escalates.at - scene.now)} {', '.join(question.tiers[question.tier + 1])} is asked too"
    lapse = lapses_at(scene.state, question)
    if lapse is not None:
        text += f"; lapses in {span(lapse - scene.now)}{then(question.kind, question.if_no_answer)}"
    here = [p for p in question.asked if p in scene.desk and not any(answer.by == p for answer in question.answers)]
    hint = f"formiga answer {question.number} {'|'.join(question.options)}" if here else ""
    if len(here) > 1:
        hint += f" --by {here[0]}"
    return Because("question", f"{text}: {question.text}", hint)


def _unseen(scene: WhyScene, question: Question) -> str:
    """Return why nobody sees a question."""
    reasons = []
    for person in question.asked:
        record = scene.state.agents.get(person)
        if record is None:
            reasons.append(f"{person} is not connected")
        elif record.liveness != "ALIVE":
            reasons.append(f"{person} is not heard of")
        else:
            other = next((q for q in scene.state.questions.values() if q.showing(person) in scene.state.goals), None)
            if other is not None:
                reasons.append(f"{person} is asked {other.number} first")
    return f" ({'; '.join(reasons)})" if reasons else ""
