"""A machine whose own port is taken waits beside it, and then gets another (safety: keeping apart)."""

from msgspec.structs import replace

from agents_sim.world import AgentSpec
from formiga_bt.base.geo import Place, horizontal_m
from formiga_bt.engine.kernel.inputs import SendGoal
from formiga_bt.engine.kernel.timers import PortDue
from formiga_bt.lang.model import Port
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import alarms, check_rehearsal, effects, packaged_task, packaged_world, task_of

AWAY = """
imports: [lib/flying.yaml]
params: {robot: {type: agent, of: [hwd]}, spot: place}
agents: {drone: {type: hwd, id: "${robot}"}}
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${spot}", height: 60 m}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""


def on_the_port(*, ports: int = 8) -> tuple[Rehearsal, str]:
    """hwd_1 (port p5) is out in the field when a machine that nobody commands is put down on its port."""
    site, catalogue = packaged_world()
    kept: dict[str, Port] = {name: port for name, port in site.ports.items() if int(name[1:]) <= ports}
    listed = {name: site.agents[name] for name in ("hwd_1", "hwd_2")}  # p5 and p6; whoever else comes gets p1, p2, ...
    site = replace(site, ports=kept, agents=listed)
    rehearsal = Rehearsal(
        site, catalogue, [packaged_task("move_task"), task_of(AWAY, site, catalogue, "Away")], fleet_of(site, catalogue)
    )
    rehearsal.run_for(1)
    task = rehearsal.submit("Away", {"robot": AgentRef("hwd_1"), "spot": site.places["north_field"]})
    rehearsal.run_for(40)
    rehearsal.sim.add(AgentSpec(id="x_1", type="lwd", at=Place(15.5, 40.0), kind="drone"))
    return rehearsal, task


def sent(rehearsal: Rehearsal, agent: str) -> list[SendGoal]:
    return [goal for goal in effects(rehearsal, SendGoal) if goal.agent == agent]


def test_it_waits_at_the_waiting_point_and_says_for_whom() -> None:
    rehearsal, _ = on_the_port()

    assert rehearsal.run_until(lambda: any(g.code == "port_busy" for g in rehearsal.engine.state.goals.values()), 300)
    (goal,) = [g for g in rehearsal.engine.state.goals.values() if g.code == "port_busy"]
    assert (goal.agent, goal.text) == ("hwd_1", "x_1")
    rehearsal.run_for(60)

    here = rehearsal.engine.state.agents["hwd_1"].position
    assert here == rehearsal.engine.core.site.ports["p5"].waiting


def test_after_two_minutes_another_port_is_its_home_and_the_step_is_sent_anew() -> None:
    rehearsal, task = on_the_port()
    rehearsal.run_until(lambda: any(isinstance(due, PortDue) for due in rehearsal.engine.state.deadlines), 300)
    since = rehearsal.now

    assert rehearsal.run_until(lambda: rehearsal.engine.state.agents["hwd_1"].home != "p5", 300)
    assert (rehearsal.now - since) / 1e6 == 120.0
    assert rehearsal.run_until_ended(task)

    drone = rehearsal.engine.state.agents["hwd_1"]
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert (drone.home, drone.landed, drone.pool) == ("p4", "grounded", "STANDBY")  # p6 is hwd_2's
    assert drone.position is not None
    assert horizontal_m(drone.position, rehearsal.engine.core.site.ports["p4"].at) < 0.1
    again = [goal.goal_id for goal in sent(rehearsal, "hwd_1") if goal.goal_id.endswith("+2")]
    assert len(again) == 1
    check_rehearsal(rehearsal)


def test_it_lands_at_its_own_port_once_that_is_free() -> None:
    rehearsal, task = on_the_port()
    rehearsal.run_until(lambda: any(g.code == "port_busy" for g in rehearsal.engine.state.goals.values()), 300)
    rehearsal.run_for(30)

    moved = rehearsal.submit("MoveTask", {"robot": AgentRef("x_1")})

    assert rehearsal.run_until_ended(task, moved)
    assert rehearsal.task(task).status == "SUCCEEDED"
    assert rehearsal.engine.state.agents["hwd_1"].home == "p5"
    check_rehearsal(rehearsal)


def test_a_free_port_on_which_somebody_stands_is_none() -> None:
    rehearsal, task = on_the_port()
    rehearsal.sim.add(AgentSpec(id="x_2", type="lwd", at=Place(-14.0, 40.0), kind="drone"))

    assert rehearsal.run_until_ended(task, limit_s=3600)
    drone = rehearsal.engine.state.agents["hwd_1"]
    assert (drone.landed, drone.home) == ("grounded", "p3")  # on p4 somebody stands


def test_without_a_free_port_there_is_an_alarm_each_minute_until_its_step_fails() -> None:
    rehearsal, task = on_the_port(ports=6)
    site = rehearsal.engine.core.site
    for number, name in enumerate(("p3", "p4")):
        port = site.ports[name].at
        rehearsal.sim.add(
            AgentSpec(id=f"y_{number}", type="lwd", at=Place(port.east_m + 1.0, port.north_m), kind="drone")
        )

    rehearsal.run_until(lambda: any(g.code == "port_busy" for g in rehearsal.engine.state.goals.values()), 300)
    rehearsal.run_for(60 * 5 + 10)

    assert 3 <= alarms(rehearsal).count("no_free_port") <= 5
    assert rehearsal.task(task).section == "steps"
    assert rehearsal.run_until(lambda: rehearsal.task(task).section != "steps", 7200)
    assert rehearsal.task(task).outcome.code == "port_busy"
    assert (rehearsal.engine.state.agents["hwd_1"].battery or 0.0) > 25.0
