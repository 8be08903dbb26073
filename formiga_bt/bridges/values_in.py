"""Ports, scripts and names of a BehaviorTree.CPP file, read as values of ours. Called by `steps_in`."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.units import format_quantity, parse_quantity
from formiga_bt.bridges.elements import XmlElement
from formiga_bt.bridges.findings import Findings
from formiga_bt.bridges.scripts import Assigned, NoScript, ScriptNames, from_script, number, to_script
from formiga_bt.bridges.values_out import plain
from formiga_bt.lang.own_names import why_taken
from formiga_bt.lang.text.document import parse

_POINTER: Final = re.compile(r"\{\s*@?([^{}:,\s]+)\s*\}")
_POINTER_3: Final = re.compile(r"\$?\{\s*([^{}:,\s()]+)\s*\}")
AGENT_FIELDS: Final = (
    "id", "type", "position", "home", "battery", "status", "airborne", "payload", "age", "control", "transit_height",
)  # fmt: skip
_ODD: Final = re.compile(r"\W", re.ASCII)


def clean(name: str) -> str:
    """Return a name as our language takes it: an identifier that hides nothing built in."""
    text = _ODD.sub("_", name).strip("_") or "value"
    text = f"n{text}" if text[0].isdigit() else text
    return f"{text}_value" if why_taken(text) else text


def snake(name: str) -> str:
    """Return a CamelCase name in snake_case."""
    return clean(re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower())


def camel(name: str) -> str:
    """Return a name in CamelCase, as tasks and subtrees are called."""
    text = "".join(word[:1].upper() + word[1:] for word in re.split(r"[\W_]+", name, flags=re.ASCII) if word) or "Tree"
    return text if text[0].isalpha() else f"T{text}"


@dataclass(slots=True)
class ImportScope:
    """The names of one tree, as they come up."""

    file: str
    findings: Findings
    old: bool = False
    """Of format 3, where `${x}` is an entry too."""
    params: dict[str, Any] = field(default_factory=dict)
    """Declared params: name -> type or long form."""
    known: set[str] = field(default_factory=set)
    """Names that something else defines: roles, vars, saved and loop names."""
    fields: dict[str, str] = field(default_factory=dict)
    """Entries that are fields of a saved result: entry -> `reply.answer`."""
    agents: set[str] = field(default_factory=set)
    copies: dict[str, str] = field(default_factory=dict)
    """Entries that a helper node computes: entry -> the value as people wrote it."""
    saved: str = ""
    """What `result` is in the condition that is read now."""

    def mark(self, element: XmlElement) -> Mark:
        """Return the place of an element."""
        end = element.col + len(element.tag) + 1
        return Mark(self.file, max(1, element.line), max(1, element.col), max(1, element.line), end)

    def report(self, code: str, element: XmlElement, message: str, mend: str = "") -> str:
        """Report, and return the message for a TODO."""
        self.findings.add(code, self.mark(element), message, mend)
        return message + (f"; {mend}" if mend else "")

    def entry(self, name: str, at: XmlElement) -> str:
        """Return the expression that a blackboard entry is; an unknown one becomes a param."""
        if name in self.fields:
            return self.fields[name]
        for agent in self.agents:
            if name.startswith(f"{agent}_") and name[len(agent) + 1 :] in AGENT_FIELDS:
                return f"{agent}.{name[len(agent) + 1 :]}"
        ours = clean(name)
        if ours not in self.known and ours not in self.params:
            said = f"nothing in this tree writes the entry '{name}'"
            self.params[ours] = {"#": [self.report("X04", at, said, "give the param its type")], "type": "any"}
        return ours

    def value(self, text: str, at: XmlElement) -> Any:
        """Return a port's text as a value of a task file."""
        pointer = (_POINTER_3 if self.old else _POINTER).fullmatch(text.strip())
        if pointer is not None:
            name = pointer[1].lstrip("@")
            return self.copies[name] if name in self.copies else "${" + self.entry(name, at) + "}"
        return unfold(text)

    def pointer(self, text: str) -> str:
        """Return the entry that a port's text names, or ""."""
        found = (_POINTER_3 if self.old else _POINTER).fullmatch(text.strip())
        return found[1].lstrip("@") if found is not None else ""

    def amount(self, element: XmlElement, port: str, kept: str = "", *, type_: str = "duration") -> Any:
        """Return a number of BT.CPP's own nodes as a value; durations come in milliseconds."""
        text, factor = element.get(port), 1000 if type_ == "duration" else 1
        said = element.get(f"_formiga_{kept}") if kept else ""
        quantity = parse_quantity(said)
        if said and (text.startswith("{") or (quantity is not None and round(quantity[1] * factor) == _int(text))):
            return unfold(said)
        if text.strip().startswith(("{", "$")):
            return self.value(text, element)
        count = _int(text)
        if count is None:
            self.report("X02", element, f"'{port}={text}' of {element.tag} is no number")
            count = 1000
        return format_quantity("duration", count / factor) if type_ == "duration" else str(count)

    def unchanged(self, said: str, code: str) -> bool:
        """Return whether a script still is what it was made from."""
        names = ScriptNames(any_field=True)
        return any(to_script(said, names, {"result": r} if r else None) == code for r in ("", self.saved, "result"))

    def expression(self, code: str, at: XmlElement, kept: str = "") -> str | None:
        """Return a script that is one value as an expression, or None with a finding."""
        said = at.get(f"_formiga_{kept}") if kept else ""
        if said and self.unchanged(said, code):
            return said
        try:
            found = from_script(code, lambda name: self.entry(name, at))
        except NoScript as problem:
            self.report("X03", at, f"the script '{code}' cannot be read: {problem}")
            return None
        if len(found) != 1 or found[0].name:
            self.report("X03", at, f"the script '{code}' is no condition")
            return None
        return found[0].value

    def assignments(self, element: XmlElement) -> list[tuple[str, Any]]:
        """Return what a `Script`, `Evaluate`, `SetBlackboard` or `UnsetBlackboard` assigns: names and values of ours."""
        if element.tag == "UnsetBlackboard":
            return [(clean(self.pointer(element.get("key")) or element.get("key")), None)]
        if element.tag == "Evaluate":
            return [(clean(self.pointer(element.get("value")) or "value"), unfold(element.get("text")))]
        if element.tag == "SetBlackboard":
            key = self.pointer(element.get("output_key")) or element.get("output_key")
            return [(clean(key), self.value(element.get("value"), element))]
        code, said = element.get("code"), element.get("_formiga_value")
        name, sep, value = code.partition(" := ")
        if said and sep and self._kept_value(said, value):
            return [(name, unfold(said))]
        try:
            found = from_script(code, lambda entry: self.entry(entry, element))
        except NoScript as problem:
            self.report("X03", element, f"the script '{code}' cannot be read: {problem}")
            return []
        return [(clean(one.name), _as_value(one)) for one in found if one.name]

    def _kept_value(self, said: str, value: str) -> bool:
        scaled = re.fullmatch(r"\((.*)\) \* \d+", value)
        value = scaled[1] if scaled is not None else value
        if said.startswith("${") and said.endswith("}"):
            return self.unchanged(said[2:-1], value)
        quantity = parse_quantity(said)
        return value in (said, f"'{said}'") or (quantity is not None and number(quantity[1]) == value)


def _as_value(one: Assigned) -> str:
    text = one.value
    literal = re.fullmatch(r"-?[\d.]+|true|false", text)
    if literal is not None:
        return text
    return text[1:-1] if re.fullmatch(r"'[^']*'", text) else "${" + text + "}"


def unfold(text: str) -> Any:
    """Return text of a port or attribute as a value: `${{...}}` and `[...]` hold lists and mappings in flow style."""
    inner = text[2:-1] if text.startswith("${{") and text.endswith("}}") else text
    if inner.startswith("[") or (inner.startswith("{") and ": " in inner):
        node, problems = parse(f"v: {inner}\n", "value")
        if node is not None and not problems:
            found = plain(node)
            return found["v"] if isinstance(found, dict) and "v" in found else text
    return text


def words(text: str) -> list[str]:
    """Return the words of a list in one port."""
    return [word.strip() for word in text.split(";") if word.strip()]


def _int(text: str) -> int | None:
    try:
        return int(float(text))
    except (ValueError, OverflowError):
        return None


def as_param(long: Mapping[str, Any]) -> Any:
    """Return a param in its short form where that says the same."""
    return long["type"] if set(long) == {"type"} and isinstance(long["type"], str) else dict(long)
