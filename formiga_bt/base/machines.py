"""What kinds of agents there are, by how they move: of this, never of a name, depends which rules hold for an agent.

| mobility | who | rules |
|---|---|---|
| `air` | drones | flight state, ports, layers, clearance, ground below, fence and no-fly regions |
| `ground` | robots that drive | fence and no-go regions, ways over ground, charge; they are never airborne |
| `fixed` | doors, lifts, cranes: a place, and no way | who commands, stops |
| `none` | services, sensors: programs without a place | who commands, stops |
| `people` | people, who move by themselves | they are asked, never steered |
"""

from typing import Final, Literal, get_args

Mobility = Literal["air", "ground", "fixed", "none", "people"]

MACHINES: Final[tuple[Mobility, ...]] = ("air", "ground", "fixed", "none")
"""What a type of a catalogue that is no person may say."""
MOVING: Final[frozenset[Mobility]] = frozenset({"air", "ground"})
"""Machines that change their place for a task: they have a charge and a position, and are granted to one task at a time."""

assert {*MACHINES, "people"} == set(get_args(Mobility))
