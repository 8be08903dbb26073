"""People answer by their script, in order, after their time."""

from typing import Any

import pytest

from agents_sim.person import BadScriptError, read_rules, write_rules
from agents_sim.world import AgentSpec
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place
from tests.unit.agents_sim.conftest import World

LOADED = {"match": "loaded", "options": ["not_yet", "loaded"], "after": "4 s"}


def ask(world: World, question: str, options: list[str]) -> str:
    return world.order("picker_1", "Confirm", question=question, options=options, number=7)


def add(world: World, *script: dict[str, Any]) -> None:
    world.fleet.add(AgentSpec(id="picker_1", type="picker", at=Place(180.0, 90.0), script=script))


def test_scripted_answers_come_in_order_and_the_last_one_stays(world: World) -> None:
    add(world, LOADED)
    for expected in ("not_yet", "loaded", "loaded"):
        goal = ask(world, "Is it on board?", ["not_yet", "loaded"])
        world.run(4.0)
        event = world.end(goal)[1]
        assert event.state == "succeeded"
        assert event.result == {"answer": expected, "by": "picker_1", "at": world.clock.now()}


def test_a_clearance_is_given_after_a_while(world: World) -> None:
    add(world, LOADED)
    goal = ask(world, "Do people stand clear of hwd_1?", ["clear", "wait", "refuse"])
    world.run(2.9)
    assert [event.state for event in world.events(goal)] == ["accepted"]
    world.run(0.1)
    assert world.end(goal)[1].result["answer"] == "clear"


@pytest.mark.parametrize(
    ("options", "answer"), [(["no", "yes"], "yes"), (["left", "right"], "left"), (["later", "done"], "done")]
)
def test_without_a_rule_a_person_agrees(world: World, options: list[str], answer: str) -> None:
    add(world)
    goal = ask(world, "Well?", options)
    world.run(3.0)
    assert world.end(goal)[1].result["answer"] == answer


def test_never_is_never_and_a_withdrawn_question_is_forgotten(world: World) -> None:
    add(world, {"match": "clear", "never": True}, LOADED)
    silent = ask(world, "Is all clear?", ["yes", "no"])
    withdrawn = ask(world, "loaded?", ["not_yet", "loaded"])
    world.run(1.0)
    world.hub.transport.cancel_goal("picker_1", withdrawn)
    world.run(600.0)
    assert [event.state for event in world.events(silent)] == ["accepted"]
    assert world.end(withdrawn)[1].state == "canceled"


def test_several_questions_wait_side_by_side(world: World) -> None:
    add(world, {"match": "slow", "options": ["yes"], "after": 9}, {"options": ["yes"], "after": 2})
    slow, quick = ask(world, "slow?", ["yes"]), ask(world, "quick?", ["yes"])
    world.run(10.0)
    assert (world.end(quick)[0], world.end(slow)[0]) == (2.0, 9.0)


@pytest.mark.parametrize(
    "rule",
    [
        {"match": "x"},
        {"options": ["a"], "afterr": 1},
        {"options": ["a"], "after": "soon"},
        {"after": -1, "options": ["a"]},
    ],
)
def test_a_bad_script_is_refused(rule: dict[str, Any]) -> None:
    with pytest.raises(BadScriptError):
        read_rules([rule])


def test_rules_survive_being_written() -> None:
    rules = read_rules([LOADED, {"never": True}])
    assert read_rules(write_rules(rules)) == rules
    assert rules[0].after_us == 4 * SECOND


def test_a_rule_whose_answer_is_no_option_is_passed_over(world: World) -> None:
    add(world, {"options": ["yes"], "after": 1})
    goal = ask(world, "Do people stand clear?", ["clear", "wait", "refuse"])
    world.run(3.0)
    assert world.end(goal)[1].result["answer"] == "clear"
