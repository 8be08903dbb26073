"""The tables of tasks, agents and events, in as many columns as the screen is wide."""

from formiga_bt.show.facts import AgentFact, LineFact, TaskFact
from formiga_bt.show.watch.text import (
    TONES,
    Glyphs,
    Line,
    PaneRow,
    Rows,
    Tone,
    TonedText,
    clean,
    fit,
    left,
    line,
    span,
    width_of,
    wrap,
)

WIDE = 100
NARROW = 72
"""Columns from which a table shows more, and below which it shows less."""
SOON_US, FAR_US = 60_000_000, 600_000_000
"""What happens within a minute is red, within ten yellow."""
AGO = 14
"""Columns of how long ago something was."""


def tasks_head(width: int, tasks: tuple[TaskFact, ...]) -> str:
    """Return the head of the table of tasks."""
    ids, agents, urgent = _task_widths(width, tasks)
    cells = [fit("TASK", ids), fit("STATUS", 16), fit("NEXT", urgent)]
    if agents:
        cells.append(fit("AGENTS", agents))
    return " ".join([*cells, "DOES"])


def task_rows(tasks: tuple[TaskFact, ...], now: int, width: int, glyphs: Glyphs) -> Rows:
    """Return a row for each task, in the order given."""
    widths = _task_widths(width, tasks)
    return Rows([t.id for t in tasks], lambda place: _row(tasks[place].id, _task(tasks[place], now, widths, glyphs)))


def _task_widths(width: int, tasks: tuple[TaskFact, ...]) -> tuple[int, int, int]:
    longest = max([4, *(width_of(task.id) for task in tasks)])
    ids = min(longest, 24 if width >= WIDE else 16)
    return ids, 18 if width >= NARROW else 0, 28 if width >= WIDE else 18 if width >= NARROW else 12


def _task(task: TaskFact, now: int, widths: tuple[int, int, int], glyphs: Glyphs) -> Line:
    ids, agents, urgent = widths
    word = "HELD" if task.held and not task.is_over else task.status
    status = f"{glyphs.marks.get(word, '?')} {task.status if not task.held or task.is_over else f'{task.status} HELD'}"
    when = left(task.urgent_at, now)
    next_ = f"{when} {clean(task.urgent)}".strip()
    until = task.urgent_at - now if task.urgent_at is not None else FAR_US
    soon: Tone = "alarm" if until < SOON_US else "warn" if until < FAR_US else "plain"
    pieces = [
        TonedText(fit(clean(task.id), ids, glyphs) + " ", "bold"),
        TonedText(fit(status, 16, glyphs) + " ", TONES.get(word, "plain")),
        TonedText(fit(next_, urgent, glyphs) + " ", soon),
    ]
    if agents:
        pieces.append(TonedText(fit(clean(" ".join(task.agents)), agents, glyphs) + " ", "agent"))
    says = f"{task.code} {task.reason}".strip() if task.is_over or (task.code and not task.doing) else task.doing
    if task.needs and not task.is_over:
        needs = "NEEDS YOU: " + ("" if says.startswith(task.needs) else f"{task.needs} ")
        pieces.append(TonedText(clean(needs), "alarm"))
    return line(*pieces, clean(says))


def agents_head(width: int, agents: tuple[AgentFact, ...]) -> str:
    """Return the head of the table of agents."""
    ids, tasks, actions = _agent_widths(agents)
    cells = [fit("AGENT", ids), fit("STATE", 16), fit("BATTERY", 7)]
    if width >= WIDE:
        cells[1:1] = [fit("TYPE", 8)]
    if width >= NARROW:
        cells += [fit("TASK", tasks), fit("ACTION", actions)]
    return " ".join([*cells, "ORDER, TROUBLE"])


def agent_rows(agents: tuple[AgentFact, ...], width: int, glyphs: Glyphs) -> Rows:
    """Return a row for each agent."""
    widths = _agent_widths(agents)
    return Rows(
        [a.id for a in agents], lambda place: _row(agents[place].id, _agent(agents[place], width, widths, glyphs))
    )


def _agent_widths(agents: tuple[AgentFact, ...]) -> tuple[int, int, int]:
    """Return the columns of ids, tasks and actions: what the longest takes, so that trouble has the rest."""
    ids = max([8, *(width_of(agent.id) for agent in agents)])
    tasks = max([8, *(width_of(agent.task) for agent in agents)])
    actions = max([8, *(width_of(agent.action) for agent in agents)])
    return min(ids, 12), min(tasks, 16), min(actions, 12)


def _agent(agent: AgentFact, width: int, widths: tuple[int, int, int], glyphs: Glyphs) -> Line:
    ids, tasks, actions = widths
    state, tone = _state(agent)
    pieces = [TonedText(fit(clean(agent.id), ids, glyphs) + " ", "agent")]
    if width >= WIDE:
        pieces.append(TonedText(fit(clean(agent.type), 8, glyphs) + " ", "dim"))
    pieces.append(TonedText(fit(state, 16, glyphs) + " ", tone))
    pieces.append(TonedText(fit(agent.charge, 7, glyphs) + " "))
    if width >= NARROW:
        pieces.append(TonedText(fit(clean(agent.task), tasks, glyphs) + " "))
        pieces.append(TonedText(fit(clean(agent.action), actions, glyphs) + " ", "kind"))
    return line(*pieces, TonedText(clean(_trouble(agent)), "warn"))


def _state(agent: AgentFact) -> tuple[str, Tone]:
    """Return how an agent stands in one or two words; what is worst goes first."""
    if agent.taken:
        return ("HAND BACK", "warn") if agent.control == "engine" else (clean(agent.control).upper(), "warn")
    if agent.quarantine:
        return "QUARANTINED", "alarm"
    if agent.liveness and agent.liveness != "ALIVE":
        return clean(agent.liveness), "alarm"
    if agent.human:
        return "asked" if agent.word == "EXECUTING ACTION" else "here", "plain"
    if agent.landed == "airborne":
        return "AIRBORNE", "good"
    return clean(agent.pool or agent.landed), "warn" if agent.pool == "PARKED_AWAY" else "plain"


def _trouble(agent: AgentFact) -> str:
    words = [agent.order, agent.breach.removeprefix("!"), agent.quarantine, agent.refused]
    return "; ".join(word for word in words if word)


def line_rows(lines: tuple[LineFact, ...], now: int, width: int) -> Rows:
    """Return a row for each line of the log, newest first; what is too long for a line goes on in the next."""
    newest = lines[::-1]
    return Rows(
        [f"{one.at}:{one.text}" for one in newest],
        lambda place: PaneRow(f"{newest[place].at}:{newest[place].text}", _line(newest[place], now, width)),
    )


def _row(row_id: str, pieces: Line) -> PaneRow:
    return PaneRow(row_id, (pieces,))


def _line(one: LineFact, now: int, width: int) -> tuple[Line, ...]:
    tone: Tone = "alarm" if one.severity == "alarm" else "warn" if one.severity == "warning" else "plain"
    word = "ALARM: " if one.severity == "alarm" else "WARNING: " if one.severity == "warning" else ""
    first, *rest = wrap(word + clean(one.text), max(10, width - AGO))
    head = line(TonedText(f"{span(now - one.at):>8} ago  ", "dim"), TonedText(first, tone))
    return (head, *(line(" " * AGO, TonedText(part, tone)) for part in rest))
