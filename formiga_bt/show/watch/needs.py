"""The pane of what needs a person: open questions with their numbered answers, machines to hand back or to look at, alarms.

A row's id says what it is: `Q7` a question, `agent:hwd_1` a machine, `task:PickUp-3` a task, `alarm:A7` an alarm that nobody
acknowledged. `choices` gives what the number keys do to a row.
"""

from collections.abc import Callable, Sequence
from functools import partial

from formiga_bt.show.facts import AgentFact, AlarmFact, Now, QuestionFact, TaskFact
from formiga_bt.show.watch.orders import HANDBACKS, WatchOrder
from formiga_bt.show.watch.text import Glyphs, Line, PaneRow, Rows, Tone, TonedText, clean, left, line, span, wrap
from formiga_bt.show.why.unanswered import then
from formiga_bt.show.why.words import DOUBLE, quarantine_hint

INDENT = 4


def needs(now: Now, tasks: Sequence[TaskFact], width: int, glyphs: Glyphs) -> Rows:
    """Return what needs a person, most urgent first.

    Args:
        now: the site.
        tasks: the most urgent ones of all, whatever page of tasks `now` has.
        width: columns of the screen.
        glyphs: its characters.
    """
    far = 1 << 62
    found: list[tuple[tuple[int, int, int], str, Callable[[], tuple[Line, ...]]]] = []
    for one in now.questions:
        until = one.lapses_at if one.lapses_at is not None else far
        found.append(((0, until, one.asked_at), one.number, partial(_question, one, now, width, glyphs)))
    for number, agent in enumerate(now.agents):
        if _needs_somebody(agent):
            found.append(((1, far, number), f"agent:{agent.id}", partial(_agent, agent, width)))
    asked = {question.number for question in now.questions}
    handed = {f"hand {agent.id} back" for agent in now.agents if agent.taken and agent.control == "engine"}
    for number, task in enumerate(tasks):
        if task.needs and task.needs not in asked and task.needs not in handed and not task.is_over:
            found.append(((2, far, number), f"task:{task.id}", partial(_task, task, width)))
    for number, alarm in enumerate(now.alarms):
        if alarm.state == "raised":
            found.append(((3, far, number), f"alarm:{alarm.id}", partial(_alarm, alarm, now, width)))
    found.sort(key=lambda each: each[:2])
    return Rows([row for _, row, _ in found], lambda place: PaneRow(found[place][1], found[place][2]()))


def choices(row_id: str, now: Now) -> list[WatchOrder]:
    """Return what the number keys order for a row, 1 first."""
    question = find_question(row_id, now)
    if question is not None:
        return [
            WatchOrder(verb="answer", kind="question", target=question.number, how=option)
            for option in question.options
        ]
    if row_id.startswith("alarm:"):
        return [WatchOrder(verb="ack", kind="alarm", target=name_of(row_id))]
    agent = next((a for a in now.agents if f"agent:{a.id}" == row_id), None)
    if agent is None:
        return []
    if agent.taken and agent.control == "engine":
        return [WatchOrder(verb="handback", kind="agent", target=agent.id, how=how) for how in HANDBACKS]
    looked = agent.quarantine not in ("", DOUBLE) or (not agent.quarantine and _waits_for_a_look(agent))
    return [WatchOrder(verb="clear", kind="agent", target=agent.id)] if looked else []


def name_of(row_id: str) -> str:
    """Return what people call the thing of a row: `hwd_1` of `agent:hwd_1`, an event by its words."""
    kind, _, name = row_id.partition(":")
    return name if kind in ("agent", "task", "alarm") or kind.isdigit() else row_id


def find_question(number: str, now: Now) -> QuestionFact | None:
    """Return an open question by its number."""
    return next((question for question in now.questions if question.number == number), None)


