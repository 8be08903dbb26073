"""The front: explain a task or an agent, and print an explanation."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

from msgspec.structs import replace

from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.library import newest_of
from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.model import Catalogue, Task
from formiga_bt.lang.model.rules import RULE_PREFIX
from formiga_bt.show.facts import ActionFact, Because
from formiga_bt.show.why.aside import earlier_runs
from formiga_bt.show.why.chosen import chosen
from formiga_bt.show.why.ended import outcome
from formiga_bt.show.why.goals import silent
from formiga_bt.show.why.machine import why_machine
from formiga_bt.show.why.near import nearest, shortened
from formiga_bt.show.why.rules import headline, requested_by_rule, why_rule
from formiga_bt.show.why.running import running
from formiga_bt.show.why.scene import WhyScene
from formiga_bt.show.why.stopped import away, locked, stopped
from formiga_bt.show.why.waiting import waiting


def explain(
    state: EngineState,
    models: Mapping[str, Task],
    of: str,
    now: Micros,
    *,
    catalogue: Catalogue | None = None,
    wall: Micros = 0,
    desk: Collection[str] = (),
    actions: Sequence[ActionFact] = (),
) -> tuple[str, list[Because]]:
    """Return how a task, an agent or a rule (`rule:sos`) stands (`PickUp-3 ACTIVE HELD`), and the causes, most important first.

    Args:
        state: of the engine.
        models: the checked tasks by name; an unknown one is explained without its file's lines.
        of: id of the task or agent, or `rule:NAME`.
        now: engine time.
        catalogue: as `WhyScene`.
        wall: as `WhyScene`.
        desk: as `WhyScene`.
        actions: as `WhyScene`.

    Raises:
        TaskError: `unknown_task`; the text proposes ids that look alike.
    """
    scene = WhyScene(state, now, models, catalogue, wall, desk, actions)
    task = state.tasks.get(of)
    if task is not None:
        return f"{task.id} {task.status}" + (" HELD" if task.hold.causes else ""), _not_itself(
            of, why_task(scene, task)
        )
    agent = state.agents.get(of)
    if agent is not None:
        return f"{agent.id} {agent.pool}", _not_itself(of, why_machine(scene, agent))
    rule = state.rules.get(of.removeprefix(RULE_PREFIX)) if of.startswith(RULE_PREFIX) else None
    if rule is not None:
        return headline(scene, rule), _not_itself(of, why_rule(scene, rule))
    rules = [f"{RULE_PREFIX}{name}" for name in state.rules]
    raise unknown(of, [*state.tasks, *state.agents, *rules], "task, agent or rule" if rules else "task or agent")


def _not_itself(of: str, lines: Sequence[Because]) -> list[Because]:
    """Return an explanation without the hint to ask for this very explanation."""
    found = []
    for line in lines:
        hints = [hint for hint in line.hint.split(" | ") if hint != f"formiga why {of}"]
        found.append(replace(line, hint=" | ".join(hints)))
    return found


def unknown(of: str, known: Iterable[str], kind: str = "task", code: str = "unknown_task") -> TaskError:
    """Return the error for an id of a kind that is not there, with those that look alike."""
    return TaskError(code, f"there is no {kind} '{shortened(of)}' (any more)", near=nearest(of, list(known)))


def why_task(scene: WhyScene, task: TaskRecord) -> list[Because]:
    """Return the chain of a task."""
    if task.status == "PENDING":
        return [
            *away(scene),
            *locked(scene),
            *waiting(scene, task),
            *_older(scene, task),
            *_requested(task),
            *requested_by_rule(scene, task),
            *earlier_runs(task),
        ]
    over = task.section == "done"
    lines = [*outcome(scene, task)] if task.outcome.status and (over or not task.restart.why) else []
    if not over:
        lines += [*away(scene), *stopped(scene, task)]
        lines += silent(scene, _agents_of(scene, task))
        lines += running(scene, task)
    return [
        *lines,
        *chosen(scene, task),
        *_older(scene, task),
        *_requested(task),
        *requested_by_rule(scene, task),
        *earlier_runs(task),
    ]


def _older(scene: WhyScene, task: TaskRecord) -> Iterator[Because]:
    newest = newest_of(scene.state, task.name)
    if newest is not None and newest.bundle != task.request.bundle and not task.system.agent:
        text = f"it runs version {task.request.version} of {task.name} to its end; new requests get version {newest.n}"
        yield Because("version", text)


def _requested(task: TaskRecord) -> Iterator[Because]:
    if task.family.parent:
        ends = "outlives it" if task.family.detached else "ends with it"
        yield Because(
            "parent", f"{task.family.parent} requested it, and it {ends}", f"formiga why {task.family.parent}"
        )


def _agents_of(scene: WhyScene, task: TaskRecord) -> list[str]:
    """Return the agents that a task depends on now."""
    mine = [goal.agent for goal in scene.state.goals.values() if goal.task == task.id and not goal.ended]
    return [*mine, *(agent.id for agent in scene.state.agents.values() if agent.task == task.id), *task.agents.granted]
