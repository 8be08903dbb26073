"""A new version of a task reaches an engine that runs: new requests get it, running tasks keep theirs."""

import msgspec
import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import Approve, EngineStep, Operator, Serve, Submit
from formiga_bt.engine.kernel.library import Bundles
from formiga_bt.engine.kernel.records import Version
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.engine.kernel.state import EngineState, snapshot
from formiga_bt.lang.model import Task
from formiga_bt.rehearsal.testing import folded
from formiga_bt.safety.approval import approval_digest
from tests.golden import Wording
from tests.reloading import reloaded
from tests.unit.engine import yard as yards
from tests.unit.engine.conftest import Make
from tests.unit.engine.test_request import child, step, tasks
from tests.unit.engine.yard import CART, Yard

ONE = CART + "steps: [{do: cart.Rise}, {do: cart.Move}, {do: cart.Home}]"
TWO = CART + "steps: [{do: cart.Rise}, {do: cart.Park}]"
ASKS = "steps: [{request: Look}, {request: Look}]"


def task(text: str, name: str = "Try") -> Task:
    return tasks(**{name: text})[0]


def serve(yard: Yard, model: Task) -> Accepted | Done:
    yard.engine.core.models.add(model)
    return yard.ask(Serve(model.name, model.bundle, "eve"))


def versions(yard: Yard, name: str = "Try") -> list[tuple[int, int]]:
    return [(one.order, one.n) for one in yard.engine.state.library.get(name, ())]


def test_two_versions_run_side_by_side_each_to_its_own_end(make: Make) -> None:
    yard = make(task(ONE), carts=2)
    old = yard.start()
    assert serve(yard, task(TWO)) == Done()
    new = yard.start()
    assert [(yard.task(one).request.version, yard.task(one).request.library) for one in (old, new)] == [(1, 0), (2, 1)]

    step(yard, "Rise", 0)
    step(yard, "Rise", 1)
    step(yard, "Move", 0)
    step(yard, "Park", 1)
    step(yard, "Home", 0)

    assert yard.outcome(old) == yard.outcome(new) == ("SUCCEEDED", "")


def test_the_same_bundle_again_changes_nothing(make: Make) -> None:
    yard = make(task(ONE))
    assert serve(yard, task(ONE)) == Done()
    assert yard.engine.state.library == {}
    assert "library" not in yard.engine.state.counters


def test_a_name_that_was_not_served_can_be_requested_from_then_on(make: Make, wording: Wording) -> None:
    yard = make(task(ONE))
    with pytest.raises(TaskError) as refused:
        yard.submit("Late")
    wording(refused.value)
    serve(yard, task(TWO, "Late"))
    assert yard.task(yard.submit("Late")).request.version == 1
    with pytest.raises(TaskError, match="tasks: Late, Try"):
        yard.submit("Later")


def test_a_restart_goes_on_with_the_version_of_its_run(make: Make) -> None:
    yard = make(task(ONE))
    mine = yard.start()
    step(yard, "Rise")
    serve(yard, task(TWO))
    yard.ask(Operator("restart", mine, "eve"))
    yard.run_for(0.3)
    while yard.task(mine).run == 1:
        yard.cart.succeed()
        yard.run_for(0.5)

    assert (yard.task(mine).request.version, yard.task(mine).request.library) == (1, 0)
    for action in ("Rise", "Move", "Home"):
        step(yard, action)
    assert yard.outcome(mine) == ("SUCCEEDED", "")


def test_a_step_requests_the_version_of_the_time_of_its_own_request(make: Make) -> None:
    yard = make(*tasks(Try=ASKS, Look=ONE), carts=2)
    before = yard.start()
    serve(yard, task(TWO, "Look"))
    after = yard.start()
    for action in ("Rise", "Move", "Home"):
        step(yard, action)

    assert [child(yard, before, at).request.version for at in (0, 1)] == [1, 1]  # the second began after the change
    assert child(yard, after).request.version == 2


def test_a_step_gets_what_came_later_if_there_was_none_then(make: Make) -> None:
    both = tasks(Try=ASKS, Look=ONE)
    yard = make(both[0])
    mine = yard.engine.core.library
    parent = yard.submit("Try")
    assert mine.bundle_for("Look", yard.task(parent)) == ""
    serve(yard, both[1])
    serve(yard, task(TWO, "Look"))
    assert mine.bundle_for("Look", yard.task(parent)) == both[1].bundle


