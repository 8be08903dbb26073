"""Why a task waits, is held, chose its agents or failed: a chain of lines with codes, in plain words.

Pure functions over the view's copy of the state. The codes are the engine's; the words are in `words.py`.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence

from formiga_bt.clock import Micros
from formiga_bt.engine.allocator.policy import UNREACHABLE
from formiga_bt.engine.records import PRIORITIES, GoalRecord, Question, Request, RoleRequest, TaskRecord, Verdict
from formiga_bt.engine.state import EngineState
from formiga_bt.lang.model import Catalogue
from formiga_bt.nodes.memory import WaitMem
from formiga_bt.services.because import Because, Silence
from formiga_bt.services.places import StepPlaces, running_leaves, title
from formiga_bt.services.why_aside import detail, earlier_runs, making_room
from formiga_bt.services.why_stopped import locked, stopped
from formiga_bt.services.words import BLOCKED, BLOCKED_HINTS, GATE, REASONS, REPEATS, VERDICT_HINTS, VERDICTS, say, span

OTHER_ROLE = frozenset({"wrong_type", "not_this_one"})
"""Refusals that say nothing about the agent; left out where others remain."""


def why(
    state: EngineState,
    task: TaskRecord,
    now: Micros,
    places: StepPlaces | None,
    silences: Mapping[str, Silence] | None = None,
    desk: Collection[str] = (),
    catalogue: Catalogue | None = None,
) -> list[Because]:
    """Return the chain of a task, most important first.

    `silences` are the agents that are not heard of, `desk` the people who answer at the engine; `catalogue` tells what an
    interrupted action requires.
    """
    if task.status == "PENDING":
        return [*locked(state, now), *_waiting(state, task, now), *_requested(task), *earlier_runs(task)]
    over = task.section == "done"
    lines = [*_outcome(task, places)] if task.outcome and (over or not task.again) else []
    if not over:
        lines += stopped(state, task, now, catalogue, places.task if places is not None else None)
        lines += _silent(state, task, silences or {})
        lines += _running(state, task, now, places, desk)
    return [*lines, *_chosen(state, task), *_requested(task), *earlier_runs(task)]


def _requested(task: TaskRecord) -> Iterator[Because]:
    if task.parent:
        ends = "outlives it" if task.detached else "ends with it"
        yield Because("parent", f"{task.parent} requested it, and it {ends}", f"formiga why {task.parent}")


# -- waiting for agents ------------------------------------------------------------------------------------------------
def _waiting(state: EngineState, task: TaskRecord, now: Micros) -> Iterator[Because]:
    request = state.requests.get(task.id)
    waited = span(now - task.submitted_at)
    if request is None:
        yield Because("pending", f"it was requested {waited} ago and is about to start")
        return
    yield Because("pending", f"it waits for agents since {waited}; all of its roles are granted together")
    ahead = [r for r in state.requests.values() if _rank(r) < _rank(request)]
    if ahead:
        names = ", ".join(r.task for r in sorted(ahead, key=_rank)[:3]) + (" ..." if len(ahead) > 3 else "")
        yield Because("queue", f"{len(ahead)} of the same or a higher priority wait before it ({names})")
    yield from _asked(state, request, now)


def _asked(state: EngineState, request: Request, now: Micros) -> Iterator[Because]:
    """Tell how a request stands: its roles, who steps aside for it, and when it gives up."""
    verdicts = state.explanations.get(request.task)
    if verdicts is None:
        yield Because("not_looked", "the allocator has not looked at it yet")
        return
    for verdict in verdicts:
        if not verdict.role and verdict.code != "lockdown":
            yield Because(
                verdict.code, say(BLOCKED, verdict.code, detail=verdict.detail), BLOCKED_HINTS.get(verdict.code, "")
            )
    for role in request.roles:
        yield from _role(role, [v for v in verdicts if v.role == role.role])
    yield from making_room(request)
    waits = [role.wait_until for role in request.roles if role.wait_until is not None]
    if waits and request.wait_left is None:
        yield Because("no_agent", f"it gives up in {span(min(waits) - now)} (the roles' `wait`)")
    if request.expires is not None:
        yield Because("task_expired", f"it expires in {span(request.expires - now)}")


def _rank(request: Request) -> tuple[int, int]:
    return PRIORITIES[request.priority], request.order


def _role(role: RoleRequest, verdicts: Sequence[Verdict]) -> Iterator[Because]:
    fit = [v.agent for v in verdicts if v.code in ("fits", "chosen")]
    least = "at least " if role.more else ""
    need = f"{least}{role.count} of " if role.count > 1 else ""
    if len(fit) >= role.count:
        yield Because("role_ready", f"{role.role}: {', '.join(fit)} could do it", role=role.role)
        return
    types = "/".join(role.types) or "any type"
    yield Because("role_open", f"{role.role}: no {need}{types} that fits is free", role=role.role)
    telling = [v for v in verdicts if v.code not in OTHER_ROLE]
    if not telling:
        what = f"'{role.id}'" if role.id else types
        hint = "is it running, and connected to this engine? formiga agents"
        yield Because("no_such_agent", f"no agent {what} is known to this engine", hint, role=role.role)
    for verdict in telling:
        text = f"{verdict.agent} {say(VERDICTS, verdict.code, detail=detail(verdict))}"
        hint = VERDICT_HINTS.get(verdict.code, "").format(agent=verdict.agent)
        yield Because(verdict.code, text, hint, verdict.agent, role.role)


# -- running -----------------------------------------------------------------------------------------------------------
def _running(
    state: EngineState, task: TaskRecord, now: Micros, places: StepPlaces | None, desk: Collection[str]
) -> Iterator[Because]:
    mine = [goal for goal in state.goals.values() if goal.task == task.id and goal.action != "Confirm"]
    for goal in mine:
        if goal.state == "gated" or goal.in_flight:
            yield goal_line(goal, now)
    for child in [state.tasks[one] for one in task.children if not state.tasks[one].ended]:
        words = " HELD" if child.held else ""
        words += ", which outlives it" if child.detached else ""
        yield Because("child", f"its task {child.id} is {child.status}{words}", f"formiga why {child.id}")
    for request in state.requests.values():
        if request.node and request.holder == task.id:
            since = span(now - request.at)
            yield Because("wants", f"{place(request.node, places)} waits for its agents since {since}")
            yield from _asked(state, request, now)
    for question in state.questions.values():
        if question.task == task.id and question.reply is None:
            yield _question(state, question, now, desk)
    memory = state.memory.get(task.id, {})
    for key in running_leaves(memory):
        mem = memory[key]
        if isinstance(mem, WaitMem):
            yield Because("waits", f"{place(key, places)} waits since {span(now - mem.since)}")
    if task.section in ("on_failure", "on_abort", "finally", "recover") and not task.outcome:
        yield Because("section", f"it is in its section {task.section}")
    if task.section == "recover":
        home = [f"{r.agent} ({r.state})" for r in task.recovering]
        yield Because("recover", f"its machines are brought home: {', '.join(home) or 'none left'}")


def goal_line(goal: GoalRecord, now: Micros) -> Because:
    """Return what a goal waits for at the gate, or what it does."""
    if goal.state != "gated":
        return Because(f"goal.{goal.state}", _flight(goal, now), agent=goal.agent)
    code = "control:handback" if (goal.code, goal.text) == ("control", "handback") else goal.code
    words = say(GATE, code, text=goal.text or "another machine", agent=goal.agent)
    return Because(f"gate.{goal.code or 'open'}", f"{goal.agent}.{goal.action} {words}", agent=goal.agent)


def _silent(state: EngineState, task: TaskRecord, silences: Mapping[str, Silence]) -> Iterator[Because]:
    """Tell of the task's agents that are not heard of."""
    mine = [goal.agent for goal in state.goals.values() if goal.task == task.id and not goal.ended]
    mine += [agent.id for agent in state.agents.values() if agent.task == task.id]
    for agent in dict.fromkeys([*mine, *task.granted]):
        silence = silences.get(agent)
        if silence is None:
            continue
        text = f"{agent} has not been heard of for {span(silence.since)}"
        lost = state.agents[agent].liveness == "LOST"
        if lost:
            text += "; it counts as lost"
        elif silence.lost_after is not None:
            text += f"; it counts as lost after {span(silence.lost_after)}"
        hint = "is its process running, and connected to this engine? formiga agents"
        yield Because("lost" if lost else "suspect", text, hint, agent)


