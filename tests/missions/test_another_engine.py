"""Another engine of a later epoch commands the site for a while."""

from formiga_bt.engine.kernel.inputs import Resumed
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.testing import alarms
from formiga_bt.transport.messages import ClockBeat
from tests.missions.conftest import Fly


def test_a_goal_refused_as_of_an_old_epoch_goes_again_and_its_refusal_is_heard(fly: Fly) -> None:
    """Its agent forgets it: the numbers of what it tells of it begin anew."""
    rehearsal = fly()
    agent = rehearsal.sim["lwd_1"]
    assert agent.side is not None
    agent.side.on_clock(ClockBeat(wall_us=rehearsal.now, engine_us=rehearsal.now, speed=1.0, epoch=2, beat=1))
    task = rehearsal.submit("MoveTask", {"robot": AgentRef("lwd_1")})
    rehearsal.run_for(2)
    (goal,) = rehearsal.engine.state.goals.values()
    assert (goal.state, goal.code) == ("gated", "epoch")
    assert alarms(rehearsal).count("deposed") == 1

    rehearsal.sim.refuse_next("lwd_1")
    now = rehearsal.now
    rehearsal.driver.feed(Resumed(epoch=3, at=now, since=now, wall=now, heard=now))
    for one in rehearsal.sim.agents.values():
        assert one.side is not None
        one.side.announce()
    rehearsal.run_for(15)

    assert rehearsal.engine.state.goals == {}
    assert rehearsal.run_until_ended(task, limit_s=60)
    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "rejected")
