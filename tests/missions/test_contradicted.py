"""A TakeOff that says it is done while its machine stands: the next leg never leaves."""

from formiga_bt.engine.kernel.inputs import SendGoal
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.testing import effects
from formiga_bt.transport.messages import GoalRequest
from tests.missions.conftest import Fly


def test_the_leg_after_a_start_that_did_not_come_about_never_leaves(fly: Fly) -> None:
    rehearsal = fly()
    agent = rehearsal.sim["lwd_1"]
    begin = agent.front.start

    def start(request: GoalRequest) -> str:
        if request.action != "TakeOff":
            return begin(request)
        side = agent.side
        assert side is not None
        rehearsal.scheduler.call_at(rehearsal.now + 3_000_000, lambda: side.finish(request.goal_id, "succeeded"))
        return ""

    agent.front.start = start  # type: ignore[method-assign]
    task = rehearsal.submit("MoveTask", {"robot": AgentRef("lwd_1")})

    assert rehearsal.run_until_ended(task, limit_s=120)
    assert (rehearsal.task(task).status, rehearsal.task(task).outcome.code) == ("FAILED", "failed:contradicted")
    assert [goal.action for goal in effects(rehearsal, SendGoal) if goal.agent == "lwd_1"] == ["TakeOff"]
    drone = rehearsal.engine.state.agents["lwd_1"]
    assert (drone.pool, drone.landed) == ("STANDBY", "grounded")
