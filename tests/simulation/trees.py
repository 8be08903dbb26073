"""Random trees of the simulation: short missions with all kinds of steps, on the ground and in the air.

Each ends by itself within two minutes if nothing goes wrong. What the checker refuses is drawn anew.
"""

import json
from functools import cache
from random import Random
from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.base.packaged import folder
from formiga_bt.lang.loader import load_site, load_task_text
from formiga_bt.lang.model import Resource, Site, Task
from formiga_bt.rehearsal.testing import packaged_task, packaged_world

TEN = (
    "move_task", "pick_up", "explore_region", "watch_dog_sos", "watch_dog_request", "circle", "triangle", "zig_zag",
    "patrol_and_escort", "delivery",
)  # fmt: skip
"""The ten missions of the paper."""
CHILDREN = ("move_task", "circle")
"""What random trees request."""
TREES = 300
"""So many random trees there are."""
MORE_TREES = 150
"""So many more, with rarer steps, have the numbers from `TREES` on."""
HELD_TREES = 90
"""So many more, with blocks that hold resources of the site, have the numbers after those."""
RELAY_TREES = 90
"""So many more, with blocks that go on when their drone is lost or low, have the numbers after those."""
RESOURCES: Final = {"lift": Resource("lift", 1), "bay": Resource("bay", 2)}
Step = dict[str, Any]


@cache
def ten_site() -> Site:
    """Return the site of the ten missions."""
    site, found, _ = load_site(folder("trees") / "ten-site.yaml")
    assert site is not None, found
    return replace(site, resources=RESOURCES)


@cache
def task_of(name: str) -> Task:
    """Return a task: a file of the ten missions, or `Tree<n>`."""
    return packaged_task(name) if name in TEN else _drawn(int(name.removeprefix("Tree")))


def _drawn(number: int) -> Task:
    _, catalogue = packaged_world()
    for attempt in range(100):
        drawing = next(one for end, one in _DRAWINGS.items() if number < end)
        text = json.dumps(drawing(Random(f"tree/{number}/{attempt}")).task(f"Tree{number}"), indent=1)
        loaded = load_task_text(text, f"tree{number}.yaml", catalogue=catalogue, site=ten_site())
        if loaded.task is not None:
            return loaded.task
    raise AssertionError(f"no tree {number} passes the checker: {[str(one) for one in loaded.diagnostics]}")


