"""Random missions for hypothesis: task files as YAML text, what the agents make of their goals, what happens meanwhile."""

import json
from functools import lru_cache
from typing import Any

from hypothesis import assume
from hypothesis import strategies as st
from msgspec import Struct

from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Task
from tests.property.world import CARTS, PEOPLE, Deed, Event, yard


class Mission(Struct, frozen=True):
    """All that decides a run."""

    texts: tuple[str, ...]
    deeds: dict[str, tuple[Deed, ...]]
    events: tuple[Event, ...]

    def tasks(self) -> list[Task]:
        """Return the checked tasks."""
        return [task for text in self.texts if (task := load(text)) is not None]


@lru_cache(maxsize=64)
def load(text: str) -> Task | None:
    """Return the checked task of a text; None if there are errors."""
    site, catalogue = yard()
    return load_task_text(text, "random.yaml", catalogue=catalogue, site=site, library=[]).task


SPANS = st.sampled_from(["0.5 s", "1 s", "2 s", "3 s", "5 s"])


class Writer:
    """Draws the steps of one scope; remembers the names used there."""

    def __init__(self, draw: Any, carts: tuple[str, ...], people: tuple[str, ...], subtrees: tuple[str, ...]) -> None:
        self.draw = draw
        self.carts = carts
        self.people = people
        self.subtrees = subtrees
        self.saved = 0
        self.errors = 0
        self.hauling: tuple[str, ...] = ()
        """Subtrees with an action that may not be repeated."""
        self.inside = "cart" in carts
        """In a subtree: its params cannot be set."""

    def pick(self, *things: Any) -> Any:
        return self.draw(st.sampled_from(things))

    def chance(self, percent: int) -> bool:
        return bool(self.draw(st.integers(0, 99)) >= 100 - percent)

    def cond(self) -> str:
        conds = ["n == 0", "n < 2", "n != 1", "flag", "not flag", f"{self.carts[0]}.battery > 50 %"]
        conds += [f"{self.carts[0]}.airborne", f"not {self.carts[-1]}.airborne", "10 // (n - 2) > 3"]
        if self.errors:
            conds += ["error.code == 'timeout'", "error.code != 'check'"]
        return str(self.pick(*conds))

    def save(self) -> str:
        self.saved += 1
        return f"s{self.saved}"

    def uses(self) -> list[dict[str, Any]]:
        """Return steps that read every saved name, as the checker wants it."""
        return [{"notify": f"there is s{i}", "when": f"is_set(s{i})"} for i in range(1, self.saved + 1)]

    def steps(self, depth: int, most: int = 3) -> list[dict[str, Any]]:
        return [self.step(depth) for _ in range(self.draw(st.integers(1, most)))]

    def fallible(self, depth: int) -> dict[str, Any]:
        """Draw a step that can fail: after another one the checker refuses the next child of a fallback."""
        step = self.step(depth)
        step.pop("ignore_failure", None)
        kind = next(iter(step))
        if kind in ("wait", "set", "notify") and "timeout" not in step:
            return self._check(depth)
        return step

    def step(self, depth: int) -> dict[str, Any]:
        leaves = ("do", "do", "do", "do", "ask", "wait", "wait", "check", "set", "notify", "fail")
        kinds = leaves if depth <= 0 else (*leaves, "sequence", "fallback", "fallback", "if", "sequence", "call")
        kind = self.pick(*kinds)
        if (kind == "call" and not self.subtrees) or (kind == "set" and self.inside):
            kind = "do"
        step: dict[str, Any] = getattr(self, f"_{kind}")(depth)
        self.modify(step, kind)
        return step

    def modify(self, step: dict[str, Any], kind: str) -> None:
        if self.chance(20):
            step["when"] = self.cond()
        if self.chance(15):
            step["ignore_failure"] = True
        instant = kind in ("check", "set", "notify", "fail")
        if kind == "ask" or (not instant and self.chance(35)):
            step["timeout"] = self.draw(SPANS)
        repeatable = not self.hauls(step)  # else the checker refuses
        if kind not in ("set", "notify") and repeatable and self.chance(30):
            retry: dict[str, Any] = {"attempts": self.pick(2, 3, 4)}
            if self.chance(60):
                retry["delay"] = self.draw(SPANS)
                if self.chance(40):
                    retry["backoff"] = 2
            if not instant and self.chance(50):
                retry["attempt_timeout"] = self.draw(SPANS)
            step["retry"] = retry

    def hauls(self, step: Any) -> bool:
        text = json.dumps(step)
        return ".Haul" in text or any(f'"{name}"' in text for name in self.hauling)

    def _do(self, depth: int) -> dict[str, Any]:
        action = self.pick("Move", "Move", "Move", "Haul", "Home")
        step: dict[str, Any] = {"do": f"{self.pick(*self.carts)}.{action}"}
        if action == "Move" and self.chance(30):
            step["with"] = {"far": "${n + 1}"}
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
        if self.chance(20):
            step["save_as"] = self.save()
        return step

    def _wait(self, depth: int) -> dict[str, Any]:
        return {"wait": self.draw(SPANS)}

    def _check(self, depth: int) -> dict[str, Any]:
        step = {"check": self.cond()}
        if self.chance(30):
            step["message"] = "n is ${n}"
        return step

    def _set(self, depth: int) -> dict[str, Any]:
        return {"set": self.pick({"n": "${n + 1}"}, {"n": "${n + 1}", "flag": "${n > 0}"}, {"flag": "${not flag}"})}

    def _notify(self, depth: int) -> dict[str, Any]:
        return {"notify": "Here is ${n}", "severity": self.pick("info", "warning")}

    def _fail(self, depth: int) -> dict[str, Any]:
        step: dict[str, Any] = {"fail": "gave up at ${n}", "when": self.cond()}
        if self.chance(50):
            step["code"] = "gave_up"
        return step

    def _sequence(self, depth: int) -> dict[str, Any]:
        return {"sequence": self.steps(depth - 1)}

    def _fallback(self, depth: int) -> dict[str, Any]:
        steps = [self.fallible(depth - 1)]
        self.errors += 1
        steps += [self.fallible(depth - 1) for _ in range(self.draw(st.integers(0, 1)))]
        steps.append(self.step(depth - 1))
        self.errors -= 1
        return {"fallback": steps}

    def _if(self, depth: int) -> dict[str, Any]:
        step: dict[str, Any] = {"if": self.cond(), "then": self.steps(depth - 1, 2)}
        if self.chance(50):
            step["else"] = self.steps(depth - 1, 2)
        return step

    def _call(self, depth: int) -> dict[str, Any]:
        name = self.pick(*self.subtrees)
        args: dict[str, Any] = {"cart": f"${{{self.pick(*self.carts)}}}", "who": f"${{{self.pick(*self.people)}}}"}
        if self.chance(60):
            args["n"] = "${n + 1}"
        step: dict[str, Any] = {"call": name, "with": args}
        if self.chance(40):
            step["save_as"] = self.save()
        return step


