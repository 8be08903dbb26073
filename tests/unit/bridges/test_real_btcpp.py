"""Exported trees in the real BehaviorTree.CPP: they load, and small ones come to the same end as here.

Needs `pip install -e ".[btcpp]"`. Its `Sleep` node is never run.
"""

import json
from pathlib import Path
from random import Random
from typing import Any

import pytest

from formiga_bt.bridges.btcpp_out import export_btcpp
from formiga_bt.cli.inputs import CheckWorld, find_tasks, read_task
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.lang.loader import load_task_text
from tests.property.strategies import task_text
from tests.property.world import CARTS, Deed, Event, yard
from tests.property.world import World as Yard
from tests.unit.bridges.conftest import ROOT
from tests.unit.bridges.real import load

pytestmark = pytest.mark.external

FILES = [*find_tasks([ROOT / "trees"]).tasks, ROOT / "tests/unit/bridges/everything.yaml"]


@pytest.fixture(autouse=True, scope="module")
def real_btcpp() -> None:
    pytest.importorskip("behaviortreepy")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_btcpp_loads_what_is_exported(path: Path, world: CheckWorld) -> None:
    read = read_task(path, world)
    assert read.task is not None
    tree, _factory = load(export_btcpp(read.task, world.catalogue, read.sources).xml, lambda _tag, _name: True)
    assert tree.root_node().name() == read.task.name


def test_btcpp_loads_random_trees() -> None:
    site, catalogue = yard()
    loaded = 0
    for seed in range(120):
        read = load_task_text(task_text(Random(seed)), "random.yaml", catalogue=catalogue, site=site, library=[])
        if read.task is not None:
            load(export_btcpp(read.task, catalogue, read.sources).xml, lambda _tag, _name: True)
            loaded += 1
    assert loaded > 30


KINDS = ("do", "do", "sequence", "fallback", "parallel", "if", "switch", "repeat", "check")


class Draft:
    """Draws trees of what the two have in common, of steps that end at once or are ordered of one agent after another."""

    def __init__(self, seed: int) -> None:
        self.dice = Random(seed)
        self.count = 0

    def do(self, role: str) -> dict[str, Any]:
        self.count += 1
        return {"do": f"{role}.Move", "name": f"{role} {self.count}"}

    def step(self, depth: int, role: str = "") -> dict[str, Any]:
        dice = self.dice
        kind = dice.choice(
            ["do", "do", "sequence", "fallback", "parallel", "if", "switch", "repeat", "check"][: 9 if depth else 2]
        )
        who = role or dice.choice(["one", "two"])
        step: dict[str, Any]
        match kind:
            case "sequence" | "fallback":
                step = {kind: self.steps(depth - 1, role)}
            case "parallel" if not role:
                need = dice.choice(["all", "any"])
                step = {kind: [self.step(depth - 1, one) for one in ("one", "two")]}
                if need == "any":
                    step = {"sequence": [step]}
            case "if":
                step = {"if": dice.choice(["yes", "not yes", "n > 2", "n < 2"]), "then": self.steps(depth - 1, role)}
                if dice.random() < 0.5:
                    step["else"] = self.steps(depth - 1, role)
            case "switch":
                cases = {"red": self.steps(depth - 1, role), "blue": self.steps(depth - 1, role)}
                step = {"switch": "colour", "cases": cases}
                if dice.random() < 0.5:
                    step["default"] = self.steps(depth - 1, role)
                else:
                    cases["green"] = self.steps(depth - 1, role)
            case "repeat":
                step = {"repeat": "2", "steps": [self.do(who), *self.steps(depth - 1, role)]}
            case "check":
                step = {"check": dice.choice(["yes", "n == 3", "n < 2 or not yes"])}
            case _:
                step = self.do(who)
        if dice.random() < 0.25:
            step["when"] = dice.choice(["yes", "not yes", "n == 3 and yes", "colour == 'blue'"])
        if dice.random() < 0.2:
            step["ignore_failure"] = True
        if dice.random() < 0.2:
            step["retry"] = {"attempts": dice.choice([2, 3])}
        return step

    def steps(self, depth: int, role: str) -> list[dict[str, Any]]:
        return [self.step(max(0, depth), role) for _ in range(self.dice.randint(1, 3))]

    def text(self) -> str:
        task: dict[str, Any] = {
            "formiga": 1,
            "task": "Small",
            "params": {
                "yes": {"type": "bool", "default": True},
                "n": {"type": "int", "default": 3},
                "colour": {"type": "enum", "values": ["red", "green", "blue"], "default": "blue"},
            },
            "agents": {"one": {"type": "cart"}, "two": {"type": "cart"}},
            "steps": [self.do("one"), *self.steps(3, ""), self.do("two")],
        }
        if self.dice.random() < 0.3:
            task["on_failure"] = [self.do("one")]
        return json.dumps(task, indent=1)


def by_btcpp(xml: str, ends: list[bool]) -> tuple[bool, dict[str, list[str]]]:
    """Return whether BT.CPP's tree succeeds, and the names of the actions by role."""
    done: dict[str, list[str]] = {"one": [], "two": []}

    def act(tag: str, name: str) -> bool:
        if tag != "Move":
            return True
        role = name.split()[0]
        done[role].append(name)
        return ends[(len(done[role]) - 1) % len(ends)]

    tree, _factory = load(xml, act)
    board = tree.root_blackboard()
    board.set_bool("yes", True)
    board.set_int("n", 3)
    board.set_string("colour", "blue")
    return tree.tick_while_running().name == "SUCCESS", done


def by_us(task: Any, ends: list[bool]) -> tuple[bool, dict[str, list[str]]]:
    """Return whether our compiled tree succeeds, and the number of goals by role."""
    deeds = {
        one: [Deed(end="succeeded" if ends[i % len(ends)] else "failed", after=0.5) for i in range(300)]
        for one in CARTS
    }
    yard_ = Yard([task], deeds, [Event(1.0, "submit", "Small")])
    yard_.run()
    changes = [change for step in yard_.steps for change in step.changes]
    roles = {who[0]: role for c in changes if isinstance(c, ch.Granted) for role, who in c.roles.items()}
    goals = {c.goal.id: c.goal.agent for c in changes if isinstance(c, ch.GoalPut) and c.goal.action == "Move"}
    done = {role: [goal for goal, agent in goals.items() if roles[agent] == role] for role in ("one", "two")}
    return next(iter(yard_.engine.state.tasks.values())).outcome.status == "SUCCEEDED", done


@pytest.mark.parametrize("first", range(0, 200, 50))
def test_small_trees_end_as_in_btcpp_after_as_many_actions(first: int) -> None:
    site, catalogue = yard()
    compared = 0
    for seed in range(first, first + 50):
        read = load_task_text(Draft(seed).text(), "small.yaml", catalogue=catalogue, site=site, library=[])
        if read.task is None:
            continue
        dice = Random(seed)
        ends = [dice.random() < 0.7 for _ in range(12)]
        theirs = by_btcpp(export_btcpp(read.task, catalogue, read.sources).xml, ends)
        ours = by_us(read.task, ends)
        assert ours[0] == theirs[0], f"seed {seed}"
        assert {r: len(n) for r, n in ours[1].items()} == {r: len(n) for r, n in theirs[1].items()}, f"seed {seed}"
        compared += 1
    assert compared > 10
