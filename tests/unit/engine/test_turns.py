"""One status that wakes very many tasks: they are looked at a part at a time, those of high priority at once."""

import pytest

from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.inputs import Abort, AgentStatusInput, EngineStep, PublishState, TimerDue
from formiga_bt.engine.kernel.replies import Refusal
from formiga_bt.engine.kernel.timers import TurnDue
from formiga_bt.engine.tasks import wake_queue
from formiga_bt.lang.types import AgentRef
from formiga_bt.transport.messages import AgentStatus
from tests.reloading import reloaded
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import Yard

WAITS = """
params: {who: {type: agent, of: [cart]}}
steps:
  - wait_until: who.battery < 20 %
    timeout: 1 h
"""
REST = TimerDue(TurnDue())


def report(yard: Yard, battery: float) -> AgentStatusInput:
    """Return the next status of c1."""
    agent, now = yard.record("c1"), yard.now
    status = AgentStatus(
        id="c1", type="cart", battery=battery, position=agent.position, landed=agent.landed, boot_id=agent.boot_id,
        seq=agent.seq + 1, stamp=now,
    )  # fmt: skip
    return AgentStatusInput(status, now)


def ended(step: EngineStep) -> list[str]:
    """Return the tasks that ended in a step."""
    return [e.task for e in step.effects if isinstance(e, PublishState) and e.status == "SUCCEEDED"]


@pytest.fixture
def crowd(make: Make, monkeypatch: pytest.MonkeyPatch) -> tuple[Yard, list[str]]:
    """Return a yard in which twelve tasks wait for the charge of c1, of which the tenth is of high priority."""
    monkeypatch.setattr(wake_queue, "AT_ONCE", 4)
    yard = make(WAITS)
    names = [yard.submit("Try", {"who": AgentRef("c1")}, priority="high" if n == 9 else "low") for n in range(12)]
    yard.run_for(1)
    return yard, names


def test_a_part_of_them_is_looked_at_in_each_step_and_nobody_of_high_priority_waits(
    crowd: tuple[Yard, list[str]],
) -> None:
    yard, names = crowd

    yard.cart.tell(battery=10.0)
    yard.run_for(0.5)

    first, *others = [step for step in yard.steps if ended(step)]
    assert isinstance(first.input, AgentStatusInput)
    assert ended(first) == [*names[:4], names[9]]
    assert [step.input for step in others] == [REST, REST]
    assert [ended(step) for step in others] == [names[4:8], [names[8], *names[10:]]]
    assert {step.at for step in others} == {first.at}
    assert TurnDue() not in yard.engine.state.deadlines


def test_what_comes_in_between_has_its_turn_and_those_who_wait_see_what_is_then(crowd: tuple[Yard, list[str]]) -> None:
    yard, names = crowd
    engine, handle = yard.engine, yard.driver._handle
    now = yard.now

    handle(now, report(yard, 10.0))
    assert engine.next_deadline() == (now, TurnDue())
    step = handle(now, Abort(names[4]))
    assert names[4] not in engine.open_tasks
    assert not isinstance(step.reply, Refusal)
    again = handle(now, report(yard, 50.0))

    assert not ended(again)
    assert ended(handle(now, REST)) == []
    assert ended(handle(now, REST)) == []
    assert engine.next_deadline() != (now, TurnDue())
    assert list(engine.open_tasks) == [*names[5:9], *names[10:]]


def test_an_engine_that_went_in_between_looks_at_all_who_wait(crowd: tuple[Yard, list[str]]) -> None:
    yard, names = crowd
    now = yard.now
    yard.driver._handle(now, report(yard, 10.0))

    core = yard.engine.core
    engine = Engine(core.site, core.catalogue, core.models, state=reloaded(yard.engine.state))

    found: list[str] = []
    while (due := engine.next_deadline()) is not None and due == (now, TurnDue()):
        found += ended(engine.handle(now, REST))
    assert found == [*names[4:9], *names[10:]]
