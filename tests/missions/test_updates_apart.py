"""Machines that are given other targets in flight stay apart, whatever is lost or late on the way."""

from collections import Counter
from random import Random

import pytest

from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.kernel.inputs import UpdateGoal
from formiga_bt.engine.kernel.replies import Done, Refusal
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import check_rehearsal, packaged_world, task_of
from formiga_bt.transport.memory import Faults

SITE, CATALOGUE = packaged_world()
WANDER = task_of(
    """
imports: [lib/flying.yaml]
params: {here: place, there: place}
agents: {drone: {type: drone}}
steps:
  - do: drone.TakeOff
    with: {altitude: 60 m}
  - repeat: 4
    steps:
      - do: drone.GoTo
        with: {to: "${at_height(here, 60 m)}"}
        timeout: 20 min
      - do: drone.GoTo
        with: {to: "${at_height(there, 60 m)}"}
        timeout: 20 min
  - call: ReturnHome
    with: {drone: "${drone}"}
""",
    SITE,
    CATALOGUE,
    name="Wander",
)


def spots(dice: Random, count: int) -> list[Place]:
    return [Place(dice.uniform(-60.0, 160.0), dice.uniform(40.0, 220.0)) for _ in range(count)]


@pytest.mark.parametrize("seed", range(4))
def test_targets_that_change_in_flight_bring_no_two_machines_together(seed: int) -> None:
    dice = Random(seed)
    specs = [one for one in fleet_of(SITE, CATALOGUE) if one.id in ("hwd_1", "hwd_2", "lwd_1", "lwd_2")]
    flight = Rehearsal(SITE, CATALOGUE, [WANDER], specs, seed=seed)
    for spec in specs:
        flight.hub.set_delay(spec.id, dice.choice((20_000, 400_000, 900_000)))
        flight.hub.set_faults(spec.id, Faults(drop=dice.choice((0.0, 0.1)), duplicate=0.1, reorder=0.1))
    for _ in range(4):
        first, then = spots(dice, 2)
        flight.submit("Wander", {"here": first, "there": then})
        flight.run_for(dice.uniform(0.0, 3.0))
    found: Counter[str] = Counter()
    for _ in range(600):
        flight.run_for(dice.uniform(0.3, 2.0))
        goals = [one for one in flight.engine.state.goals.values() if one.action == "GoTo" and one.section == "steps"]
        if goals:
            place = spots(dice, 1)[0]
            to = Position(place.east_m, place.north_m, 60.0)
            reply = flight.driver.feed(UpdateGoal(dice.choice(goals).id, {"to": to})).reply
            assert isinstance(reply, Done | Refusal)
            found[reply.code if isinstance(reply, Refusal) else "sent"] += 1

    verdict = flight.referee.verdict(flight.now)
    assert verdict.is_clean, verdict
    assert found["sent"] > 20, found
    assert found["leg_busy"] > 5, found
    assert verdict.closest_cruise is not None
    assert verdict.closest_cruise.distance_m >= SITE.separation_m
    check_rehearsal(flight)
    flight.close()
