"""What `why` says of preemption: to who waits, to who steps aside, to who is left in peace, to who began anew."""

import pytest

from formiga_bt.show.why.front import explain
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


def test_who_waits_is_told_who_steps_aside_and_that_its_wait_stands_still() -> None:
    yard, mine, urgent = asked_for(FLIGHT)

    lines = told(yard, urgent)

    assert (
        lines["preempting"]
        == f"{mine} steps aside for it, machines come home first; the roles' `wait` stands still meanwhile"
    )
    assert "no_agent" not in lines
    yard.close()


def test_who_steps_aside_is_told_for_whom_and_what_follows() -> None:
    yard, mine, urgent = asked_for(FLIGHT)

    text = told(yard, mine)["preempted"]

    assert urgent in text
    assert text.endswith("then it begins anew from its first step")
    yard.close()


def test_who_began_anew_is_told_why() -> None:
    yard, mine, urgent = asked_for(FLIGHT)
    yard.cart.succeed()
    yard.run_for(0.3)

    assert told(yard, mine)["past.preempted"] == f"run 1 was preempted for {urgent}"
    yard.close()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("preemptible: false\n" + FLIGHT, "its task file does not allow it"),
        ("steps: [{do: cart.Rise}, {do: cart.Move, critical: true}, {do: cart.Home}]", "a critical step of it runs"),
        ("steps: [{do: cart.Haul}, {do: cart.Move}]", "it has done something that may not be done twice"),
    ],
)
def test_who_waits_is_told_why_nobody_is_asked(text: str, words: str) -> None:
    yard, mine, urgent = asked_for(text)

    lines = told(yard, urgent)

    assert lines["kept"] == f"c1 is busy with {mine}, which is not preempted: {words}"
    assert lines["no_agent"] == "it gives up in 60 s (the `wait` of its roles or request)"
    yard.close()


def test_a_task_that_lost_a_machine_and_began_anew_says_which() -> None:
    yard = Yard(task("agents: {cart: {type: cart, if_lost: rebind}}\n" + FLIGHT), carts=2)
    mine = yard.start()
    yard.cart.kill()
    yard.run_for(40)

    assert told(yard, mine)["past.agent_lost"] == "run 1 lost a machine (c1 was lost)"
    yard.close()
