"""Random missions by seed: task files as YAML text, what the agents make of their goals, what happens meanwhile.

Not drawn by hypothesis: its examples of this size would nearly all be refused as too large, and the rest are small.
"""

import json
import os
import re
from collections.abc import Iterator
from functools import lru_cache
from random import Random
from time import time_ns
from typing import Any

from msgspec import Struct

from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Task
from tests.property.world import CARTS, PEOPLE, Deed, Event, yard

EXAMPLES = int(os.environ.get("FORMIGA_EXAMPLES", "0"))


HELPER = """\
formiga: 1
task: Helper
params: {n: {type: int, default: 1}}
agents: {aid: {type: cart, wait: 4 s}}
steps:
  - do: aid.Move
    with: {far: "${n + 1}"}
    expect: result.n > 0
  - do: aid.Home
on_abort:
  - notify: the helper stops
"""
"""A task that others request."""


class Mission(Struct, frozen=True):
    """All that decides a run."""

    texts: tuple[str, ...]
    deeds: dict[str, tuple[Deed, ...]]
    events: tuple[Event, ...]

    def tasks(self) -> list[Task]:
        """Return the checked tasks."""
        return [task for text in (*self.texts, HELPER) if (task := load(text)) is not None]


@lru_cache(maxsize=64)
def load(text: str) -> Task | None:
    """Return the checked task of a text; None if there are errors."""
    site, catalogue = yard()
    return load_task_text(
        text, "random.yaml", catalogue=catalogue, site=site, library=[], others={"Helper": HELPER}
    ).task


def why_refused(text: str) -> str:
    """Return the errors of a text that `load` refuses."""
    site, catalogue = yard()
    found = load_task_text(
        text, "random.yaml", catalogue=catalogue, site=site, library=[], others={"Helper": HELPER}
    ).diagnostics
    return "\n".join(f"{d.code} line {d.mark.line}: {d.message}" for d in found if d.code.startswith("E"))


SPANS = ("0.5 s", "1 s", "2 s", "3 s", "5 s")
CODES = ("stuck", "failed", "check", "timeout", "rejected", "agent_lost")


