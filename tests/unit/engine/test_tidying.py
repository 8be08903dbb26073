"""The `finally` of a stopped sequence: what skips it, where its failure is told, what a restart finds of it."""

from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.inputs import NotifyPeople
from formiga_bt.engine.kernel.state import snapshot
from formiga_bt.rehearsal.testing import effects
from tests.golden import Wording
from tests.reloading import reloaded
from tests.unit.engine.yard import CART, Yard, yard

TEXT = """
steps:
  - sequence: [{do: cart.Move}]
    finally: [{notify: tidy}, {do: cart.Home}, {notify: tidied}]
on_failure: [{notify: on_failure}]
on_abort: [{notify: on_abort}]
"""


def moving(text: str = TEXT) -> tuple[Yard, str]:
    """Return a yard whose cart moves within the sequence."""
    bench = Yard(CART + text)
    task = bench.start()
    assert bench.cart.goal.action == "Move"
    bench.cart.confirms_cancel = False
    return bench, task


def confirm(bench: Yard) -> None:
    """Let the cart say that it has stopped."""
    bench.cart.side.finish(bench.cart.goal.goal_id, "canceled")
    bench.run_for(0.2)


def told(bench: Yard) -> list[str]:
    return [notice.text for notice in effects(bench, NotifyPeople)]


def settle(bench: Yard, how: str = "succeed") -> None:
    getattr(bench.cart, how)()
    bench.run_for(0.2)


def breach(bench: Yard, task: str) -> None:
    bench.engine.core.begin(bench.now)
    bench.engine.tasks.fail(task, "envelope.reserve", "c1: 12 % left")
    bench.engine._settle()


def test_after_an_abort_it_runs_before_on_abort() -> None:
    bench, task = moving()

    bench.abort(task)
    bench.run_for(0.2)
    assert [cleanup.state for cleanup in bench.task(task).ending.cleanups] == ["waiting"]
    confirm(bench)
    assert bench.cart.goal.action == "Home"
    assert told(bench) == ["tidy"]
    settle(bench)

    assert bench.end(task) == ("CANCELED", "aborted")
    assert told(bench) == ["tidy", "tidied", "on_abort"]
    assert bench.task(task).ending.cleanups == ()


def test_a_breach_skips_it_and_stops_one_that_runs() -> None:
    bench, task = moving()
    breach(bench, task)
    assert bench.task(task).ending.cleanups == ()

    bench, task = moving()
    bench.abort(task)
    bench.run_for(0.2)
    confirm(bench)
    breach(bench, task)
    assert [cleanup.state for cleanup in bench.task(task).ending.cleanups] == ["stopping"]
    assert told(bench) == ["tidy"]


def test_its_failure_is_a_note_of_the_task(wording: Wording) -> None:
    bench, task = moving()
    bench.abort(task)
    bench.run_for(0.2)
    confirm(bench)
    settle(bench, "fail")

    assert bench.end(task) == ("CANCELED", "aborted")
    wording(bench.task(task).outcome.notes)
    assert told(bench) == ["tidy", "on_abort"]


def test_it_is_found_again_in_a_snapshot() -> None:
    bench, task = moving()
    bench.abort(task)
    bench.run_for(0.2)
    waiting = reloaded(bench.engine.state)
    confirm(bench)
    running = reloaded(bench.engine.state)

    for shot, state, nodes in (
        (waiting, "waiting", {}),
        (running, "running", {"steps/steps[0]": "RUNNING", "steps/steps[0].finally[1]": "RUNNING"}),
    ):
        before = snapshot(shot)
        engine = Engine(*yard(), bench.engine.core.models, state=shot)
        (cleanup,) = engine.state.tasks[task].ending.cleanups
        assert (cleanup.state, engine.statuses(task)) == (state, nodes)
        assert snapshot(engine.state) == before
