"""A task file as the answer that a model would have given: so that a follow-up in words edits any task.

What the short form cannot say is shown in the full form; then the follow-up must be made in that form, too.
"""

import json
import re
from typing import Any, Final

from formiga_bt.lang.kinds import MODIFIERS
from formiga_bt.lang.llm_out import from_yaml
from formiga_bt.llm.envelope import Form
from formiga_bt.llm.vocabulary import verbs_of
from formiga_bt.llm.world import World

_ROLE: Final = frozenset({"name", "type", "id", "near", "count"})
_MODIFIERS: Final = frozenset(option.name for option in MODIFIERS)


class _TooMuch(Exception):  # noqa: N818 - a signal, never seen outside
    """The short form cannot say it."""


def as_answer(text: str, world: World) -> tuple[str, str, Form]:
    """Return what a task is for, the JSON of an answer with it, and the form that it is in.

    Args:
        text: a task file without errors.
        world: its catalogue.
    """
    data = from_yaml(text, world.catalogue)
    purpose = str(data.get("description") or data.get("task") or "")
    form: Form = "short"
    try:
        tree = _Shortener(data, world).task()
    except _TooMuch:
        tree, form = {k: v for k, v in data.items() if k != "formiga"}, "full"
    answer: dict[str, Any] = {"plan": purpose, "answer": {"tree": tree}}
    if form == "full":
        answer["answer"]["run"] = []
    return purpose, json.dumps(answer, ensure_ascii=False, separators=(", ", ": ")), form


class _Shortener:
    def __init__(self, data: dict[str, Any], world: World) -> None:
        self._data = data
        self._verbs = verbs_of(world)
        self._constants = {p["name"]: _plain(p["default"]) for p in data.get("params", ()) if "default" in p}
        self._open = {p["name"] for p in data.get("params", ()) if "default" not in p}

    def task(self) -> dict[str, Any]:
        known = {"formiga", "task", "version", "description", "imports", "params", "agents", "steps"}
        if set(self._data) - known or self._open:
            raise _TooMuch
        roles = [self._role(one) for one in self._data.get("agents", ())]
        return {"task": self._data["task"], "agents": roles, "steps": self._steps(self._data["steps"])}

    def _role(self, role: dict[str, Any]) -> dict[str, Any]:
        if set(role) - _ROLE or "type" not in role:
            raise _TooMuch
        found = {"name": role["name"], "type": role["type"]}
        if "id" in role:
            found["id"] = self._value(role["id"])
        if "count" in role:
            found["count"] = int(self._value(role["count"]))
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
            return {"notify": step["notify"]}
        if "repeat" in step and set(step) <= {"repeat", "every", "until", "steps"}:
            inner = {k: self._value(v) if k != "until" else self._names(v) for k, v in step.items() if k != "steps"}
            return {**inner, "steps": self._steps(step["steps"])}
        if "if" in step:
            return {k: self._names(v) if k == "if" else self._steps(v) for k, v in step.items()}
        if "for" in step and set(step) <= {"for", "mode", "steps"}:
            names = ", ".join(one["name"] for one in step["for"])
            lists = ", ".join(self._value(one["value"]) for one in step["for"])
            mode = {"mode": step["mode"]} if "mode" in step else {}
            return {"for": names, "in": lists, **mode, "steps": self._steps(step["steps"])}
        if "ask" in step and set(step) <= {"ask", "of", "options", "timeout", "expect", "save_as"}:
            return self._ask(step)
        if set(step) == {"break_if"}:
            return {"break_if": self._names(step["break_if"])}
        raise _TooMuch

    def _ask(self, step: dict[str, Any]) -> dict[str, Any]:
        found = {k: v for k, v in step.items() if k in ("ask", "of", "options", "save_as")}
        expect = re.fullmatch(r"result\.answer == '([^']*)'", step.get("expect", ""))
        if "expect" in step and expect is None:
            raise _TooMuch
        if expect is not None and expect[1] not in ("yes", (step.get("options") or ["yes"])[0]):
            found["go_on"] = expect[1]
        return found

    def _verb(self, name: str, agent: str, fields: dict[str, str]) -> dict[str, Any]:
        if name not in self._verbs:
            raise _TooMuch
        return {"do": name, "agent": agent, **fields}

    def _value(self, value: Any) -> str:
        text = _plain(value)
        return self._names(text) if isinstance(value, dict) and "expr" in value else text

    def _names(self, text: str) -> str:
        """Return an expression with the constants of the params in it."""
        return re.sub(r"(?<![\w.'])[A-Za-z_]\w*(?![\w(])", lambda m: self._constants.get(m[0], m[0]), text)


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
