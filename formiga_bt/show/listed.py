"""How things are listed for people: machines before people, hwd_2 before hwd_10, ports by name; and parameters of tasks."""

import re
from typing import Protocol

from formiga_bt.base.geo import horizontal_m
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.lang.model import Expr, Param, Site
from formiga_bt.safety.gate import AT_PORT_M
from formiga_bt.show.facts import ParamFact


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
    """Return the name of the port at which a machine stands on the ground, or ""."""
    at = agent.position
    if at is None or agent.human or agent.landed != "grounded":
        return ""
    near = [(horizontal_m(port.at, at), port.name) for port in site.ports.values()]
    return min(((away, name) for away, name in near if away <= AT_PORT_M), default=(0.0, ""))[1]


def where_words(port: str, east_m: float, north_m: float, up_m: float) -> str:
    """Return where an agent is: `port north`, or metres from the base station."""
    return f"port {port}" if port else f"{east_m:.0f} E {north_m:.0f} N {up_m:.0f} up"


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
