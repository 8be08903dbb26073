"""How long a machine hovers on a person's word: until its reserve, as it is in force, the way home and 3 min are near."""

import pytest
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.kernel.inputs import Operator
from formiga_bt.engine.kernel.timers import OrderDue
from formiga_bt.rehearsal.testing import Bench, ScriptedAgent, alarms, packaged_world, task_of
from formiga_bt.safety.charge import way_home
from formiga_bt.transport.messages import AgentCard

SITE, CATALOGUE = packaged_world()
HOVER = """
agents: {drone: {type: hwd}}
%s
steps:
  - do: drone.TakeOff
  - wait: 1 h
  - do: drone.LandIn
    with: {at: "${drone.home}"}
"""
BATTERY = 60.0


def hovering(site_pct: float, task_pct: float, announced: dict[str, float]) -> tuple[Bench, ScriptedAgent]:
    site = replace(SITE, envelope={**SITE.envelope, "reserve_pct": site_pct})
    envelope = f"envelope: {{reserve: {task_pct:g} %}}" if task_pct else ""
    bench = Bench(site, CATALOGUE, [task_of(HOVER % envelope, site, CATALOGUE)])
    drone = bench.agent("hwd_1", "hwd")
    if announced:
        card = drone.side.card
        fields = {name: getattr(card, name) for name in AgentCard.__struct_fields__}
        drone.link.publish_card(AgentCard(**{**fields, "limits": announced}))
    drone.say(battery=BATTERY)
    bench.run_for(1)
    bench.submit("Try", {})
    bench.run_for(10)
    drone.succeed()
    bench.run_for(2)
    return bench, drone


@pytest.mark.parametrize(
    ("site_pct", "task_pct", "announced", "reserve_pct"),
    [
        (25.0, 0.0, {}, 25.0),
        (40.0, 0.0, {}, 40.0),
        (25.0, 40.0, {}, 40.0),
        (25.0, 0.0, {"hover_drain_pct_s": 0.1}, 25.0),
    ],
)
def test_it_hovers_until_its_reserve_the_way_home_and_three_minutes_are_near(
    site_pct: float, task_pct: float, announced: dict[str, float], reserve_pct: float
) -> None:
    bench, drone = hovering(site_pct, task_pct, announced)
    record = bench.record("hwd_1")
    power = bench.engine.core.power(record)
    assert power is not None
    assert record.position is not None
    assert record.landed == "airborne"
    port = SITE.ports[record.home].at
    home = way_home(port, record.layer_m, power, (0.0, 0.0), 0.0, bench.engine.core.airspace)(record.position, False)
    lasts_s = (BATTERY - reserve_pct - home) / power.hover_pct_s - 180.0

    bench.ask(Operator("hold", "hwd_1", "eve"))
    began = bench.now
    assert abs(bench.engine.state.deadlines[OrderDue("hwd_1")].at - began - lasts_s * SECOND) <= 1

    assert bench.run_until(lambda: bench.engine.state.orders["hwd_1"].stop == "return", 1000)
    assert bench.now - began == pytest.approx(lasts_s * SECOND, abs=1)
    assert alarms(bench) == ["hold_over"]
    drone.say(battery=BATTERY - power.hover_pct_s * lasts_s)
    bench.run_for(1)
    assert "envelope.reserve" not in alarms(bench)


def test_one_that_has_less_than_that_returns_at_once() -> None:
    bench, drone = hovering(40.0, 0.0, {})
    drone.say(battery=45.0)
    bench.run_for(1)
    bench.ask(Operator("hold", "hwd_1", "eve"))

    assert bench.engine.state.orders["hwd_1"].stop == "return"


def test_against_a_wind_that_nothing_comes_home_in_it_does_not_wait() -> None:
    bench, drone = hovering(25.0, 0.0, {})
    at = bench.record("hwd_1").position
    assert at is not None
    drone.say(position=replace_east(at, 20.0), wind_east_m_s=60.0, wind_north_m_s=0.0)
    bench.run_for(0.1)

    assert bench.engine.clearances.patience_us(bench.record("hwd_1")) == 0


def replace_east(at: object, east_m: float) -> object:
    from msgspec.structs import replace as put

    return put(at, east_m=at.east_m + east_m)
