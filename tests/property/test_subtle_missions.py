"""Missions at the edges of the rules, each with the end it must have: by the nodes, by the oracle, and in equal steps."""

import json
from typing import Any

import pytest

from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.tasks.treerun import CompiledTrees
from tests.oracle.naive import NaiveTrees
from tests.property.strategies import Mission, load
from tests.property.test_differential import assert_equal
from tests.property.world import Deed, Event, World

SLOW = Deed(after=9.0, cancel_after=2.0)
STUBBORN = Deed(after=9.0, cancel="refuse")
SILENT = Deed(end="never", cancel="never")
FAILS = Deed(end="failed")
LATE = Deed(after=3.0, cancel="refuse")
MOVE = {"do": "one.Move"}
NEVER = {"wait": "1 s", "when": "n == 7"}


def text_of(task: dict[str, Any]) -> str:
    head = {"formiga": 1, "task": "Subtle", "vars": {"n": "${0}"}, "agents": {"one": {"type": "cart"}}}
    return json.dumps({**head, **task}, indent=1)


CASES: dict[str, tuple[dict[str, Any], list[Deed], list[Event], str, str]] = {
    # name: task, deeds of the cart, events, status, code
    "instant failures are retried within one step": (
        {"steps": [{"sequence": [{"set": {"n": "${n + 1}"}}, {"check": "n == 3"}], "retry": {"attempts": 4}}]},
        [], [], "SUCCEEDED", "",
    ),
    "instant failures are retried only so often": (
        {"steps": [{"sequence": [{"set": {"n": "${n + 1}"}}, {"check": "n == 3"}], "retry": {"attempts": 2}}]},
        [], [], "FAILED", "check",
    ),
    "a sequence of skipped steps is skipped": (
        {"steps": [{"fallback": [{"sequence": [NEVER, NEVER]}, {"fail": "no", "code": "second"}]}]},
        [], [], "FAILED", "failed:second",
    ),
    "an if without a branch to take is skipped": (
        {"steps": [{"fallback": [{"if": "n == 7", "then": [MOVE]}, {"fail": "no", "code": "second"}]}]},
        [], [], "FAILED", "failed:second",
    ),
    "a fallback of skipped steps fails": (
        {"steps": [{"fallback": [{"check": "n == 7", "when": "n == 7"}, NEVER]}]},
        [], [], "FAILED", "nothing_applied",
    ),
    "error is the former child's failure": (
        {"steps": [{"fallback": [{**MOVE, "timeout": "1 s"}, {"check": "error.code == 'timeout'"}]}]},
        [SLOW], [], "SUCCEEDED", "",
    ),
    "work that is done while it is being canceled counts": (
        {"steps": [{**MOVE, "timeout": "1 s", "expect": "result.ok"}]},
        [LATE], [], "SUCCEEDED", "",
    ),
    "also when a retry lies between": (
        {"steps": [{**MOVE, "timeout": "1 s", "retry": {"attempts": 2, "attempt_timeout": "5 s"}}]},
        [LATE], [], "SUCCEEDED", "",
    ),
    "but not when the timeout is around a sequence": (
        {"steps": [{"sequence": [MOVE], "timeout": "1 s"}]},
        [LATE], [], "FAILED", "timeout",
    ),
    "a goal that ends at the very deadline counts": (
        {"steps": [{"sequence": [{**MOVE, "timeout": "2 s"}], "timeout": "2 s"}]},
        [Deed(after=2.0)], [], "SUCCEEDED", "",
    ),
    "what drains moves to the outer timeout": (
        {"steps": [{"sequence": [{**MOVE, "timeout": "1 s"}], "timeout": "2 s"}, {"wait": "1 s"}]},
        [Deed(after=9.0, cancel_after=4.0)], [], "FAILED", "timeout",
    ),
    "what drains moves through two timeouts to the task": (
        {"steps": [{"sequence": [{**MOVE, "timeout": "1 s"}], "timeout": "2 s"}], "on_abort": [{"wait": "1 s"}]},
        [Deed(after=9.0, cancel_after=5.0)], [Event(4.0, "abort")], "CANCELED", "aborted",
    ),
    "a cancel that is never confirmed ends in doubt": (
        {"steps": [{**MOVE, "timeout": "1 s", "retry": {"attempts": 3}}]},
        [SILENT], [], "FAILED", "cancel_unconfirmed",
    ),
    "a refused cancel waits for the natural end": (
        {"steps": [{"fallback": [{"sequence": [MOVE], "timeout": "1 s"}, {"check": "error.code == 'timeout'"}]}]},
        [Deed(after=4.0, cancel="refuse")], [], "SUCCEEDED", "",
    ),
    "an action that may not be repeated is not tried again": (
        {"steps": [{"fallback": [{"do": "one.Haul"}, {"check": "error.code == 'failed:stuck'"}]}]},
        [FAILS], [], "SUCCEEDED", "",
    ),
    "an abort during the delay of a retry": (
        {"steps": [{**MOVE, "retry": {"attempts": 3, "delay": "5 s"}}], "finally": [{"wait": "1 s"}]},
        [FAILS], [Event(4.0, "abort")], "CANCELED", "aborted",
    ),
    "nested calls keep their names apart": (
        {
            "steps": [{"call": "Outer", "with": {"n": 1}, "save_as": "got"}, {"check": "got == 12"}],
            "subtrees": {
                "Outer": {
                    "params": {"n": "int"},
                    "steps": [{"call": "Inner", "with": {"n": "${n + 1}"}, "save_as": "inner"}],
                    "returns": "${n * 10 + inner}",
                },
                "Inner": {"params": {"n": "int"}, "steps": [{"wait": "1 s"}], "returns": "${n}"},
            },
        },
        [], [], "SUCCEEDED", "",
    ),
    "a call that is stopped forgets its names": (
        {
            "steps": [{"call": "Slow", "with": {"cart": "${one}"}, "timeout": "1 s", "retry": {"attempts": 2}}],
            "subtrees": {"Slow": {"params": {"cart": "agent"}, "steps": [{"do": "cart.Move"}]}},
        },
        [SLOW, SLOW], [], "FAILED", "timeout",
    ),
    "a pilot takes the machine and gives it back": (
        {"steps": [{"fallback": [{**MOVE, "retry": {"attempts": 3}}, {"check": "error.code == 'taken_over'"}]}]},
        [SLOW], [Event(3.0, "take_over", "c1"), Event(6.0, "hand_back", "c1")], "SUCCEEDED", "",
    ),
    "a timeout stands still while a pilot flies": (
        {"steps": [{**MOVE, "timeout": "4 s"}]},
        [SLOW], [Event(3.0, "take_over", "c1"), Event(16.0, "hand_back", "c1")], "FAILED", "taken_over",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_it_ends_as_it_must(name: str) -> None:
    task, deeds, events, status, code = CASES[name]
    text = text_of(task)
    model = load(text)
    assert model is not None, text
    mission = Mission((text,), {"c1": tuple(deeds)}, (Event(1.0, "submit", "Subtle"), *events))
    ours, theirs, ticked = (
        World([model], mission.deeds, mission.events, trees=trees)
        for trees in (CompiledTrees, NaiveTrees, lambda host: CompiledTrees(host, tick=True))
    )
    for world in (ours, theirs, ticked):
        world.run(60.0)
    record = ours.engine.state.tasks["Subtle-1"]
    assert (record.status, record.outcome.code) == (status, code), record
    assert_equal(ours, theirs, mission)
    assert ours.steps == ticked.steps


def test_a_goal_that_is_stopped_in_the_step_that_sends_it_never_leaves() -> None:
    task = {"steps": [{"sequence": [{"wait": "2 s"}, MOVE], "timeout": "2 s"}]}
    model = load(text_of(task))
    assert model is not None
    world = World([model], {}, [Event(1.0, "submit", "Subtle")])
    world.run(30.0)
    sent = [e for s in world.steps for e in s.effects if isinstance(e, inp.SendGoal | inp.CancelGoal)]
    # The outer deadline was set first, so it fires first: the wait never ends and the goal is never ordered.
    assert sent == []
    assert world.engine.state.tasks["Subtle-1"].outcome.code == "timeout"


def test_a_task_that_visits_too_many_nodes_in_one_step_fails() -> None:
    steps = [{"sequence": [{"check": "n == 1"}], "retry": {"attempts": 1000}, "ignore_failure": True}] * 8
    model = load(text_of({"steps": steps}))
    assert model is not None
    world = World([model], {}, [Event(1.0, "submit", "Subtle")])
    world.run(30.0)
    assert world.engine.state.tasks["Subtle-1"].outcome.code == "runaway"
