"""Ways through a checked model: the steps inside a step, the goals it may send, the agents it commands.

Used by the checks that need the steps around a step: `checks`, `contention`, `flight`, `landing`.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Final, assert_never

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model import (
    Ask,
    BreakIf,
    Call,
    Check,
    Do,
    Expr,
    Fail,
    Fallback,
    For,
    Guard,
    If,
    Loop,
    Notify,
    Parallel,
    Release,
    Request,
    Role,
    Sequence,
    Set,
    Step,
    Subtree,
    Switch,
    Task,
    Wait,
    WaitFor,
    WaitUntil,
    WithAgents,
    WithResource,
)

_ITEM: Final = re.compile(r"([A-Za-z]\w*)\[(\d{1,4})\]")
_END: Final = re.compile(r"(first|last)\(\s*([A-Za-z]\w*)\s*\)")

Names = Mapping[str, tuple[str, ...]]
"""Local names of agents -> what they stand for outside: `drone`, `drones`, `drones[0]`."""


def children(step: Step) -> tuple[Step, ...]:
    """Return the steps inside a step, those of a called subtree left out."""
    match step:
        case Sequence():
            return (*step.steps, *step.finally_)
        case Fallback() | Parallel() | Loop() | For() | Guard() | WithAgents() | WithResource():
            return step.steps
        case If():
            return (*step.then, *step.otherwise)
        case Switch():
            return tuple(child for branch in step.branches for child in branch)
        case (
            Do()
            | Ask()
            | Call()
            | Wait()
            | Check()
            | Set()
            | Notify()
            | Fail()
            | WaitUntil()
            | WaitFor()
            | Release()
            | BreakIf()
            | Request()
        ):
            return ()
        case _:
            assert_never(step)


def size(steps: tuple[Step, ...], known: dict[Mark, int]) -> int:
    """Return how many steps these are with those of called subtrees; `known` holds the sizes found so far."""
    total = 0
    for step in steps:
        total += 1 + size(children(step), known)
        if isinstance(step, Call):
            mark = step.subtree.mark
            if mark not in known:
                known[mark] = size(step.subtree.steps, known)
            total += known[mark]
    return total


def steps_once(steps: Iterable[Step]) -> Iterator[Step]:
    """Iterate over steps, what is inside them and what they call, each subtree once: calls may multiply beyond all bounds."""
    seen: set[Mark] = set()
    queue = list(steps)
    while queue:
        step = queue.pop()
        yield step
        queue += children(step)
        if isinstance(step, Call) and step.subtree.mark not in seen:
            seen.add(step.subtree.mark)
            queue += step.subtree.steps


def all_steps(task: Task) -> Iterator[Step]:
    """Iterate over the steps of a task and of the subtrees that it calls, each once."""
    seen: set[Mark] = set()

    def inside(steps: Iterable[Step]) -> Iterator[Step]:
        for step in steps:
            yield step
            yield from inside(children(step))
            if isinstance(step, Call) and step.subtree.mark not in seen:
                seen.add(step.subtree.mark)
                yield from inside(step.subtree.steps)

    for section in (task.steps, task.on_failure, task.on_abort, task.finally_):
        yield from inside(section)


def orders(step: Step, names: Mapping[str, str] | None = None) -> Iterator[tuple[str, Do]]:
    """Iterate over all goals that a step may send, calls included, with the caller's name of the agent ("" if unknown)."""
    if isinstance(step, Do):
        yield (step.who.name if names is None else names.get(step.who.name, "")), step
    elif isinstance(step, Call):
        inner = {}
        for param, arg in step.args.items():
            outer = plain_name(arg)
            inner[param] = outer if names is None else names.get(outer, "")
        for child in step.subtree.steps:
            yield from orders(child, inner)
    else:
        for child in children(step):
            yield from orders(child, names)


def commands(step: Step, names: Names) -> Iterator[tuple[tuple[str, ...], Step]]:
    """Iterate over the agents that a step commands or gives back, each with the step in this body that does it."""
    for agents, at, _ in _addressed(step, names):
        yield agents, at


def begins_anew(step: Step) -> bool:
    """Return whether what is in a step may run more than once: it is tried again, or handed over to other agents."""
    return step.retry is not None or (isinstance(step, WithAgents) and hands_over(step))


def hands_over(block: WithAgents) -> bool:
    """Return whether a block may begin anew with other agents."""
    return any(role.hand_over_at is not None for role in block.roles.values())


def lasting_orders(step: Step) -> Iterator[tuple[str, Do]]:
    """Iterate over the goals that a step may send to agents that it does not hold itself, with the name of one of these.

    Those of a `with_agents` inside it are brought home and given back before it ends: nothing that comes after it has them.
    """
    for agents, _, do in _addressed(step, {}):
        if agents and isinstance(do, Do):
            yield agents[0], do