class _Drawing:
    """One tree."""

    def __init__(self, dice: Random) -> None:
        self.dice = dice
        self.params: dict[str, Any] = {"to": "place", "other": "place", "n": {"type": "int", "default": 5}}
        self.agents: dict[str, Any] = {"watcher": {"type": "watcher"}, "picker": {"type": "picker"}}

    def task(self, name: str) -> dict[str, Any]:
        """Return the file of a task."""
        dice = self.dice
        match dice.choice(("ground", "ground", "air", "air", "block", "parent")):
            case "ground":
                steps = [self.still(2) for _ in range(dice.randint(1, 4))]
            case "air":
                self.agents["drone"] = self.role()
                steps = self.mission("drone")
            case "parent":
                steps = [self.still(1), self.request(), self.still(1)]
            case _:
                retry: Step = {"retry": {"attempts": 2, "delay": "3 s", **self.maybe(0.5, agent="another")}}
                block = {"with_agents": {"one": self.role()}, "steps": self.mission("one")}
                steps = [self.still(1), block | (retry if dice.random() < 0.5 else {})]
        task: dict[str, Any] = {
            "formiga": 1, "task": name, "imports": ["lib/flying.yaml"], "params": self.params, "agents": self.agents,
            "steps": steps,
        }  # fmt: skip
        for section in ("on_failure", "on_abort", "finally"):
            if dice.random() < 0.3:
                task[section] = [{"wait": f"{dice.randint(1, 5)} s"}, {"notify": section}]
        if dice.random() < 0.2:
            task["timeout"] = f"{dice.randint(20, 120)} s"
        if dice.random() < 0.15:
            task["if_preempted"] = "fail"
        return task

    def request(self) -> Step:
        """Return a step that requests another task."""
        dice = self.dice
        child: Step = dice.choice(
            ({"request": "MoveTask"}, {"request": "Circle", "with": {"center": "${to}", "points": 3}})
        )
        if dice.random() < 0.3:
            return {**child, "wait": False, "detached": dice.random() < 0.5}
        limit = f"{dice.randint(60, 200)} s"
        return {
            **child,
            "timeout": limit,
            "ignore_failure": True,
            **self.maybe(0.4, retry={"attempts": 2, "delay": "3 s"}),
        }

    def maybe(self, chance: float, **entry: Any) -> Step:
        """Return an entry, or nothing."""
        return entry if self.dice.random() < chance else {}

    def role(self) -> Step:
        """Return the role of one drone."""
        kinds = self.dice.choice(({"type": "hwd"}, {"type": "lwd"}, {"any_of": ["lwd", "hwd"]}))
        wait = f"{self.dice.randint(20, 300)} s"
        return {**kinds, "near": "${to}", **self.maybe(0.3, if_lost="rebind"), **self.maybe(0.3, wait=wait)}

    # -- on the ground -------------------------------------------------------------------------------------------------
    def still(self, depth: int) -> Step:
        """Return a step in which nothing flies."""
        dice = self.dice
        kinds = ["wait", "ask", "notify", "hear"]
        if depth:
            kinds += ["sequence", "fallback", "parallel", "repeat", "guard", "if", "race", "retry"]
        kind = dice.choice(kinds)
        below = [self.still(depth - 1) for _ in range(dice.randint(1, 2))] if depth else []
        return self.leaf(kind) or self.composite(kind, below, f"n > {dice.randint(0, 9)}")

    def leaf(self, kind: str) -> Step | None:
        """Return a leaf that needs no drone."""
        dice = self.dice
        match kind:
            case "wait":
                return {"wait": f"{dice.randint(1, 12)} s"}
            case "ask":
                limit = f"{dice.randint(5, 30)} s"
                return {"ask": "Well?", "of": ["watcher"], "timeout": limit, **self.maybe(0.7, ignore_failure=True)}
            case "notify":
                return {"notify": "On the way."}
            case "hear":
                limit = f"{dice.randint(3, 15)} s"
                return {"wait_for": "picker.sos", "timeout": limit, "ignore_failure": True}
        return None

    def composite(self, kind: str, below: list[Step], condition: str) -> Step:
        """Return a composite over steps."""
        dice = self.dice
        match kind:
            case "sequence":
                return {"sequence": below, **self.maybe(0.5, **{"finally": [{"wait": "2 s"}]})}
            case "fallback":
                return {"fallback": [{"check": condition}, {"sequence": below}]}
            case "parallel" | "race":
                arms = [{"sequence": below}, {"wait": f"{dice.randint(1, 20)} s"}]
                return {"parallel": arms, "need": "any" if kind == "race" else "all"}
            case "repeat":
                return {"repeat": 2, "steps": [*below, {"wait": "1 s"}]}
            case "guard":
                return {"guard": condition, "steps": below, **self.maybe(0.8, ignore_failure=True)}
            case "retry":
                return {"sequence": below, "retry": {"attempts": 2, "delay": "2 s"}, "ignore_failure": True}
            case _:
                return {"if": condition, "then": below, "else": [{"wait": "2 s"}]}

    # -- in the air ----------------------------------------------------------------------------------------------------
    def mission(self, role: str) -> list[Step]:
        """Return a flight that begins at the port and ends there."""
        height = self.dice.choice((40, 60, 85))
        with_ = {"drone": f"${{{role}}}", "to": "${to}", "height": f"{height} m"}
        inside = [self.block(role, 2) for _ in range(self.dice.randint(0, 2))]
        home: Step = {"call": "ReturnHome", "with": {"drone": f"${{{role}}}"}}
        return [{"call": "FlyTo", "with": with_}, *inside, home]

    def block(self, role: str, depth: int) -> Step:
        """Return a step that begins and ends in the air."""
        dice = self.dice
        kinds = ["wait", "go", "go", "ask", "visit"]
        if depth:
            kinds += ["sequence", "fallback", "parallel", "race", "repeat", "guard", "if", "bounded"]
        kind = dice.choice(kinds)
        below = [self.block(role, depth - 1) for _ in range(dice.randint(1, 2))] if depth else []
        match kind:
            case "go":
                return self.go(role)
            case "visit":
                return {"sequence": self.visit(role)}
            case "bounded":
                return {**self.go(role), "timeout": f"{dice.randint(40, 90)} s"}
        return self.leaf(kind) or self.composite(kind, below, f"{role}.battery > {dice.randint(20, 90)} %")

    def go(self, role: str) -> Step:
        """Return a leg."""
        dice = self.dice
        spot, up = dice.choice(("to", "other")), dice.choice((30, 50, 75))
        at = f"${{offset(above({spot}, {up} m), east={dice.randint(-40, 40)} m, north={dice.randint(-40, 40)} m)}}"
        return {"do": f"{role}.GoTo", "with": {"to": at}, **self.maybe(0.3, retry={"attempts": 2, "delay": "2 s"})}

    def visit(self, role: str) -> list[Step]:
        """Return a landing away from ports and the start from there."""
        spot = self.dice.choice(("to", "other"))
        return [
            {"do": f"{role}.GoTo", "with": {"to": f"${{above({spot}, 40 m)}}"}},
            {"do": f"{role}.LandIn", "with": {"at": f"${{{spot}}}"}},
            {"wait": f"{self.dice.randint(1, 10)} s"},
            {"do": f"{role}.TakeOff"},
        ]