class Writer:
    """Draws the steps of one scope; remembers the names used there."""

    def __init__(
        self, dice: Random, carts: tuple[str, ...], people: tuple[str, ...], subtrees: tuple[str, ...]
    ) -> None:
        self.dice = dice
        self.carts = carts
        """Those that may be commanded here; `seen`: those whose fields may be read."""
        self.seen = carts
        self.people = people
        self.subtrees = subtrees
        self.saved = 0
        self.errors = 0
        self.carries = False
        """Whether the failure that `error` names may carry `n`."""
        self.hauling: tuple[str, ...] = ()
        """Subtrees with an action that may not be repeated."""
        self.inside = "cart" in carts
        """In a subtree: its params cannot be set."""
        self.may_set = not self.inside
        """Not in a second parallel branch, nor in a parallel `for`."""
        self.rounds: list[str] = []
        """Names of the loops around, for numbers."""
        self.may_leave = False
        """A `break_if` is allowed here."""
        self.gone: set[int] = set()
        """Saved names that a parallel `for` keeps to itself."""
        self.loops = 0
        self.blocks = 0
        """How many `with_agents` and requests there are; none of those stands in a block, none of either in cleanup."""
        self.may_want = True
        self.wanting: tuple[str, ...] = ()
        """Subtrees with a `with_agents`, a `with_resource` or a request."""
        self.free: tuple[str, ...] = ("lift", "bay")
        """Resources that a block may take here: inside one only those after it, and none in cleanup."""

    def pick(self, *things: Any) -> Any:
        return self.dice.choice(things)

    def chance(self, percent: int) -> bool:
        return bool(self.dice.randint(0, 99) >= 100 - percent)

    def cond(self) -> str:
        conds = ["n == 0", "n < 2", "n != 1", "flag", "not flag", f"{self.seen[0]}.battery > 50 %"]
        conds += [f"{self.seen[0]}.airborne", f"not {self.seen[-1]}.airborne", "10 // (n - 2) > 3"]
        conds += ["len(fleet('cart')) == 3", "first(fleet('cart')).airborne"]
        conds += [f"{name} < 2" for name in self.rounds]
        if not self.inside:
            conds += ["is_set(kept)", "is_set(kept) and kept < 2", "is_set(best) and best.n < 2 and best.ok"]
        if self.errors:
            conds += ["error.code == 'timeout'", "error.code != 'check'"]
        if self.carries:
            conds += ["is_set(error.data.n) and error.data.n > 1", "not is_set(error.data.n)"]
        return str(self.pick(*conds))

    def live(self) -> str:
        """Draw a condition that is watched: of agents, of names set in another branch, of `now`."""
        one = self.pick(*self.seen)
        conds = ["n > 0", "n > 1", "n != 1", "flag", "not flag", f"{one}.battery > 50 %", f"{one}.battery <= 50 %"]
        conds += [f"{one}.battery > 50 %", f"{one}.airborne", f"not {one}.airborne", "n > 0 or flag"]
        conds += [f"distance(ground({one}.position), base) < 100 m", f"{one}.battery > 50 % and not flag"]
        conds += ["len(fleet('cart')) > 2", "nearest(base, fleet('cart')).battery > 50 %", f"{one} in fleet('cart')"]
        if not self.inside:
            conds += [
                "now < t5",
                "now > t5",
                "now >= t9",
                "now - t5 > 3 s",
                "now > t5 and now < t9",
                "now > t9 or flag",
                "now > today('13:46:45')",
                "now < today('13:46:49') + 1 s",
                "now > sunrise(base) and now < today('13:46:48')",
            ]
        return str(self.pick(*conds))

    def within(self, depth: int, most: int = 2, **changed: Any) -> list[dict[str, Any]]:
        """Draw steps with other limits than here."""
        kept = {name: getattr(self, name) for name in changed}
        self.__dict__.update(changed)
        steps = self.steps(depth, most)
        self.__dict__.update(kept)
        return steps

    def save(self) -> str:
        self.saved += 1
        return f"s{self.saved}"

    def uses(self) -> list[dict[str, Any]]:
        """Return steps that read every saved name, as the checker wants it."""
        return [
            {"notify": f"there is s{i}", "when": f"is_set(s{i})"}
            for i in range(1, self.saved + 1)
            if i not in self.gone
        ]

    def steps(self, depth: int, most: int = 3) -> list[dict[str, Any]]:
        return [self.step(depth) for _ in range(self.dice.randint(1, most))]

    def fallible(self, depth: int) -> dict[str, Any]:
        """Draw a step that can fail: after another one the checker refuses the next child of a fallback."""
        step = self.step(depth)
        step.pop("ignore_failure", None)
        kind = next(iter(step))
        if kind in ("wait", "set", "notify", "repeat", "while", "for") and "timeout" not in step:
            return self._check(depth)
        return step

    def step(self, depth: int) -> dict[str, Any]:
        leaves = ("do", "do", "do", "do", "ask", "wait", "wait", "check", "set", "notify", "fail")
        leaves = (*leaves, "wait_until", "wait_until", "wait_for", *(["break_if"] * 4 if self.may_leave else []))
        blocks = (
            "sequence",
            "fallback",
            "fallback",
            "if",
            "switch",
            "sequence",
            "call",
            "guard",
            "guard",
            "parallel",
            "parallel",
            "race",
        )
        blocks = (
            *blocks,
            "reactive",
            "reactive",
            "cleanup",
            "while",
            "repeat",
            "repeat",
            "for",
            "for",
            "for_all",
            "for_all",
            *(["with_agents"] * 3 if self.may_want else []),
            *(["with_resource"] * 3 if self.free else []),
        )
        leaves = (*leaves, *(["request"] if self.may_want else []))
        kind = self.pick(*(leaves if depth <= 0 else (*leaves, *blocks)))
        if kind == "call" and not (self.callable() and self.carts):
            kind = "wait"
        if kind == "wait_for" and not self.carts:
            kind = "wait"
        if (kind == "set" and not self.may_set) or (kind == "do" and not self.carts):
            kind = "wait"
        step: dict[str, Any] = getattr(self, f"_{kind}")(depth)
        self.modify(step, kind)
        return step

    def modify(self, step: dict[str, Any], kind: str) -> None:
        if self.chance(20):
            step["when"] = self.cond()
        if self.chance(15):
            step["ignore_failure"] = True
        instant = kind in ("check", "set", "notify", "fail", "break_if")
        if kind in ("ask", "wait_until", "wait_for") or (not instant and self.chance(35)):
            step["timeout"] = self.dice.choice(SPANS)
        by_another = self.hauls_alone(step)
        repeatable = by_another or not self.hauls(step)  # else the checker refuses
        if kind not in ("set", "notify", "break_if") and repeatable and self.chance(30):
            retry: dict[str, Any] = {"attempts": self.pick(2, 3, 4)}
            if self.chance(60):
                retry["delay"] = self.dice.choice(SPANS)
                if self.chance(40):
                    retry["backoff"] = 2
            if by_another or ('"with_agents"' in json.dumps(step) and self.chance(60)):
                retry["agent"] = "another"
            if not instant and self.chance(50):
                retry["attempt_timeout"] = self.dice.choice(SPANS)
            if self.chance(15):
                retry[self.dice.choice(("on", "unless"))] = self.dice.sample(CODES, 2)
            step["retry"] = retry

    def hauls_alone(self, step: Any) -> bool:
        """Return whether only the machines of a block order, in it, what one machine may not do twice."""
        own = {*step.get("with_agents", ()), *(f"lent{name[4:]}" for name in step.get("with_agents", ()))}
        text = json.dumps(step)
        hauling = set(re.findall(r"(\w+)\.Haul", text))
        return bool(hauling) and hauling <= own and not any(f'"{name}"' in text for name in self.hauling)

    def hauls(self, step: Any) -> bool:
        text = json.dumps(step)
        return ".Haul" in text or any(f'"{name}"' in text for name in self.hauling)

    def _do(self, depth: int) -> dict[str, Any]:
        action = self.pick("Move", "Move", "Move", "Haul", "Home")
        step: dict[str, Any] = {"do": f"{self.pick(*self.carts)}.{action}"}
        if action == "Move" and self.chance(30):
            step["with"] = {"far": "${n + 1}"}
        if action == "Move" and self.chance(25):
            seen = self.pick(*self.seen)
            far = [f"${{1 if {seen}.battery > 50 % else 2}}", f"${{1 if {seen}.airborne else 10 // (n - 2)}}"]
            far += ["${n + 1}"] if not self.inside else []
            step |= {"with": {"far": self.pick(*far)}, "track": {"every": self.pick("0.5 s", "1 s", "3 s")}}
        if action in ("Move", "Haul"):
            if self.chance(25):
                step["expect"] = self.pick("result.ok", "result.n > 1", "10 // result.n > 2")
            if self.chance(25):
                step["save_as"] = self.save()
        return step

    def _ask(self, depth: int) -> dict[str, Any]:
        of = [self.pick(*self.people)] if self.chance(50) else [*self.people, "watchers"]
        step: dict[str, Any] = {"ask": "Go on with ${n}?", "of": of, "options": ["yes", "no", "later"]}
        if self.chance(30):
            step["policy"] = "all"
        elif len(of) > 1 and self.chance(50):
            step["escalate_after"] = "1 s"
        if self.chance(40):
            step["expect"] = "result.answer == 'yes'"
        if self.chance(15):
            step["form"] = {"many": {"type": "int", "max": 10}}
            if step.get("policy") != "all" and self.chance(50):
                step["expect"] = "result.many > 1"
        if self.chance(20):
            step["save_as"] = self.save()
        return step

    def _wait(self, depth: int) -> dict[str, Any]:
        return {"wait": self.dice.choice(SPANS)}

    def _check(self, depth: int) -> dict[str, Any]:
        step = {"check": self.cond()}
        if self.chance(30):
            step["message"] = "n is ${n}"
        return step

    def _set(self, depth: int) -> dict[str, Any]:
        kept = {"kept": self.pick("${n}", None)}
        best = {"best": self.pick({"n": "${n}", "ok": "${flag}"}, {"n": 1, "ok": "true"}, None)}
        both = {"n": "${n + 1}", "flag": "${n > 0}"}
        return {"set": self.pick({"n": "${n + 1}"}, both, {"flag": "${not flag}"}, kept, best)}

    def _notify(self, depth: int) -> dict[str, Any]:
        return {"notify": "Here is ${n}", "severity": self.pick("info", "warning")}

    def _fail(self, depth: int) -> dict[str, Any]:
        step: dict[str, Any] = {"fail": "gave up at ${n}", "when": self.cond()}
        if self.chance(50):
            step["code"] = "gave_up"
        if self.chance(50):
            step["with"] = {"n": "${n + 1}"}
        return step

    def _sequence(self, depth: int) -> dict[str, Any]:
        return {"sequence": self.steps(depth - 1)}

    def _fallback(self, depth: int) -> dict[str, Any]:
        leave, self.may_leave = self.may_leave, False
        carries = self.carries
        steps = [self.fallible(depth - 1)]
        self.errors += 1
        self.carries = '"with": {"n": "${n + 1}"}' in json.dumps(steps)
        steps += [self.fallible(depth - 1) for _ in range(self.dice.randint(0, 1))]
        steps.append(self.step(depth - 1))
        self.errors -= 1
        self.carries = carries
        self.may_leave = leave
        return {"fallback": steps}

    def _reactive(self, depth: int) -> dict[str, Any]:
        kind = self.pick("sequence", "fallback")
        leave, self.may_leave = self.may_leave, self.may_leave and kind == "sequence"
        steps = []
        for index in range(self.dice.randint(1, 2)):
            cond = "error.code == 'check'" if kind == "fallback" and index and self.chance(30) else self.live()
            steps.append({"check": cond, **({"message": "n is ${n}"} if self.chance(30) else {})})
        steps.append(self.step(depth - 1))
        self.may_leave = leave
        return {kind: steps, "reactive": True}

    def _cleanup(self, depth: int) -> dict[str, Any]:
        steps = self.steps(depth - 1)
        return {"sequence": steps, "finally": self.within(depth - 1, may_leave=False, may_want=False, free=())}

    def _guard(self, depth: int) -> dict[str, Any]:
        return {"guard": self.live(), "steps": self.steps(depth - 1)}

    def _wait_until(self, depth: int) -> dict[str, Any]:
        return {"wait_until": self.live()}

    def _wait_for(self, depth: int) -> dict[str, Any]:
        step: dict[str, Any] = {
            "wait_for": f"{self.pick(*(self.carts or ('one',)))}.{self.pick('ping', 'ping', 'pong')}"
        }
        if not self.inside or self.carts:
            step["since"] = self.pick("step", "task")
        if step["wait_for"].endswith("ping") and self.chance(30):
            step["save_as"] = self.save()
        return step

    def _break_if(self, depth: int) -> dict[str, Any]:
        return {"break_if": self.cond()}

    def _parallel(self, depth: int) -> dict[str, Any]:
        branches: list[dict[str, Any]] = []
        carts = list(self.carts)
        writer = self.dice.randint(0, 2)
        for index in range(self.dice.randint(2, 3)):
            mine = (carts.pop(0),) if carts else ()
            limits = {"carts": mine, "may_leave": False, "may_set": self.may_set and index == writer}
            (branch,) = self.within(depth - 1, 1, **limits)
            branches.append(branch)
        return {"parallel": branches, **self.needs(len(branches), "any")}

    def _race(self, depth: int) -> dict[str, Any]:
        return {"race": self._parallel(depth)["parallel"]}

    def needs(self, most: int, *words: str) -> dict[str, Any]:
        found: dict[str, Any] = {}
        if self.chance(60):
            found["need"] = self.pick(*words, *range(1, most + 1), "all")
        if self.chance(40):
            found["on_child_failure"] = self.pick("cancel", "finish")
        return found

    def _while(self, depth: int) -> dict[str, Any]:
        return {"while": self.cond(), **self.round(depth), "max": self.pick(2, 3, 6)}

    def _repeat(self, depth: int) -> dict[str, Any]:
        step = {"repeat": self.pick(1, 2, 3, "2 s", "4 s", "forever"), **self.round(depth)}
        if step["repeat"] == "forever":
            step["max"] = 5
            step["timeout"] = self.dice.choice(SPANS)
        elif self.chance(20):
            step["max"] = 2
        return step

    def round(self, depth: int) -> dict[str, Any]:
        step: dict[str, Any] = {
            "steps": [*self.within(depth - 1, 3, may_leave=True), {"wait": self.dice.choice(SPANS)}]
        }
        if self.chance(40):
            step["every"] = self.dice.choice(SPANS)
        if self.chance(40):
            step["until"] = self.cond()
        return step

    def _for(self, depth: int) -> dict[str, Any]:
        return self.over(depth, at_once=False)

    def _for_all(self, depth: int) -> dict[str, Any]:
        return self.over(depth, at_once=True)

    def over(self, depth: int, *, at_once: bool) -> dict[str, Any]:
        self.loops += 1
        number, cart = f"i{self.loops}", f"cart{self.loops}"
        lists: dict[str, Any] = {number: self.pick("${[1, 2]}", "${[0, 3]}", "${range(2)}")}
        changed: dict[str, Any] = {"may_leave": not at_once, "rounds": [*self.rounds, number]}
        if at_once:
            changed["may_set"] = False
            changed["carts"] = ()
        if len(self.carts) == 2 and self.chance(60):
            lists[cart] = f"${{[{', '.join(self.carts)}]}}"
            changed["carts"] = (cart,)
        before = self.saved
        steps = self.within(depth - 1, 3, **changed)
        saved = range(before + 1, self.saved + 1)
        step: dict[str, Any] = {"for": lists, "steps": steps, **self.needs(2)}
        if at_once:
            step["mode"] = "parallel"
            if self.chance(40):
                step["max_parallel"] = 1
            self.gone.update(saved)
        else:
            step.pop("on_child_failure", None)
        if saved and self.chance(70):
            name = self.pick(*saved)
            if at_once and self.chance(50):
                step = {key: value for key, value in step.items() if key not in ("need", "on_child_failure")}
                step["first"] = f"s{name}"
            else:
                step["collect"] = f"s{name}"
            self.gone.discard(name)
        return step

    def _request(self, depth: int) -> dict[str, Any]:
        self.blocks += 1
        step: dict[str, Any] = {"request": "Helper"}
        if self.chance(40):
            step["with"] = {"n": "${n}"}
        if self.chance(25):
            step["wait"] = False
        if self.chance(15):
            step["detached"] = True
        if self.chance(20):
            step["priority"] = self.pick("low", "high")
        if self.chance(25):
            step["save_as"] = self.save()
        return step

    def _with_agents(self, depth: int) -> dict[str, Any]:
        self.blocks += 1
        name, one = f"more{self.blocks}", f"lent{self.blocks}"
        role: dict[str, Any] = {"type": "cart", "wait": self.dice.choice((*SPANS, "20 s"))}
        if self.chance(40):
            role["if_lost"] = self.pick("rebind", "fail_block")
        if self.chance(30):
            role |= {"battery_min": "60 %", "hand_over_at": "50 %"}
        if self.chance(20):
            role["preempt"] = self.pick(True, False)
        if not self.chance(25):
            use = {"do": f"{name}.{self.pick('Move', 'Haul', 'Home')}"}
            steps = self.within(depth - 1, 3, carts=(*self.carts, name), may_want=False)
            steps.insert(self.dice.randint(0, len(steps)), use)
            return {"with_agents": {name: role}, "steps": steps}
        role["count"] = self.pick(1, "all", {"min": 1, "max": 2}, 2)
        inside = {"carts": (one,), "may_leave": False, "may_set": False, "may_want": False}
        before = self.saved
        steps = [{"do": f"{one}.Move"}, *self.within(depth - 1, 2, **inside)]
        self.gone.update(range(before + 1, self.saved + 1))
        return {
            "with_agents": {name: role},
            "steps": [{"for": {one: f"${{{name}}}"}, "mode": "parallel", "steps": steps}],
        }

    def _with_resource(self, depth: int) -> dict[str, Any]:
        self.blocks += 1
        first = self.pick(*self.free)
        claim = self.pick(first, [first], [*self.free], [{"bay": 2}] if "bay" in self.free else first)
        names = {
            name
            for one in ([claim] if isinstance(claim, str) else claim)
            for name in ([one] if isinstance(one, str) else one)
        }
        free = () if "bay" in names else ("bay",)
        steps = self.within(depth - 1, 3, may_want=False, free=free)
        return {"with_resource": claim, "wait": self.dice.choice((*SPANS, "20 s")), "steps": steps}

    def _if(self, depth: int) -> dict[str, Any]:
        step: dict[str, Any] = {"if": self.cond(), "then": self.steps(depth - 1, 2)}
        if self.chance(50):
            step["else"] = self.steps(depth - 1, 2)
        return step

    def _switch(self, depth: int) -> dict[str, Any]:
        if self.chance(40):
            on, cases = f"{self.pick(*self.seen)}.control", ["engine", "pilot", "failsafe", "unknown"]
        else:
            on, cases = self.pick("n", "n + 1", *self.rounds), ["0", "1", "2", "7"]
        taken = cases if on.endswith("control") and self.chance(50) else cases[: self.dice.randint(1, 3)]
        step: dict[str, Any] = {"switch": on, "cases": {case: self.steps(depth - 1, 2) for case in taken}}
        if taken != ["engine", "pilot", "failsafe", "unknown"]:
            step["default"] = self.steps(depth - 1, 2)
        return step

    def callable(self) -> tuple[str, ...]:
        may = self.may_want and len(self.free) == 2
        return tuple(name for name in self.subtrees if may or name not in self.wanting)

    def _call(self, depth: int) -> dict[str, Any]:
        name = self.pick(*self.callable())
        args: dict[str, Any] = {"cart": f"${{{self.pick(*self.carts)}}}", "who": f"${{{self.pick(*self.people)}}}"}
        if self.chance(60):
            args["n"] = "${n + 1}"
        step: dict[str, Any] = {"call": name, "with": args}
        if self.chance(40):
            step["save_as"] = self.save()
        return step


