"""E035: hold-and-wait on one pool, so that two holders may wait for one another.

Inside a task: a `with_agents` within another one that asks for the same kind of machine, in two branches at once or by itself
(two runs of the task may meet). Between tasks: each holds what another one waits for in mid-task. The roles of `agents` are
granted all together, so they wait for nobody while they hold; only `with_agents` does. Every wait ends after the role's
`wait`; but then a step fails that need not have failed.
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import PurePath

from msgspec import Struct

from formiga_bt.base.diagnostics import Diagnostic, Mark
from formiga_bt.lang.checks.resources import check_orders
from formiga_bt.lang.model import Call, Catalogue, Parallel, Role, Step, Task, WithAgents
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import children

_HELP = "ask for both together, in one with_agents or in agents: they are granted all or none"


class RoleWait(Struct, frozen=True):
    """A role that is waited for while another one is held."""

    task: str
    held: Role
    wanted: Role
    at: Mark
    """Where to report it: the wanted role, or the call that leads to it."""

    @property
    def common(self) -> str:
        """Return the machine that both may be; "" = they are of different pools."""
        return _common(self.held, self.wanted)


def check_blocks(steps: tuple[Step, ...], catalogue: Catalogue, problems: Problems) -> None:
    """Report E035 for blocks inside blocks of a body, calls included; for two branches of a parallel once together."""
    told: set[Mark] = set()
    _look_for_branches(steps, catalogue, problems, told)
    for wait in _waits(steps, (), "", None, catalogue):
        if wait.common and wait.at not in told:
            told.add(wait.at)
            holder = f"'{wait.held.name}' ({wait.held.mark.said})"
            what = f"'{wait.wanted.name}' waits for {_a(wait.common)} while {holder} holds one: possible deadlock"
            problems.add("E035", wait.at, what, _HELP)


def _look_for_branches(steps: tuple[Step, ...], catalogue: Catalogue, problems: Problems, told: set[Mark]) -> None:
    for step in steps:
        with problems.within(step.title):
            if isinstance(step, Parallel):
                _check_branches(step, catalogue, problems, told)
            _look_for_branches(children(step), catalogue, problems, told)


def _check_branches(step: Parallel, catalogue: Catalogue, problems: Problems, told: set[Mark]) -> None:
    before: list[tuple[int, RoleWait]] = []
    for number, branch in enumerate(step.steps, 1):
        mine = list(_waits((branch,), (), "", None, catalogue))
        for wait in mine:
            for first, other in before:
                if not (_common(wait.held, other.wanted) and _common(other.held, wait.wanted)) or wait.at in told:
                    continue
                told |= {wait.at, other.at}
                where = f"(lines {other.wanted.mark.line} and {wait.wanted.mark.line})"
                if wait.common and other.common:
                    what = f"branches {first} and {number} each hold {_a(wait.common)} and wait for another {where}"
                else:
                    what = (
                        f"branch {first} holds {_a(_common(other.held, wait.wanted))} and waits for "
                        f"{_a(_common(wait.held, other.wanted))}, branch {number} the reverse {where}"
                    )
                problems.add("E035", wait.at, f"{what}: possible deadlock", _HELP)
        before += [(number, wait) for wait in mine]


def check_tasks(tasks: Sequence[Task], catalogue: Catalogue) -> list[Diagnostic]:
    """Return E035 for each circle of different tasks in which each holds what the next one waits for in mid-task.

    Of resources, which are fixed names, it is E113.
    """
    waits = [wait for task in tasks for wait in _of_task(task, catalogue)]
    found: list[Diagnostic] = []
    told: set[frozenset[str]] = set()
    for wait in waits:
        for circle in _circles([wait], waits):
            names = frozenset(one.task for one in circle)
            if names in told:
                continue
            told.add(names)
            found.append(Diagnostic("E035", wait.at, _told(circle), _HELP, wait.task))
    return [*found, *check_orders(tasks)]


def _circles(chain: list[RoleWait], waits: Sequence[RoleWait]) -> Iterator[list[RoleWait]]:
    """Iterate over the circles that begin with a chain, each task at most once, the shortest first."""
    if len(chain) > 1 and _common(chain[0].held, chain[-1].wanted):
        yield chain
        return
    if len(chain) >= 4:  # longer ones have never been seen, and cost too much to look for
        return
    for wait in waits:
        if all(wait.task != one.task for one in chain) and _common(wait.held, chain[-1].wanted):
            yield from _circles([*chain, wait], waits)


def _told(circle: list[RoleWait]) -> str:
    parts = []
    for one in circle:
        holds, wants = f"'{one.held.name}'", f"'{one.wanted.name}'"
        place = f"{PurePath(one.wanted.mark.file).name}:{one.wanted.mark.line}"
        types = " or ".join(one.held.types[:1]), " or ".join(one.wanted.types[:1])
        parts.append(f"{one.task} holds {_a(types[0])} ({holds}) and waits for {_a(types[1])} ({wants}, {place})")
    return "; ".join(parts) + ": possible deadlock"


def _of_task(task: Task, catalogue: Catalogue) -> Iterator[RoleWait]:
    held = tuple(role for role in task.roles.values() if _is_scarce(role, catalogue))
    yield from _waits(task.steps, held, task.name, None, catalogue)


def _waits(
    steps: Iterable[Step],
    held: tuple[Role, ...],
    task: str,
    call: Mark | None,
    catalogue: Catalogue,
    outside: int | None = None,
) -> Iterator[RoleWait]:
    """Iterate over what the steps wait for while they hold something.

    `outside`: in a called subtree, how many of those held are the caller's: what is between its own roles, it tells itself.
    """
    for step in steps:
        if isinstance(step, Call):
            seen = outside if outside is not None or task else len(held)
            yield from _waits(step.subtree.steps, held, task, call or step.mark, catalogue, seen)
        elif isinstance(step, WithAgents):
            mine = [role for role in step.roles.values() if _is_scarce(role, catalogue)]
            for role in mine:
                for other in held[:outside]:
                    yield RoleWait(task, other, role, call or role.mark)
            inside = (*held, *mine)
            yield from _waits(step.steps, inside, task, call, catalogue, outside)
        else:
            yield from _waits(children(step), held, task, call, catalogue, outside)


def _is_scarce(role: Role, catalogue: Catalogue) -> bool:
    """Return whether a role is of machines that only one task at a time can have."""
    known = [catalogue.types[name] for name in role.types if name in catalogue.types]
    return any(not one.human and not one.shared for one in known)


def _common(one: Role, other: Role) -> str:
    return next((name for name in one.types if name in other.types), "")


def _a(noun: str) -> str:
    return f"an {noun}" if noun[:1] in "aeiol" or noun.startswith("hw") else f"a {noun}"
