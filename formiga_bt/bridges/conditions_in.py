"""Nodes of BehaviorTree.CPP that only look, as conditions of the language. Called by `steps_in`, which reads those that do."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from formiga_bt.bridges.elements import XmlElement
from formiga_bt.bridges.table import BTCPP, OWN
from formiga_bt.bridges.values_in import ImportScope, snake
from formiga_bt.bridges.yaml_text import TODO

_LOOKS_LIKE_CONDITION: Final = re.compile(r"(Is|Has|Are|Can|Check)[A-Z_].*|.*(OK|Ok|_ok)")
_AROUND: Final = ("_skipIf", "_successIf", "_failureIf", "_while")


@dataclass(slots=True)
class Ports:
    """What TreeNodesModel says of a node."""

    category: str
    outputs: set[str] = field(default_factory=set)


class ConditionReader:
    """Reads the nodes of one tree that only look."""

    def __init__(self, scope: ImportScope, models: Mapping[str, Ports]) -> None:
        self.scope, self.models = scope, models

    def read(self, element: XmlElement) -> str | None:
        """Return a node that only looks as an expression, or None if it is no such node."""
        element = named(element)
        tag = element.tag
        if tag == "ScriptCondition":
            return self.scope.expression(element.get("code"), element, "cond")
        if tag == "Expression":
            return element.get("text")
        if tag == "BlackboardCheckString":
            value = element.get("expected") or element.get("value_B")
            return f"{self.scope.entry(self.scope.pointer(element.get('value_A')) or 'value', element)} == '{value}'"
        if tag == "Inverter" and len(element.children) == 1:
            inner = self.read(element.children[0])
            return negated(inner) if inner is not None else None
        if tag in ("Sequence", "ReactiveSequence", "Fallback", "ReactiveFallback") and element.children:
            parts = [self.read(child) if self.looks(child) else None for child in element.children]
            word = " and " if "Sequence" in tag else " or "
            return word.join(bracketed(part) for part in parts if part) if all(parts) else None
        return self._named_condition(element) if self._is_condition(element) else None

    def looks(self, element: XmlElement, *, modified: bool = False) -> bool:
        """Return whether a node and all below it only look (asked first, so that nothing is reported twice).

        Args:
            element: the node.
            modified: whether it may have conditions of its own around it (`_skipIf`); those below never may.
        """
        element = named(element)
        if not modified and any(key in element.attrs for key in _AROUND):
            return False
        if element.tag in ("Sequence", "ReactiveSequence", "Fallback", "ReactiveFallback", "Inverter"):
            return bool(element.children) and all(self.looks(child) for child in element.children)
        return element.tag in ("ScriptCondition", "Expression", "BlackboardCheckString") or self._is_condition(element)

    def _is_condition(self, element: XmlElement) -> bool:
        if element.tag in BTCPP or element.tag in OWN or element.children:
            return False
        known = self.models.get(element.tag)
        if known is not None:
            return known.category == "Condition"
        return element.get("_category") == "Condition" or bool(_LOOKS_LIKE_CONDITION.fullmatch(element.tag))

    def _named_condition(self, element: XmlElement) -> str:
        name = snake(element.tag)
        if name not in self.scope.params:
            said = self.scope.report(
                "X06", element, f"the condition {element.tag} stands for code", f"replace '{name}' by an expression"
            )
            self.scope.params[name] = {TODO: [said], "type": "bool"}
        return name


def named(element: XmlElement) -> XmlElement:
    """Return a node with its own name as tag: `<Action ID="GoTo"/>` is `<GoTo/>`."""
    if element.tag in ("Action", "Condition", "Control", "Decorator") and element.get("ID"):
        attrs = {key: text for key, text in element.attrs.items() if key != "ID"} | {"_category": element.tag}
        return XmlElement(element.get("ID"), attrs, element.children, line=element.line, col=element.col)
    return element


def bracketed(cond: str) -> str:
    """Return a condition that can stand beside `and`, `or` and `not`."""
    return cond if re.fullmatch(r"[\w.]+|not [\w.]+|\(.*\)", cond) and cond.count("(") <= 1 else f"({cond})"


def negated(cond: str) -> str:
    """Return the opposite of a condition."""
    if re.fullmatch(r"not [\w.]+", cond):
        return cond[4:]
    return f"not {cond}" if re.fullmatch(r"[\w.]+", cond) else f"not ({cond})"