def task_text(dice: Random, name: str = "Random") -> str:
    """Draw a task file."""
    subtrees: dict[str, Any] = {}
    hauling: tuple[str, ...] = ()
    wanting: tuple[str, ...] = ()
    for index in range(dice.randint(0, 2)):
        inner = Writer(dice, ("cart",), ("who",), tuple(subtrees))
        inner.hauling, inner.wanting = hauling, wanting
        subtrees[f"Sub{index}"] = {
            "params": {
                "cart": "agent",
                "who": "agent",
                "n": {"type": "int", "default": 1},
                "flag": {"type": "bool", "default": True},
            },
            "steps": inner.steps(dice.randint(0, 2)) + inner.uses(),
            "returns": "${n}",
        }
        if inner.hauls(subtrees[f"Sub{index}"]):
            hauling = (*hauling, f"Sub{index}")
        if inner.blocks or any(f'"call": "{name}"' in json.dumps(subtrees[f"Sub{index}"]) for name in wanting):
            wanting = (*wanting, f"Sub{index}")
    writer = Writer(dice, ("one", "two"), ("ann",), tuple(subtrees))
    writer.hauling, writer.wanting = hauling, wanting
    task: dict[str, Any] = {
        "formiga": 1,
        "task": name,
        "records": {"pair": {"n": "int", "ok": "bool"}},
        "vars": {"n": "${0}", "flag": "${1 > 2}", "kept": {"type": "int"}, "best": {"type": "pair"}},
        "params": {
            "t5": {"type": "time", "default": "1970-01-12T13:46:45Z"},
            "t9": {"type": "time", "default": "1970-01-12T13:46:49Z"},
        },
        "agents": {"one": {"type": "cart"}, "two": {"type": "cart"}, "ann": {"type": "person"}},
    }
    if writer.chance(25):
        task["timeout"] = dice.choice(["4 s", "8 s", "20 s"])
    if writer.chance(25):
        task["cleanup_timeout"] = dice.choice(["2 s", "5 s"])
    task["steps"] = writer.steps(3, 4)
    if writer.chance(20):
        task["steps"].append({"parallel": [{"release": writer.pick("one", "two")}, {"wait": dice.choice(SPANS)}]})
    for section in ("on_failure", "on_abort", "finally"):
        if writer.chance(45):
            task[section] = writer.within(1, 2, may_want=False, free=())
    if writer.saved:
        task["finally"] = [*task.get("finally", ()), *writer.uses()]
    if subtrees:
        task["subtrees"] = subtrees
    return json.dumps(task, indent=1)


