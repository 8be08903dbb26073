"""Statuses that repeat the one before go a short way: with the same steps as the long one."""

import random

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Position
from formiga_bt.engine.agents.repeats import Repeats
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.inputs import AgentStatusInput
from formiga_bt.engine.kernel.state import snapshot
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import CART, Yard, task, yard

RISE = CART + "steps: [{do: cart.Rise}, {do: cart.Move}, {do: cart.Park}]"


def retraced(made: Yard, text: str) -> Engine:
    """Give a new engine the inputs that a yard's engine had; each step must be the same."""
    engine = Engine(*yard(), {"Try": task(text)})
    for step in made.steps:
        assert engine.handle(step.at, step.input) == step
    return engine


def live(made: Yard, dice: random.Random) -> None:
    """Let half a minute pass in which the carts say now this, now that, and mostly the same."""
    carts = made.carts
    for _ in range(60):
        cart = dice.choice(carts)
        match dice.randrange(16):
            case 0:
                cart.tell(battery=dice.choice((100.0, 60.0, 400.0)))
            case 1:
                cart.tell(landed=dice.choice(("grounded", "airborne", "unknown")))
            case 2:
                cart.tell(control=dice.choice(("engine", "pilot")))
            case 3:
                cart.tell(
                    last_goal=dice.choice(("", "Try-1/0/steps/1", cart.requests[-1].goal_id if cart.requests else ""))
                )
            case 4:
                cart.tell(position=Position(dice.choice((0.0, 5.0)), 0.0, 0.0))
            case 5:
                cart.tell(epoch=dice.choice((0, 1, 2)), epoch_ignored=dice.choice((0, 9)))
            case 6:
                cart.tell(seq=dice.randrange(100), stamp=made.now + dice.choice((0, -30, 900)) * SECOND)
            case 7:
                cart.tell(boot_id=dice.choice(("one", "two")))
            case 8:
                cart.silent = not cart.silent
            case 9:
                made.start()
            case 10 if cart.side.active:
                cart.succeed()
            case 11:
                cart.kill()
                cart.boot()
            case 12:
                cart.tell(wind_east_m_s=dice.choice((0.0, 3.0)), wind_north_m_s=0.0)
            case _:
                cart.side.publish_status()
        made.run_for(dice.choice((0.1, 0.5, 1.0)))


@pytest.mark.parametrize("seed", range(6))
def test_whatever_agents_say_the_steps_are_those_of_the_long_way(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    short = 0
    take = Repeats.take

    def counted(*args: object) -> bool:
        nonlocal short
        taken = take(*args)  # type: ignore[arg-type]
        short += taken
        return taken

    with monkeypatch.context() as patch:
        patch.setattr(Repeats, "take", counted)
        made = Yard(RISE, carts=3, people=2)
        live(made, random.Random(seed))
        made.close()
    assert short > 50

    monkeypatch.setattr(Repeats, "take", lambda *_: False)
    assert snapshot(retraced(made, RISE).state) == snapshot(made.engine.state)


def test_most_statuses_of_those_who_stand_by_go_the_short_way(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[bool] = []
    take = Repeats.take
    made = make(RISE, carts=3, people=2)
    made.run_for(30)
    monkeypatch.setattr(Repeats, "take", lambda *args: taken.append(take(*args)) or taken[-1])  # type: ignore[func-returns-value]

    made.run_for(60)

    statuses = [step for step in made.steps if isinstance(step.input, AgentStatusInput)]
    assert len(taken) > 150
    assert all(taken)
    assert all(len(step.changes) == 1 for step in statuses[-len(taken) :])
