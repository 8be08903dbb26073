"""How far the engine's reckoning of charge is off: random flights of simulated drones on the virtual clock.

Each flight takes off at a random spot, flies a few legs, then home as recover does: up or down to its layer, across, land.
Compared with what the drone used: the reckoning of each leg before it is flown, and of the whole way home. Distances, heights,
wind, payload and drains are drawn by the seed. Twice: with the drains that the drone announces, and with those of its type in
the catalogue, which is what counts for a drone that announces none. An error above 0 is charge kept for nothing, below 0 is
charge that would have been missing.

    python benchmarks/bench_energy.py [--flights N] [--seed N]
"""

import argparse
import math
import statistics
from collections.abc import Mapping
from random import Random

from msgspec import Struct, structs

from agents_sim.bodies import build_body
from agents_sim.drone import Drone
from agents_sim.limits import DRONE_TYPES, DroneLimits
from agents_sim.shipped import DRONE
from agents_sim.spec import AgentSpec
from formiga_bt.base.clock import VirtualScheduler
from formiga_bt.base.energy import Power, Wind, home_pct, power_of, way_pct
from formiga_bt.base.geo import Place, Position, mm
from formiga_bt.base.packaged import files
from formiga_bt.lang.loader import load_catalogue
from formiga_bt.transport.messages import GoalRequest, to_wire


class Errors(Struct, frozen=True):
    """Reckoned minus used, points of charge."""

    legs: list[float]
    home: list[float]


class Flight:
    """One simulated drone in the air, and what it uses."""

    def __init__(self, at: Place, home: Place, limits: DroneLimits, wind: Wind, payload_kg: float) -> None:
        self.clock = VirtualScheduler()
        said = {name: number for name in limits.__struct_fields__ if (number := getattr(limits, name)) is not None}
        spec = AgentSpec(
            id="drone", type="drone", at=at, home=home, limits=said, does=DRONE, wind=wind, payload_kg=payload_kg
        )
        body = build_body(spec, self.clock)
        assert isinstance(body, Drone)
        self.drone = body

    def order(self, action: str, **fields: object) -> float:
        """Fly an action to its end; return the points of charge that it took."""
        before, count = self.drone.state(), self.clock.now()
        wire = {name: to_wire(value) for name, value in fields.items()}
        code = self.drone.start(GoalRequest(goal_id=f"{action}-{count}", agent="drone", action=action, fields=wire))
        assert not code, f"{action} was refused: {code}"
        while self.drone.state().kind not in ("hover", "rest"):
            assert self.clock.run_next(), f"{action} does not end"
        return before.battery - self.drone.state().battery


def fly(flights: int, seed: int, catalogue: Mapping[str, Mapping[str, float]] | None = None) -> Errors:
    """Fly at random and return the errors; `catalogue`: limits by type, instead of what drones announce."""
    random = Random(seed)
    found = Errors([], [])
    for _ in range(flights):
        kind = random.choice(sorted(DRONE_TYPES))
        limits = DRONE_TYPES[kind]
        payload = 0.0
        if catalogue is None:
            payload = random.choice((0.0, random.uniform(0.0, 5.0)))
            limits = structs.replace(
                limits,
                climb_drain_pct_s=limits.cruise_drain_pct_s * random.uniform(1.0, 2.0),
                payload_drain_pct_kg_s=random.uniform(0.0, 0.01),
            )
        power = power_of(catalogue[kind], {}) if catalogue is not None else power_of({}, limits.on_card())
        assert power is not None
        blows, where = random.choice((0.0, random.uniform(0.0, 6.0))), random.uniform(0.0, 2 * math.pi)
        _one(random, limits, power, (blows * math.sin(where), blows * math.cos(where)), payload, found)
    return found


def _one(random: Random, limits: DroneLimits, power: Power, wind: Wind, payload: float, found: Errors) -> None:
    home, layer = _place(random), random.choice((60.0, 75.0, 90.0))
    flight = Flight(_place(random), home, limits, wind, payload)
    ups = [mm(random.uniform(5.0, 110.0)) for _ in range(random.randint(2, 4))]
    here = flight.drone.position()
    to = Position(here.east_m, here.north_m, ups[0])
    found.legs.append(way_pct(here, to, power, wind, payload) - flight.order("TakeOff", altitude=ups[0]))
    for up in ups[1:]:
        here, place = to, _place(random)
        to = Position(place.east_m, place.north_m, up)
        found.legs.append(way_pct(here, to, power, wind, payload) - flight.order("GoTo", to=to))
    reckoned = home_pct(to, home, layer, power, wind, payload)
    used = flight.order("GoTo", to=Position(to.east_m, to.north_m, layer))
    used += flight.order("GoTo", to=Position(home.east_m, home.north_m, layer))
    used += flight.order("LandIn", at=home)
    found.home.append(reckoned - used)


def _place(random: Random) -> Place:
    return Place(mm(random.uniform(-300.0, 300.0)), mm(random.uniform(-300.0, 300.0)))


def main() -> None:
    """Run and print median, 95th percentile and worst."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=400)
    parser.add_argument("--seed", type=int, default=5)
    asked = parser.parse_args()
    types, _, _ = load_catalogue(files("actions"))
    for whose, limits in (
        ("announced", None),
        ("of the type in the catalogue", {name: types.types[name].limits for name in DRONE_TYPES}),
    ):
        errors = fly(asked.flights, asked.seed, limits)
        print(f"drains {whose}, {asked.flights} flights:")
        for what, numbers in (("a leg", errors.legs), ("the way home", errors.home)):
            sizes = sorted(abs(number) for number in numbers)
            print(
                f"  {what}: error {statistics.median(sizes):.3f} points median, {sizes[int(len(sizes) * 0.95)]:.3f} p95, "
                f"{sizes[-1]:.3f} worst; too low in {sum(n < -0.001 for n in numbers)} of {len(numbers)}, "
                f"by {max(0.0, -min(numbers)):.3f} at most"
            )


if __name__ == "__main__":
    main()
