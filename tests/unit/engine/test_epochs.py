"""Which start of an engine agents follow: who is deposed, who is told, and what the next start takes."""

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.goals.epochs import next_epoch
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.rehearsal.testing import ScriptedAgent, effects
from formiga_bt.transport.messages import ClockBeat
from tests.golden import Wording
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART, Yard


def hears(yard: Yard, agent: ScriptedAgent, epoch: int) -> None:
    agent.side.on_clock(ClockBeat(wall_us=yard.now, engine_us=yard.now, speed=1.0, epoch=epoch, beat=1))


def told(yard: Yard, code: str) -> list[str]:
    return [alarm.text for alarm in effects(yard, Alarm) if alarm.code == code]


def test_a_beat_of_epoch_2_to_60_deposes_nobody_and_is_told(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Move}]")
    hears(yard, yard.cart, 2**60)
    yard.run_for(2)
    task = yard.start()
    yard.cart.succeed()
    yard.run_for(2)

    assert yard.task(task).status == "SUCCEEDED"
    assert not told(yard, "deposed")
    (text,) = told(yard, "epoch_ignored")
    assert str(2**60) in text


def test_an_agent_that_follows_another_engine_deposes_this_one_before_any_goal_is_sent(
    make: Make, wording: Wording
) -> None:
    yard = make(CART + "steps: [{do: cart.Move}]")
    hears(yard, yard.cart, 900)
    yard.run_for(2)
    assert yard.engine.state.counters["deposed"] == 1
    (text,) = told(yard, "deposed")
    wording(text)
    assert "formiga down" in text

    task = yard.start()
    yard.run_for(5 * 60)
    assert len(told(yard, "deposed")) == 1
    assert [goal.code for goal in yard.engine.state.goals.values() if goal.task == task] == ["epoch"]


def test_an_agent_that_ignores_this_very_engine_is_told(make: Make, wording: Wording) -> None:
    yard = make(CART + "steps: [{do: cart.Move}]")
    yard.cart.tell(epoch=0, epoch_ignored=yard.engine.state.epoch, stamp=yard.now + SECOND)
    yard.run_for(0.1)
    (text,) = told(yard, "epoch_ignored")
    wording(text)


@pytest.mark.parametrize(
    ("own", "reported", "taken"),
    [
        (5, [], 6),
        (5, [5, 5, 0], 6),
        (5, [5, 12], 13),  # another engine led one of them on: all accept its number and one more
        (1, [5000, 5000], 5001),  # this engine's folder was lost
        (5, [5, 5, 10**9], 6),  # one was led far away: it must be started anew
        (5, [1005], 1006),
        (5, [2**31 - 1], 6),
        (5, [5, 1006], 6),  # nothing is accepted by both
    ],
)
def test_the_next_start_takes_what_most_agents_accept(own: int, reported: list[int], taken: int) -> None:
    assert next_epoch(own, reported) == taken


def test_an_agent_that_follows_another_engine_does_not_depose_this_one_and_is_told_once(make: Make) -> None:
    yard = make(CART + "steps: [{do: cart.Move}]")
    yard.engine.core.engine_id = "mine"
    for beat in range(1, 4):
        yard.cart.side.on_clock(
            ClockBeat(wall_us=yard.now, engine_us=yard.now, speed=1.0, epoch=900, beat=beat, engine_id="theirs")
        )
        yard.run_for(2)
    assert not told(yard, "deposed")
    (text,) = told(yard, "other_engine")
    assert "theirs" in text
    assert "mine" in text