def _addressed(step: Step, names: Names) -> Iterator[tuple[tuple[str, ...], Step, Step]]:
    """Iterate over agents that a step commands, each with the step in this body that does it, and the one that says so."""
    if isinstance(step, Do | Release):
        yield names.get(step.who.name, (step.who.name,)), step, step
    elif isinstance(step, Call):
        inner = called_with(step, names)
        for child in step.subtree.steps:
            for agents, _, said in _addressed(child, inner):
                yield agents, step, said
    else:
        inside = {**names, **items_of(step, names)} if isinstance(step, For) else names
        if isinstance(step, WithAgents):  # its own agents are nobody else's
            inside = {**names, **dict.fromkeys(step.roles, ())}
        for child in children(step):
            yield from _addressed(child, inside)


def roles_inside(steps: tuple[Step, ...]) -> Iterator[Role]:
    """Iterate over the roles of every `with_agents` among the steps and in what they call."""
    for step in steps:
        if isinstance(step, WithAgents):
            yield from step.roles.values()
        yield from roles_inside(step.subtree.steps if isinstance(step, Call) else children(step))


def claims_inside(steps: tuple[Step, ...]) -> Iterator[WithResource]:
    """Iterate over every `with_resource` among the steps and in what they call."""
    for step in steps:
        if isinstance(step, WithResource):
            yield step
        yield from claims_inside(step.subtree.steps if isinstance(step, Call) else children(step))


def requests_inside(steps: tuple[Step, ...]) -> Iterator[Request]:
    """Iterate over every request of a task among the steps and in what they call."""
    for step in steps:
        if isinstance(step, Request):
            yield step
        yield from requests_inside(step.subtree.steps if isinstance(step, Call) else children(step))


def all_roles(task: Task) -> Iterator[Role]:
    """Iterate over every role of a task: those granted before its first step, and those of its blocks."""
    yield from task.roles.values()
    for steps in (task.steps, task.on_failure, task.on_abort, task.finally_):
        yield from roles_inside(steps)


def called_with(step: Call, names: Names) -> dict[str, tuple[str, ...]]:
    """Return what the agent params of a called subtree stand for."""
    agents = agent_params(step.subtree)
    return {name: standing_for(arg, names) for name, arg in step.args.items() if name in agents}


def items_of(step: For, names: Names) -> dict[str, tuple[str, ...]]:
    """Return what the loop names of a `for` stand for: the lists that they go over."""
    return {name: standing_for(expr, names) for name, expr in step.lists.items()}


def agent_params(subtree: Subtree) -> tuple[str, ...]:
    """Return the params of a subtree that are agents or lists of them."""
    found = []
    for param in subtree.params.values():
        of = param.type.item if param.type.item is not None else param.type
        if of.name in ("agent", "any"):
            found.append(param.name)
    return tuple(found)


def bare(expr: Expr) -> str:
    """Return the source of an expression without `${ }` around it."""
    return expr.source.strip().removeprefix("${").removesuffix("}").strip()


def standing_for(expr: Expr, names: Names) -> tuple[str, ...]:
    """Return the agents that an expression may stand for."""
    name, item = item_name(expr)
    if name:
        outer = names.get(name, (name,))
        return tuple(one + item if "[" not in one else one for one in outer)
    reads = (read.name for read in expr.reads if not read.field)
    return tuple(dict.fromkeys(one for name in reads for one in names.get(name, (name,))))


def plain_name(expr: Expr) -> str:
    """Return the name that an expression is, when it is nothing but a name; else ""."""
    name = expr.reads[0].name if len(expr.reads) == 1 and not expr.reads[0].field else ""
    same = expr.source.strip().removeprefix("${").removesuffix("}").strip() == name
    return name if same and name.isidentifier() else ""


def item_name(expr: Expr) -> tuple[str, str]:
    """Return `("drones", "[0]")` for one item of a list, `("drone", "")` for a name, `("", "")` for anything else."""
    name = plain_name(expr)
    if name:
        return name, ""
    source = bare(expr)
    found = _ITEM.fullmatch(source)
    if found is not None:
        return found[1], f"[{found[2]}]"
    end = _END.fullmatch(source)
    if end is not None:
        return end[2], "[0]" if end[1] == "first" else "[-1]"
    return "", ""


def overlap(one: str, other: str) -> bool:
    """Return whether two agents or lists may be the same: `drones` holds `drones[0]`."""
    whole = "[" not in one or "[" not in other or "[-1]" in (one + other)
    return one == other or (whole and one.partition("[")[0] == other.partition("[")[0])


def conditions(step: Step) -> Iterator[Expr]:
    """Iterate over the conditions that a step itself reads."""
    if step.when is not None:
        yield step.when
    match step:
        case Check() | If() | Guard() | WaitUntil() | BreakIf():
            yield step.cond
        case Loop():
            yield from (cond for cond in (step.cond, step.until) if cond is not None)
        case Do() | Ask():
            yield from (step.expect,) if step.expect is not None else ()
        case _:
            return