def _flight(goal: GoalRecord, now: Micros) -> str:
    since = span(now - (goal.sent_at if goal.sent_at is not None else goal.at))
    more = [goal.phase] if goal.phase else []
    if goal.progress is not None:
        more.append(f"{goal.progress * 100:.0f} %" if goal.progress <= 1 else f"{goal.progress:.0f} %")
    tail = f" ({', '.join(more)})" if more else ""
    return f"{goal.agent} does {goal.action} since {since}{tail}"


def _question(state: EngineState, question: Question, now: Micros, desk: Collection[str]) -> Because:
    shown = [p for p in question.asked if f"{question.id}~{p}" in state.goals]
    who = ", ".join(question.asked) or "nobody"
    queued = "" if shown else "; it is not shown to anyone yet"
    end = f"; lapses in {span(question.expires_at - now)}" if question.expires_at is not None else ""
    text = f"{question.number} waits for an answer of {who} since {span(now - question.asked_at)}{queued}{end}"
    here = [p for p in question.asked if p in desk and not any(answer.by == p for answer in question.answers)]
    hint = f"formiga answer {question.number} {'|'.join(question.options)}" if here else ""
    if len(here) > 1:
        hint += f" --by {here[0]}"
    return Because("question", f"{text}: {question.text}", hint)