def question_lines(question: QuestionFact, at: int, width: int, glyphs: Glyphs) -> list[Line]:
    """Return a question: who is asked what since when, its whole text, its numbered answers, and what no answer leads to."""
    waits = span(at - question.asked_at)
    who = ", ".join(question.here or question.asked) or "nobody"
    head = f"{question.number} {waits}  {clean(question.task)} asks {clean(who)}"
    if not question.here:
        head += " (with their own app)"
    lines = [line(TonedText(fit_words(head, width, glyphs), "alarm"))]
    lines += [
        line(" " * INDENT, TonedText(part, "bold")) for part in wrap(clean(question.text), max(10, width - INDENT))
    ]
    options = [f"{number} {clean(option)}" for number, option in enumerate(question.options, 1)]
    lines += [line(" " * INDENT, TonedText(part, "warn")) for part in _spread(options, max(10, width - INDENT))]
    if question.lapses_at is not None:
        text = f"lapses in {left(question.lapses_at, at)}{then(question.kind, clean(question.if_no_answer))}"
        lines += [line(" " * INDENT, TonedText(part, "dim")) for part in wrap(text, max(10, width - INDENT))]
    return lines


def fit_words(text: str, width: int, glyphs: Glyphs) -> str:
    """Return a text, cut if it is too long."""
    return text if len(text) <= width else text[: max(0, width - 1)] + glyphs.cut


def _question(question: QuestionFact, now: Now, width: int, glyphs: Glyphs) -> tuple[Line, ...]:
    return tuple(question_lines(question, now.at, width, glyphs))


def _spread(words: list[str], width: int) -> list[str]:
    """Return words in lines, none broken."""
    lines = [""]
    for word in words:
        if lines[-1] and len(lines[-1]) + 3 + len(word) > width:
            lines.append("")
        lines[-1] += ("   " if lines[-1] else "") + word
    return lines


def _waits_for_a_look(agent: AgentFact) -> bool:
    return agent.rebooted and bool(agent.order or agent.task)


def _needs_somebody(agent: AgentFact) -> bool:
    away = agent.quarantine == "removed" and agent.liveness == "LOST"
    unusable = agent.quarantine and not away
    return bool(agent.taken or unusable or agent.breach or agent.pool == "PARKED_AWAY" or _waits_for_a_look(agent))


def _agent(agent: AgentFact, width: int) -> tuple[Line, ...]:
    if agent.taken and agent.control == "engine":
        words = f"HAND BACK {agent.id}: it was taken over, and given back"
        keys = "   ".join(f"{number} {how}" for number, how in enumerate(HANDBACKS, 1))
        return _told(words, width, "warn", line(" " * INDENT, TonedText(keys, "warn")))
    if agent.taken:
        return _told(f"{agent.control.upper()} has {agent.id}: the engine sends it nothing", width, "warn")
    if agent.quarantine == DOUBLE:
        return _told(quarantine_hint(agent.id, DOUBLE), width, "alarm")
    if agent.quarantine or _waits_for_a_look(agent):
        text = f"LOOK AT {agent.id}: {agent.quarantine or 'it was started anew'}"
        return _told(text, width, "alarm", line(" " * INDENT, TonedText("1 clear, when you have looked", "warn")))
    if agent.breach:
        return _told(f"{agent.id} breaks a limit: {agent.breach.removeprefix('!')}", width, "alarm")
    return _told(f"FETCH {agent.id}: it stands away from its port", width, "warn")


def _task(task: TaskFact, width: int) -> tuple[Line, ...]:
    return _told(f"{'HELD ' if task.held else ''}{task.id}: {task.needs}", width, "warn")


def _alarm(one: AlarmFact, now: Now, width: int) -> tuple[Line, ...]:
    times = f", {one.times} times" if one.times > 1 else ""
    text = f"ALARM {one.id} {span(now.at - one.raised_at)} ago{times}: {one.text} ({one.code})"
    return _told(text, width, "alarm", line(" " * INDENT, TonedText("1 ack: you take care of it", "warn")))


def _told(text: str, width: int, tone: Tone, *more: Line) -> tuple[Line, ...]:
    first, *rest = wrap(clean(text), max(10, width - INDENT))
    lines = [line(TonedText(first, tone)), *(line(" " * INDENT, TonedText(part, tone)) for part in rest)]
    return (*lines, *more)
