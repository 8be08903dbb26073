"""E025: roles that no agent of the fleet can ever fit.

What an agent can do comes from its type; which agents there can be, from the site. A real site admits those that it lists
only. In a simulation others may join: any number of people, and as many machines as have a free port. A site without agents
says nothing about its fleet. Agents without charge, or busy, may fit later: that is for the allocator.
"""

from collections.abc import Iterable, Mapping

from formiga_bt.lang.model import AgentType, Catalogue, Release, Role, Site, Step, Task, WithAgents
from formiga_bt.lang.text.reading import Problems, quoted_list
from formiga_bt.lang.types import AgentRef
from formiga_bt.lang.walk import all_roles, children


def check_fleet(task: Task, catalogue: Catalogue, site: Site | None, problems: Problems) -> None:
    """Report E025 for each role of a task, and for those of its blocks, that nobody can ever have."""
    told: set[str] = set()
    for role in all_roles(task):
        if not _fits_a_type(role, catalogue, site, problems):
            told.add(role.name)
    if site is not None and site.agents:
        held = [role for role in task.roles.values() if role.name not in told]
        _check_numbers(held, [], catalogue, site, problems)
        for section in (task.steps, task.on_failure, task.on_abort, task.finally_):
            _check_blocks(section, {role.name: role for role in held}, catalogue, site, problems)


def types_that_fit(role: Role, types: Mapping[str, AgentType]) -> list[AgentType]:
    """Return the types of a role and those that extend them."""
    return [one for one in types.values() if one.name in role.types or set(one.extends) & set(role.types)]


def _fits_a_type(role: Role, catalogue: Catalogue, site: Site | None, problems: Problems) -> bool:
    fit = types_that_fit(role, catalogue.types)
    shown = " or ".join(role.types)
    for word in role.capabilities:
        if fit and not any(word in one.actions for one in fit):
            where = "this fleet" if site is not None else "the catalogue"
            offered = list(dict.fromkeys(action for one in fit for action in one.actions))
            what = f"no {shown} in {where} offers '{word}'"
            problems.add("E025", role.mark, what, f"actions: {quoted_list(offered)}")
            return False
    id_ = role.id.const if role.id is not None and role.id.is_const else None
    if site is None or site.mode != "real" or not site.agents or not isinstance(id_, AgentRef) or id_.id in site.agents:
        return True
    known = [agent.id for agent in site.agents.values() if agent.type in {one.name for one in fit}]
    what = f"no agent of site {site.name} is called '{id_.id}'"
    problems.add("E025", role.mark, what, f"agents of type {shown}: {quoted_list(known) or 'none'}")
    return False


def _check_blocks(
    steps: Iterable[Step], held: dict[str, Role], catalogue: Catalogue, site: Site, problems: Problems
) -> None:
    """Look at the blocks among the steps; what may have been released counts as released, and `held` has it no more."""
    for step in steps:
        match step:
            case Release():
                held.pop(step.who.name, None)
            case WithAgents():
                _check_numbers(list(held.values()), list(step.roles.values()), catalogue, site, problems)
                _check_blocks(step.steps, {**held, **step.roles}, catalogue, site, problems)
            case _:
                _check_blocks(children(step), held, catalogue, site, problems)


def _check_numbers(held: list[Role], new: list[Role], catalogue: Catalogue, site: Site, problems: Problems) -> None:
    """Report E025 for the first role (of `new`, if there are any) for which too few agents are left."""
    for role in new or held:
        names = {one.name for one in types_that_fit(role, catalogue.types)}
        most = most_of(names, catalogue, site)
        if most is None:
            continue
        scarce = [one for one in (*held, *new) if _names(one, catalogue) <= names and _is_scarce(one, catalogue)]
        same = scarce if _is_scarce(role, catalogue) else [role]
        if sum(least(one) for one in same) > most:
            shown = " or ".join(role.types)
            others = [one.name for one in same if one is not role]
            beside = f" beside {quoted_list(others)}" if others else ""
            has = f"{most} {shown}" if most else f"no {shown}"
            what = f"'{role.name}' needs {least(role)} {shown}{beside}, site {site.name} has {has}"
            problems.add("E025", role.mark, what, "list the agent in the site file, or ask for fewer")
            return


def _names(role: Role, catalogue: Catalogue) -> set[str]:
    return {one.name for one in types_that_fit(role, catalogue.types)}


def _is_scarce(role: Role, catalogue: Catalogue) -> bool:
    """Return whether each agent of a role can have no other role at the same time."""
    fit = types_that_fit(role, catalogue.types)
    return bool(fit) and not any(one.shared for one in fit)


def machines_of(role: Role, catalogue: Catalogue) -> set[str]:
    """Return the types of a role and those that extend them, if only one task at a time can have such an agent."""
    return _names(role, catalogue) if _is_scarce(role, catalogue) else set()


def least(role: Role) -> int:
    """Return how many agents a role needs at least."""
    return role.open.min if role.open is not None else role.count or 1


def most_of(names: set[str], catalogue: Catalogue, site: Site) -> int | None:
    """Return how many agents of these types there can ever be; None = nobody knows."""
    if not names:
        return None
    listed = sum(agent.type in names for agent in site.agents.values())
    if site.mode == "real":
        return listed
    if not all(catalogue.types[name].flies for name in names):
        return None  # others need no port to join
    homes = {agent.home for agent in site.agents.values()}
    return listed + sum(port not in homes for port in site.ports)