def test_a_request_may_name_the_bundle_that_it_means(make: Make, wording: Wording) -> None:
    yard = make(task(ONE), carts=2)
    serve(yard, task(TWO))
    mine = yard.submit("Try", bundle=task(ONE).bundle)
    assert yard.task(mine).request.version == 1
    with pytest.raises(TaskError) as refused:
        yard.ask(Submit("Try", bundle="abcdefab99"))
    wording(refused.value)


def test_a_bundle_without_a_model_is_refused(make: Make, wording: Wording) -> None:
    yard = make(task(ONE))
    with pytest.raises(TaskError) as refused:
        yard.ask(Serve("Try", "123456789"))
    wording(refused.value)


def test_versions_that_nobody_can_ask_for_any_more_are_forgotten(make: Make) -> None:
    yard = make(task(ONE), carts=1)
    texts = [f"{CART}steps: [{{do: cart.Rise}}, {{wait: {n} s}}, {{do: cart.Park}}]" for n in range(1, 4)]
    mine = yard.start()
    for text in texts:
        serve(yard, task(text))
    assert versions(yard) == [(0, 1), (1, 2), (2, 3), (3, 4)]  # an open task is of the first

    for action in ("Rise", "Move", "Home"):
        step(yard, action)
    assert yard.outcome(mine)[0] == "SUCCEEDED"
    serve(yard, task(TWO))
    assert versions(yard) == [(3, 4), (4, 5)]


def test_state_and_trees_come_back_from_a_snapshot_and_steps_fold_to_the_same_bytes(make: Make) -> None:
    yard = make(task(ONE), carts=2)
    old = yard.start()
    serve(yard, task(TWO))
    new = yard.start()
    step(yard, "Rise", 0)
    shot = snapshot(yard.engine.state)

    journal = msgspec.json.encode(yard.steps)
    assert snapshot(folded(msgspec.json.decode(journal, type=list[EngineStep]))) == shot
    again = Engine(*yards.yard(), Bundles([task(TWO), task(ONE)]), state=reloaded(yard.engine.state))
    assert snapshot(again.state) == shot
    assert again.statuses(old) == yard.engine.statuses(old) != {}
    assert again.statuses(new) == yard.engine.statuses(new) != {}
    assert again.core.library.wanted(Submit("Try")).bundle == task(TWO).bundle


def test_a_state_whose_models_are_not_there_is_not_gone_on_with(make: Make, wording: Wording) -> None:
    yard = make(task(ONE))
    yard.start()
    with pytest.raises(AssertionError) as refused:
        Engine(*yards.yard(), {"Try": task(TWO)}, state=reloaded(yard.engine.state))
    wording(refused.value)


def test_the_same_inputs_give_the_same_bytes() -> None:
    def steps() -> bytes:
        engine = Engine(*yards.yard(), Bundles([task(ONE)]))
        engine.core.models.add(task(TWO))  # type: ignore[attr-defined]
        given = [Submit("Try"), Serve("Try", task(TWO).bundle), Submit("Try"), Serve("Try", task(TWO).bundle)]
        return msgspec.json.encode([engine.handle(1, one) for one in given])

    assert steps() == steps()
    found, done = msgspec.json.decode(steps()), {"type": "Done", "kept": True}
    assert [one["reply"] for one in found] == [
        {"type": "Accepted", "task": f"Try-{n}"} if n else done for n in (1, 0, 2, 0)
    ]
    assert found[3]["changes"] == []


def test_on_a_real_site_a_new_version_is_served_and_not_flown_before_it_is_approved(
    make: Make, wording: Wording
) -> None:
    yard = make(task(ONE), mode="real")
    yard.ask(Approve(approval_digest(task(ONE), yard.engine.core.site), "Try", "ann"))
    yard.submit("Try", by="eve")
    serve(yard, task(TWO))
    with pytest.raises(TaskError) as refused:
        yard.submit("Try", by="eve")
    wording(refused.value)
    assert yard.task(yard.submit("Try", by="eve", bundle=task(ONE).bundle)).request.version == 1
    yard.ask(Approve(approval_digest(task(TWO), yard.engine.core.site), "Try", "ann"))
    assert yard.task(yard.submit("Try", by="eve")).request.version == 2


def test_the_state_says_which_versions_there_are(make: Make) -> None:
    yard = make(task(ONE))
    serve(yard, task(TWO))
    change = ch.LibraryPut("Try", (Version(0, 1, task(ONE).bundle), Version(1, 2, task(TWO).bundle)))
    state = EngineState(library={change.task: change.versions})
    assert reloaded(state).library == yard.engine.state.library
