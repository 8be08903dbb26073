"""What `why` says of preemption: to who waits, to who steps aside, to who is left in peace, to who began anew."""

import pytest

from formiga_bt.show.why.front import explain
from tests.golden import Wording
from tests.unit.engine.yard import CART, Yard, task

FLIGHT = "steps: [{do: cart.Rise}, {do: cart.Move}, {do: cart.Home}]\n"
SOS = task("priority: high\nagents: {cart: {type: cart, wait: 60 s}}\nsteps: [{do: cart.Move}]", name="Sos")


def asked_for(text: str) -> tuple[Yard, str, str]:
    """Return a yard whose only cart has risen for Try when Sos is requested."""
    yard = Yard(task(CART + text), SOS)
    mine = yard.start()
    yard.cart.succeed()
    yard.run_for(0.2)
    return yard, mine, yard.start("Sos")


def told(yard: Yard, task_id: str) -> dict[str, str]:
    state = yard.engine.state
    _, lines = explain(state, yard.engine.core.models, task_id, yard.now)
    return {line.code: line.text for line in lines}


def test_who_waits_is_told_who_steps_aside_and_that_its_wait_stands_still(wording: Wording) -> None:
    yard, _, urgent = asked_for(FLIGHT)

    lines = told(yard, urgent)

    wording(lines["preempting"])
    assert "no_agent" not in lines
    yard.close()


def test_who_steps_aside_is_told_for_whom_and_what_follows(wording: Wording) -> None:
    yard, mine, urgent = asked_for(FLIGHT)

    text = told(yard, mine)["preempted"]

    assert urgent in text
    wording(text)
    yard.close()


def test_who_began_anew_is_told_why(wording: Wording) -> None:
    yard, mine, _ = asked_for(FLIGHT)
    yard.cart.succeed()
    yard.run_for(0.3)

    wording(told(yard, mine)["past.preempted"])
    yard.close()


@pytest.mark.parametrize(
    "text",
    [
        "preemptible: false\n" + FLIGHT,
        "steps: [{do: cart.Rise}, {do: cart.Move, critical: true}, {do: cart.Home}]",
        "steps: [{do: cart.Haul}, {do: cart.Move}]",
    ],
)
def test_who_waits_is_told_why_nobody_is_asked(text: str, wording: Wording) -> None:
    yard, _, urgent = asked_for(text)

    lines = told(yard, urgent)

    wording(lines["kept"], lines["no_agent"])
    yard.close()


def test_a_task_that_lost_a_machine_and_began_anew_says_which(wording: Wording) -> None:
    yard = Yard(task("agents: {cart: {type: cart, if_lost: rebind}}\n" + FLIGHT), carts=2)
    mine = yard.start()
    yard.cart.kill()
    yard.run_for(40)

    wording(told(yard, mine)["past.agent_lost"])
    yard.close()
