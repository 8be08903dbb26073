"""What failed and what is known is data: `error`, `abort.reason`, saved names in the sections, what a subtree returns."""

from formiga_bt.engine.kernel.inputs import NotifyPeople
from formiga_bt.rehearsal.testing import effects
from tests.reloading import reloaded
from tests.unit.engine.yard import CART, Yard

FAILS = """
steps:
  - do: cart.Move
    save_as: far
  - do: cart.Move
on_failure:
  - notify: "${error.code}|${error.reason}|${error.step}|${error.agent}"
  - notify: far was ${far.n}
    when: is_set(far)
finally:
  - notify: finally
"""


def told(bench: Yard) -> list[str]:
    return [notice.text for notice in effects(bench, NotifyPeople)]


def settle(bench: Yard, how: str = "succeed", **more: object) -> None:
    getattr(bench.cart, how)(**more)
    bench.run_for(0.2)


def test_on_failure_sees_what_failed_where_and_what_was_saved_before() -> None:
    bench = Yard(CART + FAILS)
    task = bench.start()
    settle(bench, result={"n": 7})
    settle(bench, "fail", code="mud")

    assert bench.end(task) == ("FAILED", "failed:mud")
    assert told(bench) == ["failed:mud|c1: Move failed, mud|steps/steps[1]|c1", "far was 7", "finally"]


def test_a_name_that_was_not_saved_is_not_set_in_on_failure() -> None:
    bench = Yard(CART + FAILS)
    task = bench.start()
    settle(bench, "fail", code="mud")

    assert bench.end(task)[0] == "FAILED"
    assert told(bench) == ["failed:mud|c1: Move failed, mud|steps/steps[0]|c1", "finally"]


def test_on_abort_sees_the_reason() -> None:
    bench = Yard(CART + "steps: [{do: cart.Move}]\non_abort: [{notify: 'because of ${abort.reason}'}]\n")
    task = bench.start()
    bench.abort(task, reason="rain")

    assert bench.end(task) == ("CANCELED", "aborted")
    assert told(bench) == ["because of rain"]


def test_a_subtree_returns_a_typed_value_and_a_failed_one_none() -> None:
    text = """
steps:
  - call: Twice
    with: {cart: "${cart}", by: 3}
    save_as: total
  - notify: "${total + 1} in all"
  - call: Twice
    with: {cart: "${cart}"}
    save_as: other
    ignore_failure: true
  - notify: nothing
    when: not is_set(other)
subtrees:
  Twice:
    params:
      cart: agent
      by: {type: int, default: 1, min: 1, max: 5}
    steps:
      - do: cart.Move
        save_as: got
    returns: ${got.n * by}
"""
    bench = Yard(CART + text)
    task = bench.start()
    settle(bench, result={"n": 4})
    settle(bench, "fail", code="mud")

    assert bench.end(task) == ("SUCCEEDED", "")
    assert told(bench) == ["13 in all", "nothing"]


CARRIES = """
steps:
  - call: Probe
    with: {cart: "${cart}"}
on_failure:
  - notify: "stopped at ${error.data.spot.n}, ${error.data.left} to go"
    when: is_set(error.data.spot) and is_set(error.data.left)
subtrees:
  Probe:
    params: {cart: agent}
    steps:
      - do: cart.Move
        save_as: got
      - fail: The way ends here.
        code: dead_end
        with:
          spot: ${got}
          left: 2
"""


def test_a_failure_carries_values_out_of_a_subtree_and_over_a_restart() -> None:
    bench = Yard(CART + CARRIES)
    task = bench.start()
    settle(bench, result={"n": 7})

    assert bench.end(task) == ("FAILED", "failed:dead_end")
    assert told(bench) == ["stopped at 7, 2 to go"]
    failure = reloaded(bench.engine.state).tasks[task].outcome.failure
    assert failure is not None
    assert failure.data == {"spot": {"n": 7}, "left": 2}


def test_a_failure_of_an_agent_carries_nothing() -> None:
    bench = Yard(CART + CARRIES)
    task = bench.start()
    settle(bench, "fail", code="mud")

    assert (bench.end(task), told(bench)) == (("FAILED", "failed:mud"), [])
