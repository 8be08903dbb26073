"""From the view's records to what the API shows. Pure functions; called with the view held still."""

from collections.abc import Collection, Iterable

from formiga_bt.base.clock import Micros
from formiga_bt.base.geo import Frame
from formiga_bt.engine.kernel.library import newest_of
from formiga_bt.engine.kernel.pace import throttled
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, Question, TaskRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.model import Catalogue, Task
from formiga_bt.services.replies import models as out
from formiga_bt.services.replies.library_models import LibraryTask
from formiga_bt.services.standing import standing_out
from formiga_bt.services.view import NoticeLine
from formiga_bt.show.history.records import stands_rebooted
from formiga_bt.show.history.rows import ActionRow, rest_words
from formiga_bt.show.lapse import lapses_at
from formiga_bt.show.why.going_on import ways_on_of
from formiga_bt.show.why.places import StepPlaces, running_leaves, title


def millis(at: Micros) -> int:
    """Return milliseconds."""
    return at // 1000


def seconds(span: Micros) -> float:
    """Return seconds, to a tenth."""
    return round(span / 1e6, 1)


def task_out(state: EngineState, task: TaskRecord, now: Micros) -> out.TaskOut:
    """Return a task as lists show it."""
    newest = newest_of(state, task.name)
    return out.TaskOut(
        id=task.id,
        task=task.name,
        bundle=task.bundle,
        version=task.version,
        newest=newest.n if newest is not None else task.version,
        status=task.status,
        held=list(task.held),
        orders=[standing_out(state, state.orders[a], now) for a in _machines_of(task) if a in state.orders],
        throttled=throttled(state, task, now) is not None,
        section=task.section,
        priority=task.priority,
        by=task.by,
        parent=task.parent,
        children=list(task.children),
        run=task.run,
        outcome="" if task.again else task.outcome,
        code=task.code,
        reason=task.reason,
        roles={role: list(agents) for role, agents in task.roles.items()},
        agents=list(task.granted),
        unix_millis_submitted=millis(task.submitted_at),
        unix_millis_active=None if task.active_at is None else millis(task.active_at),
        unix_millis_ended=None if task.ended_at is None else millis(task.ended_at),
        duration_s=seconds((task.ended_at if task.ended_at is not None else now) - task.submitted_at),
    )


def _machines_of(task: TaskRecord) -> list[str]:
    return list(dict.fromkeys(agent for group in task.roles.values() for agent in group))


def task_detail(
    state: EngineState,
    task: TaskRecord,
    rows: Iterable[ActionRow],
    lines: Iterable[NoticeLine],
    now: Micros,
    places: StepPlaces | None,
) -> out.TaskDetail:
    """Return everything about a task; `rows` are its actions, `lines` its notices."""
    failure = task.failure
    nodes = []
    for key in running_leaves(state.memory.get(task.id, {})):
        step = places.of(key) if places is not None else None
        mark = f"{step.mark.file}:{step.mark.line}" if step is not None else ""
        nodes.append(out.NodeOut(node=key, title=title(step) if step is not None else "", place=mark))
    return out.TaskDetail(
        **task_out(state, task, now).model_dump(),
        failure=None
        if failure is None
        else out.FailureOut(
            code=failure.code,
            reason=failure.reason,
            step=failure.step,
            place=places.place(failure.step) if places is not None else failure.step,
            agent=failure.agent,
        ),
        notes=list(task.notes),
        running=nodes,
        goals=[goal_out(goal, now) for goal in state.goals.values() if goal.task == task.id and not goal.ended],
        questions=[q.number for q in state.questions.values() if q.task == task.id and q.reply is None],
        actions=[_action_out(row, now) for row in rows],
        lines=[line_out(line) for line in lines],
    )


def _action_out(row: ActionRow, now: Micros) -> out.ActionOut:
    is_answer = row.state == "answered"  # the ledger keeps what was answered as the code
    return out.ActionOut(
        agent=row.agent,
        action=row.action,
        state="succeeded" if is_answer else row.state,
        code="" if is_answer else row.code,
        unix_millis_start=millis(row.start),
        unix_millis_end=None if row.end is None else millis(row.end),
        duration_s=seconds((now if row.end is None else row.end) - row.start),
    )


def line_out(line: NoticeLine) -> out.LineOut:
    """Return a notice or alarm."""
    return out.LineOut(unix_millis=millis(line.at), severity=line.severity, text=line.text)


def goal_out(goal: GoalRecord, now: Micros) -> out.GoalOut:
    """Return a goal."""
    return out.GoalOut(
        id=goal.id,
        agent=goal.agent,
        action=goal.action,
        state=goal.state,
        code=goal.code,
        text=goal.text or rest_words(goal),
        progress=goal.progress,
        phase=goal.phase,
        since_s=seconds(now - goal.at),
    )


def agent_out(
    state: EngineState, agent: AgentRecord, frame: Frame, desk: Collection[str], now: Micros, catalogue: Catalogue,
    port: str = "",
) -> out.AgentOut:  # fmt: skip
    """Return an agent; `port`: at which it stands."""
    point = None
    if agent.position is not None:
        lat, lng = frame.lat_lng(agent.position)
        where = agent.position
        point = out.PointOut(
            east_m=where.east_m, north_m=where.north_m, up_m=where.up_m, lat=round(lat, 7), lng=round(lng, 7)
        )
    return out.AgentOut(
        id=agent.id,
        type=agent.type,
        human=agent.human,
        pool=agent.pool,
        liveness=agent.liveness,
        control=agent.control,
        landed=agent.landed,
        battery=None if agent.battery is None else round(agent.battery, 1),
        position=point,
        port=port,
        task=agent.task,
        role=agent.role,
        action=agent.action,
        home=agent.home,
        layer_m=agent.layer_m,
        at_desk=agent.id in desk,
        word=agent.word,
        order=standing_out(state, state.orders[agent.id], now) if agent.id in state.orders else None,
        next=ways_on_of(state, agent, catalogue) if agent.id in state.orders else [],
        taken=agent.taken,
        breach=agent.breach,
        on_link_loss=agent.on_link_loss,
        quarantine=agent.quarantine,
        rebooted=stands_rebooted(agent),
        refused=agent.refused or agent.refused_at_rest,
        bad=agent.bad,
    )


def question_out(state: EngineState, question: Question, now: Micros, desk: Collection[str]) -> out.QuestionOut:
    """Return an open question."""
    asked, lapse = question.asked, lapses_at(state, question)
    return out.QuestionOut(
        number=question.number,
        task=question.task,
        kind=question.kind,
        text=question.text,
        note=question.note,
        options=list(question.options),
        asked=list(asked),
        shown=[person for person in asked if f"{question.id}~{person}" in state.goals],
        here=[person for person in asked if person in desk],
        answers={answer.by: answer.answer for answer in question.answers},
        waiting_s=seconds(now - question.asked_at),
        lapses_in_s=None if lapse is None else seconds(max(0, lapse - now)),
        if_no_answer=question.if_no_answer,
    )


def library_task(task: Task) -> LibraryTask:
    """Return a task as the library shows it."""
    return LibraryTask(
        task=task.name,
        aliases=list(task.aliases),
        description=task.description,
        file=task.mark.file,
        bundle=task.bundle,
        params=[
            out.ParamOut(
                name=param.name,
                type=str(param.type),
                required=param.default is None and not param.optional,
                default=param.default.source if param.default is not None else "",
                label=param.label,
                help=param.help,
                aliases=list(param.aliases),
            )
            for param in task.params.values()
        ],
    )