@st.composite
def task_texts(draw: Any, name: str = "Random") -> str:
    """Draw a task file."""
    subtrees: dict[str, Any] = {}
    hauling: tuple[str, ...] = ()
    for index in range(draw(st.integers(0, 2))):
        inner = Writer(draw, ("cart",), ("who",), tuple(subtrees))
        inner.hauling = hauling
        subtrees[f"Sub{index}"] = {
            "params": {
                "cart": "agent",
                "who": "agent",
                "n": {"type": "int", "default": 1},
                "flag": {"type": "bool", "default": True},
            },
            "steps": inner.steps(draw(st.integers(0, 2))) + inner.uses(),
            "returns": "${n}",
        }
        if inner.hauls(subtrees[f"Sub{index}"]):
            hauling = (*hauling, f"Sub{index}")
    writer = Writer(draw, ("one", "two"), ("ann",), tuple(subtrees))
    writer.hauling = hauling
    task: dict[str, Any] = {
        "formiga": 1,
        "task": name,
        "vars": {"n": "${0}", "flag": "${1 > 2}"},
        "agents": {"one": {"type": "cart"}, "two": {"type": "cart"}, "ann": {"type": "person"}},
    }
    if writer.chance(25):
        task["timeout"] = draw(st.sampled_from(["4 s", "8 s", "20 s"]))
    if writer.chance(25):
        task["cleanup_timeout"] = draw(st.sampled_from(["2 s", "5 s"]))
    task["steps"] = writer.steps(3, 4)
    for section in ("on_failure", "on_abort", "finally"):
        if writer.chance(45):
            task[section] = writer.steps(1, 2)
    if writer.saved:
        task["finally"] = [*task.get("finally", ()), *writer.uses()]
    if subtrees:
        task["subtrees"] = subtrees
    text = json.dumps(task, indent=1)
    assume(load(text) is not None)  # a few have steps that can never run, which the checker refuses
    return text


DEEDS = st.builds(
    Deed,
    end=st.sampled_from(["succeeded"] * 6 + ["failed", "failed", "rejected", "never", "bad", "lost"]),
    after=st.sampled_from([0.0, 0.5, 1.0, 1.0, 2.0, 3.0, 4.0, 7.0]),
    ok=st.sampled_from([True, True, False]),
    n=st.integers(0, 3),
    cancel=st.sampled_from(["confirm", "confirm", "at_once", "refuse", "never"]),
    cancel_after=st.sampled_from([0.0, 0.5, 1.0, 3.0]),
)
MOMENTS = st.integers(0, 60).map(lambda half: half / 2)


@st.composite
def events(draw: Any) -> tuple[Event, ...]:
    """Draw what happens from outside; often nothing."""
    if draw(st.booleans()):
        return ()
    found = []
    for _ in range(draw(st.integers(1, 3))):
        what = draw(
            st.sampled_from(["abort", "abort", "now", "abandon", "kill", "freeze", "take_over", "take_over", "clear"])
        )
        at, whom = draw(MOMENTS), draw(st.sampled_from(CARTS))
        found.append(Event(at, what, whom))
        back = {"kill": "restart", "freeze": "thaw", "take_over": "hand_back"}.get(what)
        if back and draw(st.booleans()):
            found.append(Event(at + draw(st.sampled_from([0.0, 1.0, 4.0, 18.0, 40.0])), back, whom))
    return tuple(found)


@st.composite
def missions(draw: Any, tasks: int = 1) -> Mission:
    """Draw a mission of one task or more."""
    texts = tuple(draw(task_texts(f"Random{index}")) for index in range(tasks))
    deeds = {one: tuple(draw(st.lists(DEEDS, max_size=6))) for one in (*CARTS, *PEOPLE)}
    submits = tuple(Event(0.5 * draw(st.integers(0, 8)) + 1.0, "submit", f"Random{i}") for i in range(tasks))
    return Mission(texts, deeds, (*submits, *draw(events())))
