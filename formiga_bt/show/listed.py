"""How things are listed for people: machines before people, hwd_2 before hwd_10, ports by name; and parameters of tasks."""

import re
from typing import Protocol

from formiga_bt.base.geo import horizontal_m
from formiga_bt.base.machines import MOVING
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.lang.model import Expr, Param, Site
from formiga_bt.safety.gate import AT_PORT_M
from formiga_bt.show.facts import AgentFact, ParamFact


class Listed(Protocol):
    """What a list of agents is ordered by."""

    @property
    def id(self) -> str:
        """Return its id."""
        ...

    @property
    def human(self) -> bool:
        """Return whether it is a person."""
        ...


def natural(name: str) -> tuple[tuple[int, int, str], ...]:
    """Return what names are ordered by so that numbers in them count as numbers: hwd_2 before hwd_10."""
    parts = re.findall(r"[0-9]+|[^0-9]+", name)
    return (*((0, int(part), part) if part.isdigit() else (1, 0, part.lower()) for part in parts), (-1, 0, name))


def listing(agent: Listed) -> tuple[bool, tuple[tuple[int, int, str], ...]]:
    """Return what a list of agents is ordered by: machines first, then people, each by name."""
    return agent.human, natural(agent.id)


def port_of(site: Site, agent: AgentRecord) -> str:
    """Return the name of the port, or of the station, at which a machine stands on the ground, or ""."""
    at = agent.position
    if at is None or agent.mobility not in MOVING or agent.landed != "grounded":
        return ""
    spots = site.ports.values() if agent.flies else site.stations.values()
    near = [(horizontal_m(spot.at, at), spot.name) for spot in spots]
    return min(((away, name) for away, name in near if away <= AT_PORT_M), default=(0.0, ""))[1]


def where_words(agent: AgentFact) -> str:
    """Return where an agent is: `port north`, `station s1`, or metres from the base station; "" = not known, or nowhere."""
    at = agent.at
    if agent.port:
        return f"{'port' if agent.mobility == 'air' else 'station'} {agent.port}"
    if at is None:
        return ""
    return f"{at.east_m:.0f} E {at.north_m:.0f} N" + (f" {at.up_m:.0f} up" if agent.mobility == "air" else "")


def param_fact(param: Param) -> ParamFact:
    """Return a parameter of a task."""

    def source(expr: Expr | None) -> str:
        return expr.source if expr is not None else ""

    return ParamFact(
        name=param.name,
        type=str(param.type),
        required=param.default is None and not param.optional,
        default=source(param.default),
        least=source(param.min),
        most=source(param.max),
        label=param.label,
        help=param.help,
        aliases=param.aliases,
    )
