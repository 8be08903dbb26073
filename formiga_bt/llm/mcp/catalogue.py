"""Lists for an assistant: the fleet of the site, the actions of the catalogue, the tasks that are there."""

from collections.abc import Mapping

from msgspec.structs import replace

from formiga_bt.base.units import format_quantity
from formiga_bt.lang.model import Catalogue, Expr, FieldSpec, Param, Role, Task
from formiga_bt.lang.types import Type
from formiga_bt.llm.mcp.ground import ServedSite
from formiga_bt.llm.mcp.outside import NOTICE, all_cleaned
from formiga_bt.llm.mcp.records import ActionsOut, CatalogueAction, ListedAgent, ListedAgents, OfferedTask, OfferedTasks
from formiga_bt.show.facts import AgentFact, ParamFact
from formiga_bt.show.listed import natural, param_fact


def agents(ground: ServedSite, engine: str, live: Mapping[str, AgentFact]) -> ListedAgents:
    """Return the site's fleet; what is heard of each now, if an engine runs."""
    site, types = ground.site, ground.catalogue.types
    running = engine == "running"
    found = {}
    for one in site.agents.values():
        human = one.type in types and types[one.type].human
        found[one.id] = ListedAgent(one.id, one.type, "person" if human else "machine", one.home)
    for fact in live.values():
        listed = found.setdefault(fact.id, ListedAgent(fact.id, fact.type, "person" if fact.human else "machine"))
        listed.home, listed.now = fact.home or listed.home, fact
    if running:
        for one_id, agent in found.items():
            agent.here = one_id in live
    told = ListedAgents(
        site=site.name,
        mode=site.mode,
        engine=engine,
        agents=sorted(found.values(), key=lambda one: (one.kind == "person", natural(one.id))),
        places=sorted(site.places),
        regions=sorted(site.regions),
        people={role: list(ids) for role, ids in site.people.items()},
        notice=NOTICE if running else "",
    )
    return all_cleaned(told)


def actions(catalogue: Catalogue, agent_type: str = "") -> ActionsOut:
    """Return the actions that a task may order, of one type or of all."""
    by_type = {
        name: {
            action
            for one in (name, *type_.extends)
            if one in catalogue.types
            for action in catalogue.types[one].actions
        }
        for name, type_ in catalogue.types.items()
    }
    wanted = by_type.get(agent_type, set()) if agent_type else set(catalogue.actions)
    found = [
        CatalogueAction(
            name=spec.name,
            help=spec.help,
            agent_types=[name for name, has in by_type.items() if spec.name in has],
            fields=[_field(one) for one in spec.fields.values()],
            result={name: str(type_) for name, type_ in spec.result.items()},
            requires=spec.requires,
            leaves=spec.effect,
        )
        for spec in catalogue.actions.values()
        if spec.name in wanted and not spec.cuts
    ]
    return ActionsOut(found, {name: list(type_.extends) for name, type_ in catalogue.types.items()})


def _field(spec: FieldSpec) -> ParamFact:
    return ParamFact(
        name=spec.name,
        type=str(spec.type),
        required=spec.default is None and not spec.optional,
        default=_source(spec.default),
        least=_amount(spec.type, spec.min),
        most=_amount(spec.type, spec.max),
        help=spec.help,
    )


def _amount(of: Type, value: float | None) -> str:
    if value is None:
        return ""
    try:
        return format_quantity(of.name, value)
    except (KeyError, ValueError):
        return f"{value:g}"


def _source(expr: Expr | None) -> str:
    return expr.source if expr is not None else ""


def tasks(ground: ServedSite, find: str = "") -> OfferedTasks:
    """Return the tasks that can be requested; those with errors are left out."""
    found = []
    for path in dict.fromkeys(ground.tasks.values()):
        task = ground.load(ground.read(path), str(path), path.parent).task
        if task is None or find.lower() not in f"{task.name} {' '.join(task.aliases)} {task.description}".lower():
            continue
        own = ground.own is not None and path.is_relative_to(ground.roots[0])
        found.append(_task(task, own=own))
    return OfferedTasks(found)


def _task(task: Task, *, own: bool) -> OfferedTask:
    return OfferedTask(
        task=task.name,
        description=task.description,
        params=[_param(one) for one in task.params.values()],
        roles={role.name: _role(role) for role in task.roles.values()},
        aliases=list(task.aliases),
        own=own,
    )


def _param(one: Param) -> ParamFact:
    fact = param_fact(one)
    return replace(fact, help=fact.help or fact.label)


def _role(role: Role) -> str:
    many = f"{role.count} " if role.count is not None else "some " if role.open is not None else ""
    return many + " or ".join(role.types)