# -- ended -------------------------------------------------------------------------------------------------------------
def _outcome(task: TaskRecord, places: StepPlaces | None) -> Iterator[Because]:
    if task.outcome == "SUCCEEDED":
        yield Because("succeeded", "it succeeded" if task.section == "done" else "its steps succeeded")
    else:
        words = say(REASONS, task.code)
        reason = f": {task.reason}" if task.reason and task.reason not in REPEATS else ""
        yield Because(task.code or "ended", f"{task.outcome} ({task.code}): {words}{reason}")
    failure = task.failure
    if failure is not None and failure.step:
        agent = f" with {failure.agent}" if failure.agent else ""
        yield Because("where", f"first failed: {place(failure.step, places)}{agent}", agent=failure.agent)
    for note in task.notes:
        yield Because("note", f"while it cleaned up: {note}")


def _chosen(state: EngineState, task: TaskRecord) -> Iterator[Because]:
    verdicts = state.explanations.get(task.id, ())
    for role in dict.fromkeys(v.role for v in verdicts if v.role):
        of_role = [v for v in verdicts if v.role == role]
        chosen = [v for v in of_role if v.code == "chosen"]
        others = [v for v in of_role if v.code == "fits"]
        if not chosen:
            if task.status != "SUCCEEDED":
                for v in of_role:
                    if v.code not in OTHER_ROLE:
                        yield Because(
                            v.code, f"{role}: {v.agent} {say(VERDICTS, v.code, detail=detail(v))}", "", v.agent
                        )
            continue
        names = ", ".join(_with_cost(state, v) for v in chosen)
        rest = f"; others that fitted: {', '.join(_with_cost(state, v) for v in others)}" if others else ""
        yield Because("chosen", f"{role} = {names}{rest}", role=role)


def _with_cost(state: EngineState, verdict: Verdict) -> str:
    if verdict.cost is None or verdict.cost == 0.0:
        return verdict.agent
    if verdict.cost < 0.0:
        return f"{verdict.agent} (preferred)"
    agent = state.agents.get(verdict.agent)
    if agent is not None and agent.human and verdict.cost >= UNREACHABLE:
        return f"{verdict.agent} (unreachable then)"
    metres = verdict.cost
    return f"{verdict.agent} ({metres:.0f} m)" if metres < 10_000 else f"{verdict.agent} ({metres / 1000:.0f} km)"


def place(key: str, places: StepPlaces | None) -> str:
    """Return what people call the node with this key, and where it stands."""
    step = places.of(key) if places is not None else None
    return f"{title(step)} at {step.mark.file}:{step.mark.line}" if step is not None else key
