"""Drawn trees: missions of one drone, put together at random from what a tree can do in the air and on the ground.

For the random fault runs. Each begins on the ground, ends by a flight home, and passes the checker; what the checker
refuses is drawn anew.
"""

import json
from functools import cache
from random import Random
from typing import Any

from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Task
from formiga_bt.rehearsal.testing import packaged_world

COUNT = 40
Step = dict[str, Any]


@cache
def drawn() -> tuple[Task, ...]:
    """Return the drawn tasks, `Drawn0` to `Drawn39`; each takes two places, `to` and `other`."""
    site, catalogue = packaged_world()
    found: list[Task] = []
    seed = 0
    while len(found) < COUNT:
        text = json.dumps(_task(Random(seed), f"Drawn{len(found)}"), indent=1)
        loaded = load_task_text(text, "drawn.yaml", catalogue=catalogue, site=site)
        seed += 1
        if loaded.task is not None:
            found.append(loaded.task)
    return tuple(found)


def _task(dice: Random, name: str) -> dict[str, Any]:
    kind = dice.choice(("hwd", "lwd"))
    role = {"type": kind, "near": "${to}", **({"if_lost": "rebind"} if dice.random() < 0.3 else {})}
    task: dict[str, Any] = {
        "formiga": 1, "task": name, "imports": ["lib/flying.yaml"], "params": {"to": "place", "other": "place"},
        "agents": {"drone": role, "watcher": {"type": "watcher"}}, "steps": _mission(dice, "drone"),
    }  # fmt: skip
    for section in ("on_failure", "on_abort", "finally"):
        if dice.random() < 0.4:
            task[section] = [{"wait": f"{dice.randint(1, 20)} s"}, {"notify": section}]
    if dice.random() < 0.3:
        task["timeout"] = f"{dice.randint(3, 12)} min"
    return task


def _mission(dice: Random, role: str) -> list[Step]:
    height = dice.choice((40, 60, 85, 110))
    fly = {"call": "FlyTo", "with": {"drone": f"${{{role}}}", "to": "${to}", "height": f"{height} m"}}
    inside = [_block(dice, role, 2) for _ in range(dice.randint(1, 5))]
    return [fly, *inside, {"call": "ReturnHome", "with": {"drone": f"${{{role}}}"}}]


def _block(dice: Random, role: str, depth: int) -> Step:
    """Return a step that begins and ends in the air."""
    kinds = ["wait", "go", "go", "ask", "visit"]
    if depth:
        kinds += ["sequence", "fallback", "parallel", "repeat", "guard", "if", "retry", "bounded"]
    kind = dice.choice(kinds)
    below = [_block(dice, role, depth - 1) for _ in range(dice.randint(1, 3))] if depth else []
    match kind:
        case "wait":
            return {"wait": f"{dice.randint(1, 40)} s"}
        case "go":
            return _go(dice, role)
        case "ask":
            return {"ask": "Well?", "of": ["watcher"], "timeout": f"{dice.randint(5, 60)} s", "ignore_failure": True}
        case "visit":
            return {"sequence": _visit(dice, role)}
        case "sequence":
            return {"sequence": below, **({"finally": [{"wait": "2 s"}]} if dice.random() < 0.5 else {})}
        case "fallback":
            return {"fallback": [{"check": f"{role}.battery > {dice.randint(20, 95)} %"}, {"sequence": below}]}
        case "parallel":
            return {
                "parallel": [{"sequence": below}, {"wait": f"{dice.randint(1, 60)} s"}],
                "need": dice.choice(["all", "any"]),
            }
        case "repeat":
            return {"repeat": dice.randint(2, 3), "steps": [*below, {"wait": "1 s"}]}
        case "guard":
            return {"guard": f"{role}.battery > {dice.randint(15, 60)} %", "steps": below}
        case "if":
            return {"if": f"{role}.battery > {dice.randint(30, 95)} %", "then": below, "else": [{"wait": "3 s"}]}
        case "retry":
            return {**_go(dice, role), "retry": {"attempts": 3, "delay": "2 s"}}
        case _:
            return {**_go(dice, role), "timeout": f"{dice.randint(60, 120)} s"}


def _go(dice: Random, role: str) -> Step:
    spot, up = dice.choice(("to", "other")), dice.choice((30, 50, 75, 100))
    east, north = dice.randint(-60, 60), dice.randint(-60, 60)
    return {"do": f"{role}.GoTo", "with": {"to": f"${{offset(above({spot}, {up} m), east={east} m, north={north} m)}}"}}


def _visit(dice: Random, role: str) -> list[Step]:
    spot = dice.choice(("to", "other"))
    over = {"do": f"{role}.GoTo", "with": {"to": f"${{above({spot}, {dice.choice((30, 50))} m)}}"}}
    return [
        over,
        {"do": f"{role}.LandIn", "with": {"at": f"${{{spot}}}"}},
        {"wait": f"{dice.randint(1, 30)} s"},
        {"do": f"{role}.TakeOff"},
    ]
