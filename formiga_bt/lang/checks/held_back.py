"""E035, W035: a task requests another one that needs a machine of the kind that it holds itself.

The requested task waits for its machines; what its parent holds it does not get. If the site can never have as many as both
need, it waits in vain (E035). If there are more, two runs of the parent may still wait for what the other one holds (W035).
"""

from collections.abc import Iterator

from formiga_bt.lang.checks.fleet import least, machines_of, most_of
from formiga_bt.lang.model import Call, Catalogue, Release, Request, Role, Site, Step, Task, WithAgents
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.walk import children

_HELP = "release it before, or let the other task have it: wait: false with detached: true"

Held = dict[str, Role]


def check_requests(task: Task, catalogue: Catalogue, site: Site | None, problems: Problems) -> None:
    """Report E035 and W035 for the requests of a task, those of called subtrees included."""
    for step, held in _requests(task.steps, dict(task.roles), None):
        if not step[1].wait and step[1].detached:
            continue
        _check(step, list(held.values()), catalogue, site, problems)


Asked = tuple[Step, Request]
"""Where to report: the request, or the call that leads to it; and the request."""


def _requests(steps: tuple[Step, ...], held: Held, call: Step | None) -> Iterator[tuple[Asked, Held]]:
    """Iterate over requests with what the task holds there; what may have been released counts as released."""
    for step in steps:
        match step:
            case Request():
                yield (call or step, step), dict(held)
            case Release():
                held.pop(step.who.name, None)
            case Call():
                yield from _requests(step.subtree.steps, held, call or step)
            case WithAgents():
                yield from _requests(step.steps, {**held, **step.roles}, call)
            case _:
                yield from _requests(children(step), held, call)


def _check(asked: Asked, held: list[Role], catalogue: Catalogue, site: Site | None, problems: Problems) -> None:
    at, request = asked
    for role in request.needs:
        names = machines_of(role, catalogue)
        mine = [one for one in held if (has := machines_of(one, catalogue)) and has <= names]
        if not mine or not names:
            continue
        kind = " or ".join(role.types)
        holds = f"{' and '.join(repr(one.name) for one in mine)} hold{'s' if len(mine) == 1 else ''}"
        most = most_of(names, catalogue, site) if site is not None and site.agents else None
        wanted = sum(least(one) for one in request.needs if (has := machines_of(one, catalogue)) and has <= names)
        if most is not None and site is not None and sum(map(least, mine)) + wanted > most:
            what = f"{request.task} waits for {wanted} {kind} while {holds} {sum(map(least, mine))}"
            what += f": site {site.name} has {most}"
            problems.add("E035", at.mark, what, _HELP)
            return
        if request.wait and any(names <= machines_of(one, catalogue) for one in mine):
            what = f"{request.task} waits for {wanted} {kind} while {holds} {sum(map(least, mine))}: possible deadlock"
            problems.add("W035", at.mark, what, _HELP)
            return
