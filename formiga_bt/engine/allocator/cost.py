"""What choosing an agent costs, in metres: how far it is, and how little charge the job leaves it.

`far`, the paper's: the way over ground to the role's place; 0 without one.

`far_and_low`: that, and `M_PER_POINT` for each point of charge that it is short of a comfortable margin:

    left  = battery - its reserve - the way to the place and home again
    short = COMFORT_PCT - left, in whole points, at least 0
    cost  = metres to the place + M_PER_POINT * short

So it is the closest one among those that the job leaves `COMFORT_PCT` over their reserve; one that keeps less must be nearer by
`M_PER_POINT` metres a point. Where a role names no place the job may be anywhere: `ANYWHERE_PCT` stands for the way.
"""

from collections.abc import Callable
from typing import Final, NamedTuple

from formiga_bt.base.geo import Place, horizontal_m, mm
from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.energy import round_trip_pct
from formiga_bt.engine.kernel.records import RoleRequest

PREFERRED: Final = -1e6
"""Metres, of the preferred agent: it wins if it fits."""

BY_HAND: Final = 10 * PREFERRED
"""Metres, of an agent that a person gave to the role: it wins before all others."""

UNREACHABLE: Final = 1e5
"""Metres, of a person who cannot be reached now: reachable ones come first."""

COMFORT_PCT: Final = 30.0
"""So many points over its reserve are enough after a job: more is not better."""

ANYWHERE_PCT: Final = 30.0
"""Points for the way of a job whose place is not known."""

M_PER_POINT: Final = 100.0
"""Metres that count as much as one point of charge short of the margin: about what a drone flies with one."""

MOST_SHORT_PCT: Final = 1000.0
"""More is not counted: against a wind that is too strong a way takes for ever."""


class Cost(NamedTuple):
    """What choosing an agent costs."""

    metres: float
    """All of it."""
    short: int = 0
    """Points of charge short of a comfortable margin; counted in `metres`."""


CostOf = Callable[[Candidate, RoleRequest, int], Cost]
"""The cost of an agent for a role's place of this number."""


def far(agent: Candidate, role: RoleRequest, index: int) -> Cost:
    """Return what the way costs."""
    metres = 0.0
    if role.near and agent.position is not None and not role.id:
        metres = mm(horizontal_m(agent.position, _place(role, index)))
    if role.prefer and agent.id == role.prefer:
        metres += PREFERRED
    if agent.id in role.by_hand:
        metres += BY_HAND
    if agent.shared and agent.liveness != "ALIVE":
        metres += UNREACHABLE
    return Cost(metres)


def far_and_low(agent: Candidate, role: RoleRequest, index: int) -> Cost:
    """Return what the way and the charge cost; people have none."""
    way = far(agent, role, index).metres
    if agent.shared or role.id:
        return Cost(way)
    short = round(min(max(0.0, COMFORT_PCT - left_pct(agent, role, index)), MOST_SHORT_PCT))
    return Cost(way + M_PER_POINT * short, short)


def left_pct(agent: Candidate, role: RoleRequest, index: int) -> float:
    """Return the points of charge over its reserve that an agent is thought to have after a role's job; may be below 0.

    Of a machine whose drain is not known nothing is counted for a way that is.
    """
    charge = agent.charge
    left = agent.battery - (charge.reserve if charge is not None else 0.0)
    if not role.near:
        return left - ANYWHERE_PCT
    return left if charge is None else left - round_trip_pct(charge, _place(role, index))


def in_words(agent: Candidate, role: RoleRequest, cost: Cost) -> str:
    """Return the numbers of an agent that is short of a comfortable margin; "" of any other."""
    if not cost.short:
        return ""
    left = COMFORT_PCT - cost.short
    to = "the way there and home" if role.near else f"{ANYWHERE_PCT:.0f} % for a job anywhere"
    over = f"{left:.0f} % over its reserve" if left >= 0.0 else f"{-left:.0f} % too little for its reserve"
    return f"{agent.battery:.0f} %, after {to} {over}"


def _place(role: RoleRequest, index: int) -> Place:
    place: Place = role.near[index] if index < len(role.near) else role.near[0]
    return place