def block_text(dice: Random) -> str:
    """Draw a task of one long block, whose machine may be lost or replaced."""
    writer = Writer(dice, ("more",), ("ann",), ())
    writer.may_want = False
    role: dict[str, Any] = {
        "type": "cart",
        "wait": "20 s",
        "if_lost": dice.choice(("fail", "fail_block", "fail_block")),
    }
    if writer.chance(60):
        role |= {"battery_min": "60 %", "hand_over_at": "50 %"}
    steps = [{"do": "more.Haul", "ignore_failure": True}, *writer.steps(2, 2), {"wait": "30 s"}, *writer.uses()]
    block: dict[str, Any] = {"with_agents": {"more": role}, "steps": steps}
    if writer.chance(60):
        block["retry"] = {"attempts": 3, "agent": "another"}
    if writer.chance(30):
        block["timeout"] = "50 s"
    task: dict[str, Any] = {
        "formiga": 1,
        "task": "Random0",
        "records": {"pair": {"n": "int", "ok": "bool"}},
        "vars": {"n": "${0}", "flag": "${1 > 2}", "kept": {"type": "int"}, "best": {"type": "pair"}},
        "params": {
            "t5": {"type": "time", "default": "1970-01-12T13:46:45Z"},
            "t9": {"type": "time", "default": "1970-01-12T13:46:49Z"},
        },
        "agents": {"ann": {"type": "person"}},
        "steps": [{"fallback": [block, {"notify": "${error.code}"}]}],
    }
    return json.dumps(task, indent=1)


