"""Facts of single records of the engine: an agent, a goal, a question, a task."""

from collections.abc import Collection
from typing import Final
from urllib.parse import urlencode

from formiga_bt.base.clock import Micros
from formiga_bt.base.geo import Frame, Position
from formiga_bt.engine.kernel.library import newest_of
from formiga_bt.engine.kernel.pace import throttled
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, Question, TaskRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.show.amounts import percent
from formiga_bt.show.facts import AgentFact, FileFact, GoalFact, Point, QuestionFact, TaskFact
from formiga_bt.show.history.notes import gate_words
from formiga_bt.show.history.rows import path_of_goal, where
from formiga_bt.show.history.urgency import UrgencyIndex
from formiga_bt.show.lapse import cleared_machine, lapses_at
from formiga_bt.show.why.standing import stands
from formiga_bt.transport.messages import to_wire

SHOWN_FILES: Final = 5
"""The newest files of its task are shown with a question."""

MOST_NODES: Final = 6
"""Of a way on routes so many nodes are named."""


def point(where: Position) -> Point:
    """Return a point to a centimetre."""
    return Point(round(where.east_m, 2), round(where.north_m, 2), round(where.up_m, 2))


def task_fact(index: UrgencyIndex, task: TaskRecord) -> TaskFact:
    """Return a task as lists show it."""
    over = task.section == "done"
    coming = None if over else index.urgent(task)
    slow = throttled(index.state, task, index.now)
    return TaskFact(
        id=task.id,
        name=task.name,
        status=task.status,
        held=task.hold.words,
        section="" if over else task.section,
        priority=task.request.priority,
        by=task.request.by,
        version=task.request.version,
        newest=_newest(index.state, task),
        parent=task.family.parent,
        children=task.family.children,
        agents=agents_of(task),
        code=task.outcome.code,
        reason=task.outcome.reason,
        doing=("throttled; " if slow is not None else "") + index.doing(task),
        throttled_since=slow.since if slow is not None else None,
        needs="" if over else index.needs(task),
        urgent_at=coming[0] if coming is not None else None,
        urgent=coming[1] if coming is not None else "",
        submitted_at=task.times.submitted_at,
        ended_at=task.times.ended_at,
    )


def _newest(state: EngineState, task: TaskRecord) -> int:
    newest = newest_of(state, task.name)
    return newest.n if newest is not None and not task.system.agent else task.request.version


def agents_of(task: TaskRecord) -> tuple[str, ...]:
    """Return the agents that a task holds, or had if it is over."""
    if task.section == "done":
        return task.agents.granted
    held = tuple(agent for group in task.agents.roles.values() for agent in group)
    return tuple(dict.fromkeys((*held, *((task.system.agent,) if task.system.agent else ()))))


def stands_rebooted(agent: AgentRecord) -> bool:
    """Return whether a machine stands since its process was started anew, and waits for a person to look at it."""
    return agent.rebooted and not agent.human and agent.landed != "airborne"


def agent_fact(
    state: EngineState,
    agent: AgentRecord,
    now: Micros,
    wall: Micros = 0,
    port: str = "",
    desk: Collection[str] = (),
    frame: Frame | None = None,
) -> AgentFact:
    """Return an agent; `port`: at which it stands; `frame`: tells its degrees."""
    order = state.orders.get(agent.id)
    lat, lng = frame.lat_lng(agent.position) if frame is not None and agent.position is not None else (None, None)
    return AgentFact(
        id=agent.id,
        type=agent.type,
        mobility=agent.mobility,
        pool=agent.pool,
        liveness=agent.liveness,
        control=agent.control,
        landed=agent.landed,
        task=agent.task,
        role=agent.role,
        action=agent.action,
        home=agent.home,
        battery=None if agent.battery is None else round(agent.battery, 1),
        at=None if agent.position is None else point(agent.position),
        port=port,
        lat=None if lat is None else round(lat, 7),
        lng=None if lng is None else round(lng, 7),
        layer_m=agent.layer_m,
        at_desk=agent.id in desk,
        on_link_loss=agent.on_link_loss,
        bad=agent.bad,
        order=stands(state, order, now, wall) if order is not None else "",
        taken=agent.taken,
        breach=agent.breach.removeprefix("!"),
        quarantine=agent.quarantine,
        out=f"{agent.out} ({agent.out_by})" if agent.out_by else agent.out,
        rebooted=stands_rebooted(agent),
        refused=agent.refused or agent.refused_at_rest,
        word=agent.word,
        heading_deg=agent.heading_deg,
        speed_m_s=agent.speed_m_s,
        floor=agent.floor,
        charging=agent.charging,
        fields=to_wire(agent.fields),
        errors=tuple(error.text or error.code for error in agent.errors),
        refused_actions=dict(agent.refused_actions),
        refused_fields=dict(agent.refused_fields),
        engine_id=agent.engine_id,
        wire=agent.wire,
        lacks=agent.lacks,
    )


def goal_fact(goal: GoalRecord) -> GoalFact:
    """Return a goal."""
    return GoalFact(
        id=goal.id,
        agent=goal.agent,
        action=goal.action,
        state=goal.state,
        code=goal.code,
        text=gate_words(goal) if goal.state == "gated" else goal.text,
        progress=percent(goal.progress),
        phase=goal.phase,
        since=goal.sent_at if goal.sent_at is not None else goal.at,
        path=path_of_goal(goal.id),
        target=" ".join(part for part in (where(goal), way_words(goal)) if part),
    )


def way_words(goal: GoalRecord) -> str:
    """Return the nodes of the site's routes that are ahead of who drives on them, or ""."""
    path = goal.path
    if len(path) < 2:
        return ""
    shown = path if len(path) <= MOST_NODES else (*path[: MOST_NODES - 1], "..", path[-1])
    return f"by {', '.join(shown)}"


def file_facts(task: TaskRecord) -> tuple[FileFact, ...]:
    """Return the files of a task."""
    return tuple(
        FileFact(
            agent=one.agent,
            what=one.what,
            path=path_of_goal(one.goal) if one.goal else "",
            at=one.at,
            name=one.file.name,
            media_type=one.file.media_type,
            size=one.file.size,
            sha256=one.file.sha256,
            uri=one.file.uri,
            url=f"/v1/attachments/{one.file.sha256}?"
            + urlencode({"name": one.file.name, "media_type": one.file.media_type}),
        )
        for one in task.files.found
    )


def question_fact(state: EngineState, question: Question, desk: Collection[str] = ()) -> QuestionFact:
    """Return an open question; `desk`: who answers at this engine."""
    said = {answer.by for answer in question.answers}
    return QuestionFact(
        number=question.number,
        task=question.task,
        text=question.text,
        kind=question.kind,
        note=question.note,
        options=question.options,
        asked=question.asked,
        shown=tuple(person for person in question.asked if f"{question.id}~{person}" in state.goals),
        answers={answer.by: answer.answer for answer in question.answers},
        here=tuple(person for person in question.asked if person in desk and person not in said),
        asked_at=question.asked_at,
        lapses_at=lapses_at(state, question),
        if_no_answer=question.if_no_answer,
        clears=cleared_machine(question) or question.clears,
        clears_on=("clear",) if question.kind == "clearance" else question.clears_on,
        files=file_facts(state.tasks[question.task])[-SHOWN_FILES:] if question.task in state.tasks else (),
        form=question.form,
    )