class _Rarer(_Drawing):
    """One tree of those with rarer steps: what is stopped has much to tidy up, and waits for keys."""

    def task(self, name: str) -> dict[str, Any]:
        """Return the file of a task."""
        dice = self.dice
        self.agents["drone"] = self.role()
        steps = self.mission("drone")
        if dice.random() < 0.5:
            steps = [{"sequence": steps, "finally": self.cleanup(dice.random() < 0.6)}]
        task: dict[str, Any] = {
            "formiga": 1, "task": name, "imports": ["lib/flying.yaml"], "params": self.params, "agents": self.agents,
            "steps": steps,
        }  # fmt: skip
        for section in ("on_failure", "on_abort", "finally"):
            if dice.random() < 0.5:
                task[section] = self.cleanup(dice.random() < 0.3)
        if dice.random() < 0.4:
            task["cleanup_timeout"] = f"{dice.randint(2, 12)} s"
        if dice.random() < 0.5:
            task["timeout"] = f"{dice.randint(10, 120)} s"
        return task

    def cleanup(self, flies: bool) -> list[Step]:
        """Return steps of a cleanup."""
        leg: Step = {"do": "drone.GoTo", "with": {"to": "${above(to, 50 m)}"}}
        return [{"wait": f"{self.dice.randint(2, 15)} s"}, *([leg] if flies else []), {"notify": "tidied up"}]

    def block(self, role: str, depth: int) -> Step:
        """Return a step that begins and ends in the air."""
        dice = self.dice
        match dice.choice(("as before", "until", "at once", "cut short")):
            case "until":
                condition = dice.choice((f"{role}.battery < {dice.randint(10, 95)} %", f"{role}.battery > 200 %"))
                return {"wait_until": condition, "timeout": f"{dice.randint(3, 25)} s", "ignore_failure": True}
            case "at once":  # the goal is wished for, and not any more, in one step
                return {"parallel": [self.go(role), {"notify": "Never mind."}], "need": "any"}
            case "cut short":
                cleanup: Step = {
                    "sequence": [self.go(role), self.go(role)],
                    "finally": self.cleanup(dice.random() < 0.5),
                }
                return {"parallel": [cleanup, {"wait": f"{dice.randint(1, 10)} s"}], "need": "any"}
        return super().block(role, depth)


class _Holding(_Drawing):
    """A tree whose steps, or a part of them, stand in a block with resources; some take both in opposite orders."""

    def task(self, name: str) -> dict[str, Any]:
        task = super().task(name)
        dice = self.dice
        first, second = dice.choice((("lift", "bay"), ("bay", "lift")))
        inside: Step = {"with_resource": second, "wait": f"{dice.randint(20, 120)} s", "steps": task["steps"]}
        before: Step = {
            "with_resource": first,
            "wait": f"{dice.randint(5, 60)} s",
            "steps": [{"wait": f"{dice.randint(1, 9)} s"}],
        }
        retry = self.maybe(0.3, retry={"attempts": 2, "delay": "3 s"})
        match dice.choice(("one", "nested", "both", "caught")):
            case "one":
                steps = [before, inside | retry]
            case "nested":
                steps = [{**before, "steps": [*before["steps"], inside]}]
            case "both":
                steps = [{**inside, "with_resource": ["lift", {"bay": dice.choice((1, 2))}]}]
            case _:
                steps = [{**before, "timeout": "30 s", "ignore_failure": True}, inside]
        return task | {"steps": steps}


class _Relay(_Drawing):
    """A tree that flies in a block, which fails when its drone is lost, or begins anew with another one at a charge."""

    def task(self, name: str) -> dict[str, Any]:
        task = super().task(name)
        dice = self.dice
        self.agents.pop("drone", None)
        late = dice.randint(60, 97)
        role = {**self.role(), "wait": f"{dice.randint(30, 120)} s"}
        role |= self.maybe(0.7, hand_over_at=f"{late} %", battery_min=f"{late + 2} %")
        role |= self.maybe(0.6, if_lost="fail_block")
        block: Step = {"with_agents": {"one": role}, "steps": self.mission("one")}
        block |= self.maybe(0.5, retry={"attempts": 2, "delay": "3 s", "agent": "another"})
        steps = dice.choice(([block], [{"fallback": [block, self.still(1)]}], [{**block, "timeout": "90 s"}]))
        return task | {"steps": [self.still(1), *steps]}


_DRAWINGS: Final = {
    TREES: _Drawing,
    TREES + MORE_TREES: _Rarer,
    TREES + MORE_TREES + HELD_TREES: _Holding,
    TREES + MORE_TREES + HELD_TREES + RELAY_TREES: _Relay,
}
"""Kinds of random trees, each with the number after its last one."""