def block_mission(seed: int) -> Mission:
    """Return a mission whose machines are in the air and low a while, or fall silent, as its block runs."""
    dice = Random(seed)
    while load(text := block_text(dice)) is None:
        pass
    deeds = {one: tuple(deed(dice) for _ in range(dice.randint(0, 6))) for one in (*CARTS, *PEOPLE)}
    troubles = [Event(1.0, "submit", "Random0"), *events(dice)]
    for cart in CARTS:
        at = dice.randint(4, 40) / 2
        if dice.random() < 0.5:
            troubles += [Event(at, "rise", cart), Event(at + 1, "low", cart), Event(at + 9, "full", cart)]
        else:
            troubles.append(Event(at, "kill", cart))
    return Mission((text,), deeds, tuple(troubles))


def deed(dice: Random) -> Deed:
    """Draw what an agent makes of a goal."""
    return Deed(
        end=dice.choice(["succeeded"] * 6 + ["failed", "failed", "rejected", "never", "bad", "lost"]),
        after=dice.choice([0.0, 0.5, 1.0, 1.0, 2.0, 3.0, 4.0, 7.0]),
        ok=dice.choice([True, True, False]),
        n=dice.randint(0, 3),
        cancel=dice.choice(["confirm", "confirm", "at_once", "refuse", "never"]),
        cancel_after=dice.choice([0.0, 0.5, 1.0, 3.0]),
        follows=dice.choice(["", "", "", "not_now"]),
    )


