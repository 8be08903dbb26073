"""A task file as the answer that a model would have given: so that a follow-up in words edits any task.

What the short form cannot say is shown in the full form; then the follow-up must be made in that form, too.
"""

import json
import re
from typing import Any, Final

from formiga_bt.base.units import parse_quantity
from formiga_bt.lang.json_form.writing import from_yaml
from formiga_bt.lang.kinds import MODIFIERS
from formiga_bt.llm.envelope import Form
from formiga_bt.llm.shaping.lifting import Lifter
from formiga_bt.llm.shaping.short import ASKED_FOR, expanded
from formiga_bt.llm.vocabulary import verbs_of
from formiga_bt.llm.words.wording import read
from formiga_bt.llm.world import RequestWorld

VERSION: Final = "0.1.0"
"""Of a task that nobody gave one."""
_ROLE: Final = frozenset({"name", "type", "id", "near", "count"})
_PARAM: Final = frozenset({"name", "type", "default"})
_MODIFIERS: Final = frozenset(option.name for option in MODIFIERS)
_QUOTED_OR_NAME: Final = re.compile(r"'[^']*'|\"[^\"]*\"|(?<![\w.])[A-Za-z_]\w*(?![\w(]|\s*=(?!=))")
_NUMBER: Final = re.compile(r"\d+(?:\.\d+)?")
_HOLE: Final = re.compile(r"\$\{([^}]*)\}")


class _TooMuch(Exception):  # noqa: N818 - a signal, never seen outside
    """The short form cannot say it."""


def as_answer(text: str, world: RequestWorld, form: Form = "short", *, exact: bool = True) -> tuple[str, str, Form]:
    """Return what a task is for, the JSON of an answer with it, and the form that it is in.

    Args:
        text: a task file without errors.
        world: its catalogue.
        form: `full`: in that form whatever the short one can say.
        exact: the short form is used only if the same task comes of it. An example for a model need not be exact: who is
            nearest, bounds and labels of params, and how long a question waits do not count.

    Raises:
        ValueError: the file has errors.
    """
    data = from_yaml(text, world.catalogue)
    purpose = " ".join(str(data.get("description") or data.get("task") or "").split())
    tree = {k: v for k, v in data.items() if k != "formiga"}
    if form == "short":
        try:
            tree = _Shortener(data, world, exact=exact).task()
        except _TooMuch:
            form = "full"
    answer: dict[str, Any] = {"plan": purpose, "answer": {"tree": tree}}
    if form == "full":
        answer["answer"]["run"] = []
    return purpose, json.dumps(answer, ensure_ascii=False, separators=(", ", ": ")), form


