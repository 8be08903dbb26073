"""Where to land when a machine must come down: the nearest spot that is clear of people and of other machines."""

import math
from collections.abc import Iterator, Sequence
from typing import Final

from formiga_bt.base.geo import Place, horizontal_m
from formiga_bt.safety.airspace import Airspace
from formiga_bt.safety.rules import Rules

MOST_M: Final = 300.0
"""No spot is looked for farther away than this."""
STEP_M: Final = 1.0
"""Distance of the circles that are tried, and about the distance of the spots on them."""
SPARE_M: Final = 0.05
"""So much more than the least distances is kept: positions are rounded."""


def safe_landing_spot(
    here: Place,
    people: Sequence[Place],
    taken: Sequence[Place],
    ground: Airspace,
    rules: Rules,
    reach_m: float,
) -> Place:
    """Return the nearest spot to land: clear of people and of other machines, legal, within reach; else `here`.

    Circle after circle round the machine is tried, a metre apart: what is returned is at most so much farther than need be.

    Args:
        here: where the machine is, over ground.
        people: known people; the spot is at least `rules.people_clearance_m` from each.
        taken: ground spots of other machines; the spot is at least the site's `min_spacing_m` from each.
        ground: fence, no-fly regions and known ground; the way there enters none anew.
        rules: of the machine.
        reach_m: how far it may go over ground (`energy.reach_m`).
    """
    keep = [(at, rules.people_clearance_m) for at in people] + [(at, ground.site.min_spacing_m) for at in taken]
    farthest = min(reach_m, MOST_M) if reach_m > 0.0 else 0.0
    near = [(at, m) for at, m in keep if horizontal_m(at, here) < farthest + m + 2 * SPARE_M]
    for spot in _round(here, farthest):
        spare = 0.0 if spot is here else SPARE_M
        if all(horizontal_m(at, spot) >= metres + spare for at, metres in near) and _is_legal(here, spot, ground):
            return spot
    return here


def _is_legal(here: Place, spot: Place, ground: Airspace) -> bool:
    return ground.is_open(spot) and all(zone.offence(here, spot, rescue=True) is None for zone in ground.zones)


def _round(here: Place, farthest_m: float) -> Iterator[Place]:
    """Iterate over `here` and spots on circles round it, each from the north clockwise."""
    yield here
    for circle in range(1, math.floor(farthest_m / STEP_M) + 1):
        radius = circle * STEP_M
        count = min(72, max(8, math.ceil(2 * math.pi * radius / STEP_M)))
        for k in range(count):
            angle = 2 * math.pi * k / count
            yield Place(
                round(here.east_m + radius * math.sin(angle), 3), round(here.north_m + radius * math.cos(angle), 3)
            )
