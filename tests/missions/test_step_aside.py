"""Two machines that want each other's place at one height (safety: keeping apart): after 60 s one goes to another layer."""

from agents_sim.world import AgentSpec
from formiga_bt.engine.kernel.inputs import SendGoal
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import check_rehearsal, packaged_world, task_of

SWAP = """
imports: [lib/flying.yaml]
params: {here: place, there: place}
agents:
  drone: {type: hwd, near: "${here}"}
steps:
  - do: drone.TakeOff
    with: {altitude: 60 m}
  - do: drone.GoTo
    with: {to: "${at_height(here, 60 m)}"}
  - wait: 60 s
  - do: drone.GoTo
    with: {to: "${at_height(there, 60 m)}"}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""


def swap() -> tuple[Rehearsal, list[str]]:
    site, catalogue = packaged_world()
    specs: list[AgentSpec] = fleet_of(site, catalogue)
    rehearsal = Rehearsal(site, catalogue, [task_of(SWAP, site, catalogue, "Swap")], specs)
    rehearsal.run_for(1.0)
    west, east = site.places["camp"], site.places["east_field"]
    tasks = [rehearsal.submit("Swap", {"here": a, "there": b}) for a, b in ((west, east), (east, west))]
    return rehearsal, tasks


def test_two_that_wait_for_each_other_pass_at_different_heights() -> None:
    rehearsal, tasks = swap()

    assert rehearsal.run_until_ended(*tasks, limit_s=1800.0)

    assert [rehearsal.task(t).status for t in tasks] == ["SUCCEEDED", "SUCCEEDED"]
    hops = [
        e for s in rehearsal.steps for e in s.effects if isinstance(e, SendGoal) and e.goal_id.startswith("safety/")
    ]
    assert len(hops) >= 1
    assert all(hop.safety and hop.fields["to"]["up_m"] in (60.0, 75.0, 90.0) for hop in hops)
    check_rehearsal(rehearsal)


def test_who_wait_for_each_other_hop_at_once_and_straight_up() -> None:
    rehearsal, tasks = swap()
    rehearsal.run_until(lambda: "safety" in rehearsal.engine.state.counters)

    goals = rehearsal.engine.state.goals.values()
    (hop,) = [g for g in goals if g.id.startswith("safety/")]
    waiting = {g.agent: g.code for g in goals if g.state == "gated"}
    assert waiting == {hop.agent: "draining", "hwd_1" if hop.agent == "hwd_2" else "hwd_2": "leg_busy"}
    assert hop.at == rehearsal.now  # nobody waits a minute for what will not end by itself
    assert hop.leg is not None
    assert hop.leg[0].ground == hop.leg[1].ground
    assert rehearsal.run_until_ended(*tasks, limit_s=1800.0)
