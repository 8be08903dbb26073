"""What the envelope costs: one goal at the gate, one status in flight, on flat ground and over a height file.

python benchmarks/bench_envelope.py [--rounds N]
"""

import argparse
import math
import timeit
from array import array

from formiga_bt.base.energy import Power
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.base.heights import HeightGrid
from formiga_bt.lang.model import Site
from formiga_bt.safety.airspace import Airspace
from formiga_bt.safety.envelope import FlightState, GateFlight, at_gate, in_flight, ways_of
from formiga_bt.safety.rules import Rules

POWER = Power(speed_m_s=8.0, climb_m_s=2.5, cruise_pct_s=0.066, hover_pct_s=0.058, climb_pct_s=0.066)
HOME, LAYER_M = Place(15.0, 40.0), 60.0
HERE, THERE = Position(15.0, 40.0, 60.0), Position(420.0, 510.0, 60.0)
RULES = Rules(keep_in=True, keep_out=True)
ROUNDS_M = 600.0


def circle(east: float, north: float, radius: float, corners: int) -> Region:
    """Return a region with so many corners."""
    steps = (2 * math.pi * k / corners for k in range(corners))
    return Region(tuple(Place(east + radius * math.cos(a), north + radius * math.sin(a)) for a in steps))


def hills(top_m: float) -> HeightGrid:
    """Return 400 times 400 cells of 5 m of rolling ground."""
    heights = array("d", (top_m / 2 * (1 + math.sin(x / 9) * math.cos(y / 7)) for y in range(400) for x in range(400)))
    return HeightGrid(400, 400, -1000.0, -1000.0, 5.0, heights)


def main() -> None:
    """Run and print microseconds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5000)
    rounds = parser.parse_args().rounds
    square = Region(tuple(Place(e * ROUNDS_M, n * ROUNDS_M) for e, n in ((-1, -1), (1, -1), (1, 1), (-1, 1))))
    no_fly = (circle(-300, -300, 80, 12), circle(300, -300, 80, 12), circle(200, 450, 60, 12))
    bent = Region((*square.corners, Place(-600, 10), Place(-500, 0), Place(-600, -10)))
    for name, site in (
        ("flat, a square fence, three no-fly regions", Site("s", 66.5, 25.7, fence=square, no_fly=no_fly)),
        ("the same with a concave fence", Site("s", 66.5, 25.7, fence=bent, no_fly=no_fly)),
        ("with low hills from a file", Site("s", 66.5, 25.7, fence=square, no_fly=no_fly, heights=hills(30.0))),
        ("with hills almost up to the layer", Site("s", 66.5, 25.7, fence=square, no_fly=no_fly, heights=hills(54.0))),
        (
            "with hills above the layer: refused",
            Site("s", 66.5, 25.7, fence=square, no_fly=no_fly, heights=hills(90.0)),
        ),
    ):
        ground = Airspace(site)

        def gate(ground: Airspace = ground) -> object:
            flight = GateFlight(
                agent="lwd_1", here=HERE, ways=ways_of(HERE, THERE, ground), battery=80.0, wind=(3.0, 1.0),
                power=POWER, home=HOME, layer_m=LAYER_M,
            )  # fmt: skip
            return at_gate(flight, ground, RULES)

        def status(ground: Airspace = ground) -> object:
            now = FlightState(
                agent="lwd_1", here=HERE, battery=80.0, wind=(3.0, 1.0), power=POWER, home=HOME, layer_m=LAYER_M
            )
            return in_flight(now, ground, RULES)

        costs = [
            min(timeit.repeat(call, number=rounds // 5, repeat=5)) / (rounds // 5) * 1e6 for call in (gate, status)
        ]
        print(f"{name}: gate {costs[0]:.1f} us a goal, {costs[1]:.1f} us a status")


if __name__ == "__main__":
    main()