FAULTS = ("abort", "abort", "now", "abandon", "kill", "freeze", "take_over", "take_over", "clear", "hold")
NEWS = ("ping", "ping", "ping", "pong", "low", "low", "full", "pulse", "pulse", "rise", "sink", "drift")


def events(dice: Random) -> list[Event]:
    """Draw what happens from outside."""
    found = [Event(dice.randint(2, 30) / 2, dice.choice(NEWS), dice.choice(CARTS)) for _ in range(dice.randint(0, 9))]
    for _ in range(dice.choice((0, 0, 1, 2, 3))):
        what, at, whom = dice.choice(FAULTS), dice.randint(0, 60) / 2, dice.choice(CARTS)
        if what == "hold":
            whom = "Random0-1"
        found.append(Event(at, what, whom))
        back = {"hold": "continue", "kill": "restart", "freeze": "thaw", "take_over": "hand_back"}.get(what)
        if back and dice.random() < 0.5:
            found.append(Event(at + dice.choice([0.0, 1.0, 4.0, 18.0, 40.0]), back, whom))
    return found


def mission(seed: int, tasks: int = 1) -> Mission:
    """Return the mission of a seed. A few drafts have steps that can never run, which the checker refuses."""
    dice = Random(seed)
    texts: list[str] = []
    while len(texts) < tasks:
        text = task_text(dice, f"Random{len(texts)}")
        if load(text) is not None:
            texts.append(text)
    deeds = {one: tuple(deed(dice) for _ in range(dice.randint(0, 6))) for one in (*CARTS, *PEOPLE)}
    submits = [Event(0.5 * dice.randint(0, 8) + 1.0, "submit", f"Random{i}") for i in range(tasks)]
    return Mission(tuple(texts), deeds, (*submits, *events(dice)))


def missions(number: int, first: int = 0, tasks: int = 1) -> Iterator[Mission]:
    """Iterate over the missions of so many seeds; with FORMIGA_EXAMPLES, of that many others."""
    if EXAMPLES:
        number, first = EXAMPLES, time_ns() % 2**40
    for seed in range(first, first + number):
        print("seed", seed)  # shown when a test fails
        yield mission(seed, tasks)