class _Shortener:
    def __init__(self, data: dict[str, Any], world: RequestWorld, *, exact: bool) -> None:
        self._data, self._world, self._exact = data, world, exact
        self._verbs = verbs_of(world)
        self._params = data.get("params", ())
        self._constants = {p["name"]: _plain(p["default"]) for p in self._params if "default" in p}
        self._open = {p["name"] for p in self._params if "default" not in p}

    def task(self) -> dict[str, Any]:
        known = {"formiga", "task", "version", "description", "imports", "params", "agents", "steps"}
        if set(self._data) - known or self._open:
            raise _TooMuch
        if self._exact and any(set(one) - _PARAM or one["type"] == "text" for one in self._params):
            raise _TooMuch
        roles = [self._role(one) for one in self._data.get("agents", ())]
        tree = {"task": self._data["task"], "agents": roles, "steps": self._steps(self._data["steps"])}
        if not self._exact:
            return tree
        if self._data.get("version", VERSION) != VERSION:
            tree["version"] = self._data["version"]
        return self._with_near(tree)

    def _with_near(self, tree: dict[str, Any]) -> dict[str, Any]:
        """Return the tree with each `near` that would not come of it by itself: that is where a machine flies first."""
        wanted = {
            one["name"]: self._inlined(_plain(one["near"])) for one in self._data.get("agents", ()) if "near" in one
        }
        made = self._made(tree)
        for role in tree["agents"]:
            near = wanted.get(role["name"], "")
            if near and not _is_same(made.get(role["name"], ""), near):
                role["near"] = near
        made = self._made(tree)
        if not all(_is_same(made.get(name, ""), near) for name, near in wanted.items()):
            raise _TooMuch
        return tree

    def _made(self, tree: dict[str, Any]) -> dict[str, str]:
        """Return to which place each machine is the nearest one, in the task that comes of a tree."""
        words = read("", self._world.site, self._world.catalogue)
        try:
            data = expanded(tree, self._world, self._verbs, Lifter(words, self._world.site)).data
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise _TooMuch from error
        constants = {p["name"]: _plain(p["default"]) for p in data.get("params", ())}
        return {one["name"]: _inlined(_plain(one["near"]), constants) for one in data["agents"] if "near" in one}

    def _role(self, role: dict[str, Any]) -> dict[str, Any]:
        if set(role) - _ROLE or not isinstance(role.get("type"), str):
            raise _TooMuch
        found = {"name": role["name"], "type": role["type"]}
        if "id" in role:
            found["id"] = self._value(role["id"])
        if "count" in role:
            count = self._value(role["count"])
            if not count.isdecimal():
                raise _TooMuch
            found["count"] = int(count)
        return found

    def _steps(self, steps: list[dict[str, Any]]) -> list[dict[str, Any]]:
        return [self._step(one) for one in steps]

    def _step(self, step: dict[str, Any]) -> dict[str, Any]:
        modifiers = set(step) & _MODIFIERS - {"timeout"}
        if modifiers or ("timeout" in step and "ask" not in step):
            raise _TooMuch
        if "action" in step:
            fields = {k: self._value(v) for k, v in step.items() if k not in ("action", "agent", "save_as")}
            saved = {"save_as": step["save_as"]} if "save_as" in step else {}
            return self._verb(step["action"], step["agent"], fields) | saved
        if "call" in step:
            verb = self._verbs.get(step["call"])
            given = {one["name"]: self._value(one["value"]) for one in step.get("with", ())}
            if verb is None or set(step) - {"call", "with"} or verb.role not in given:
                raise _TooMuch
            return self._verb(step["call"], given.pop(verb.role), given)
        for kind in ("parallel", "sequence"):
            if set(step) == {kind}:
                return {kind: self._steps(step[kind])}
        if set(step) == {"wait"}:
            return {"wait": self._value(step["wait"])}
        if set(step) == {"notify"}:
            return {"notify": self._said(step["notify"])}
        if "repeat" in step and set(step) <= {"repeat", "every", "until", "steps"}:
            inner = {k: self._value(v) if k != "until" else self._inlined(v) for k, v in step.items() if k != "steps"}
            return {**inner, "steps": self._steps(step["steps"])}
        if "if" in step:
            return {k: self._inlined(v) if k == "if" else self._steps(v) for k, v in step.items()}
        if "for" in step and set(step) <= {"for", "mode", "steps"}:
            names = ", ".join(one["name"] for one in step["for"])
            lists = ", ".join(self._value(one["value"]) for one in step["for"])
            mode = {"mode": step["mode"]} if "mode" in step else {}
            return {"for": names, "in": lists, **mode, "steps": self._steps(step["steps"])}
        if "ask" in step and set(step) <= {"ask", "of", "options", "timeout", "expect", "save_as"}:
            return self._ask(step)
        if set(step) == {"break_if"}:
            return {"break_if": self._inlined(step["break_if"])}
        raise _TooMuch

    def _ask(self, step: dict[str, Any]) -> dict[str, Any]:
        found = {k: v for k, v in step.items() if k in ("ask", "of", "options", "save_as")}
        found["ask"] = self._said(step["ask"])
        expect = re.fullmatch(r"result\.answer == '([^']*)'", step.get("expect", ""))
        if "expect" in step and expect is None:
            raise _TooMuch
        if self._exact and ("expect" in step) == ("save_as" in step):
            raise _TooMuch
        if self._exact and parse_quantity(self._value(step.get("timeout", ""))) != parse_quantity(ASKED_FOR):
            raise _TooMuch
        if expect is not None and expect[1] != (step.get("options") or ["yes"])[0]:
            found["go_on"] = expect[1]
        return found

    def _verb(self, name: str, agent: str, fields: dict[str, str]) -> dict[str, Any]:
        if name not in self._verbs:
            raise _TooMuch
        return {"do": name, "agent": agent, **fields}

    def _value(self, value: Any) -> str:
        text = _plain(value)
        return self._inlined(text) if isinstance(value, dict) and "expr" in value else text

    def _inlined(self, text: str) -> str:
        return _inlined(text, self._constants)

    def _said(self, text: str) -> str:
        """Return a text for people; in the short form its holes cannot have params, which get other names."""
        if self._exact and any(self._inlined(hole) != hole for hole in _HOLE.findall(text)):
            raise _TooMuch
        return text


def _inlined(text: str, constants: dict[str, str]) -> str:
    """Return an expression with the constants of the params in it; words in quotes and names of arguments stay."""
    return _QUOTED_OR_NAME.sub(lambda m: constants.get(m[0], m[0]), text)


def _is_same(one: str, other: str) -> bool:
    """Return whether two places are the same, however their numbers are written."""
    plain, other_plain = (_NUMBER.sub(lambda m: f"{float(m[0]):.9g}", "".join(text.split())) for text in (one, other))
    return plain == other_plain


def _plain(value: Any) -> str:
    if isinstance(value, dict) and len(value) == 1:
        inner = next(iter(value.values()))
        if isinstance(inner, dict):
            return f"{inner.get('lat')}, {inner.get('lng')}" if "lat" in inner else _offset(inner)
        if isinstance(inner, list):
            raise _TooMuch
        return str(inner)
    return str(value)


def _offset(point: dict[str, Any]) -> str:
    return f"offset(base, east={point.get('east', '0 m')}, north={point.get('north', '0 m')})"
