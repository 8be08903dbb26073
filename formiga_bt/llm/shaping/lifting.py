"""Constants of a tree become params of the task: amounts, places, regions, each with the words that it came from.

A person who reads a draft sees at once what it would fly with, and may start it with other values. The words are looked up in
the request by us; a model is not asked where it has its numbers from.
"""

import ast
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from formiga_bt.base.units import NUMBER, UNIT, parse_quantity
from formiga_bt.lang.expr.helpers import STANDARD
from formiga_bt.lang.model import Site
from formiga_bt.llm.records import ParamValue
from formiga_bt.llm.words.wording import Words

ASSUMED: Final = "assumed"
_INSIDE: Final = re.compile(rf"(?<![\w.'])({NUMBER})\s*({UNIT})(?![\w%])", re.ASCII)
_NAME: Final = re.compile(r"(?<![\w.'])[A-Za-z_]\w*(?![\w'(])")
_PAIR: Final = re.compile(r"(-?\d{1,2}\.\d+)\s*,\s*(-?\d{1,3}\.\d+)")
_QUANTITIES: Final = ("distance", "duration", "speed", "angle", "mass", "percent")
_NO_NAMES: Final = frozenset({"base", "site", "task", "now", "error", "result", "not", "and", "or", "in", "if", "else"})
_HEIGHTS: Final = ("height", "altitude")
_NICER: Final = {
    "to": "target",
    "at": "target",
    "wait": "pause",
    "near": "near",
    "dist": "gap",
    "distance": "gap",
    "p": "target",
}


@dataclass(slots=True)
class Lifted:
    """A param to be."""

    name: str
    type: str
    default: Any
    text: str
    words: str


class Lifter:
    """Collects the constants of one tree.

    Args:
        words: the request.
        site: whose names are constants.
    """

    def __init__(self, words: Words, site: Site) -> None:
        self.words = words
        self.taken: set[str] = set()
        """Names that no param may have: the roles."""
        self.local: set[str] = set()
        """Names of loops."""
        self._site = site
        self._found: dict[tuple[str, str, str], Lifted] = {}
        self._roles: dict[str, str] = {}

    def params(self) -> tuple[list[dict[str, Any]], dict[int, str]]:
        """Return the params in JSON form, and by their number the comment that stands beside each."""
        params, notes = [], {}
        for index, one in enumerate(self._found.values()):
            params.append({"name": one.name, "type": one.type, "default": one.default})
            notes[index] = f'"{one.words}"' if one.words else ASSUMED
        return params, notes

    def values(self) -> tuple[ParamValue, ...]:
        """Return what the task would run with."""
        return tuple(ParamValue(one.name, one.text, one.words) for one in self._found.values())

    def renamed(self, role: str) -> str:
        """Take a role's name as a model wrote it; return the one that it has in the task.

        `first drone` is no name, and `first` would hide a helper.
        """
        name = re.sub(r"\W+", "_", role.strip()).strip("_") or "agent"
        name = f"a_{name}" if name[0].isdigit() else name
        site = self._site
        hidden = name in (*STANDARD.names(), *_NO_NAMES, *site.places, *site.regions, *site.agents)
        self._roles[role] = f"{name}_agent" if hidden else name
        return self._roles[role]

    @property
    def roles(self) -> tuple[str, ...]:
        """Return the roles as the model wrote them."""
        return tuple(self._roles)

    def role(self, word: str) -> str:
        """Return the name that a role has in the task."""
        return self._roles.get(word, word)

    def value(self, text: str, type_: str, key: str) -> dict[str, Any]:
        """Return a value in JSON form.

        Args:
            text: what the model wrote.
            type_: what is due there.
            key: of which field or option; a param gets its name from it.
        """
        text = bare(text)
        if type_ == "text":
            return {"text": text}
        if type_ in ("bool", "number", "int") or type_.startswith("one of"):
            plain = text.strip("'\"")
            if re.fullmatch(r"true|false|-?[\d.]+", plain) is None and not type_.startswith("one of"):
                return {"expr": self.expression(text)}
            return {"lit": plain}
        if type_ == "agent":
            text = self.role(text)
            return {"lit": text} if text in self._site.agents else {"expr": text}
        pair = _PAIR.fullmatch(text)
        if type_ in ("place", "position") and pair is not None:
            said = self.words.holds(text) or self.words.holds(f"{pair[1]} {pair[2]}")
            literal = {"lat": float(pair[1]), "lng": float(pair[2])}
            place = self._lift(key, "place", {"lit": literal}, f"{pair[1]},{pair[2]}", said)
            return {"expr": place if type_ == "place" else f"above({place}, {self._height('20 m')})"}
        return {"expr": self.expression(text, key, type_)}

    def expression(self, text: str, key: str = "", type_: str = "") -> str:
        """Return an expression in which each amount and each name of the site is a param."""
        text = bare(text)
        whole = parse_quantity(text)
        if whole is not None:
            return self._amount(text, whole, key or whole[0])
        text, kept = _without_texts(text)
        names = _argument_names(text)
        shift = 0
        for match in list(_INSIDE.finditer(text)):
            amount = parse_quantity(match[0])
            if amount is None:
                continue
            name = self._amount(match[0], amount, names(match.start()) or amount[0])
            text = text[: match.start() + shift] + name + text[match.end() + shift :]
            shift += len(name) - len(match[0])
        text = _NAME.sub(self._name, text)
        for index, quoted in enumerate(kept):
            text = text.replace(f"'{index}'", quoted)
        if type_ == "position" and re.fullmatch(r"[A-Za-z_]\w*", text) and self._is_place(text):
            return f"above({text}, {self._height('20 m')})"
        return text

    def _is_place(self, name: str) -> bool:
        return name == "base" or any(one.name == name and one.type == "place" for one in self._found.values())

    def _height(self, text: str) -> str:
        """Return the param of a height that nobody gave; the one of the task, if there is one."""
        for one in self._found.values():
            if one.name == "height":
                return one.name
        amount = parse_quantity(text)
        assert amount is not None
        return self._amount(text, amount, "height")

    def _amount(self, text: str, amount: tuple[str, float], key: str) -> str:
        type_, si = amount
        match = re.fullmatch(rf"([+-]?{NUMBER})\s*({UNIT})", text.strip(), re.ASCII)
        cleanup = f"{match[1]} {match[2]}" if match is not None else text.strip()
        return self._lift(key, type_, {"lit": cleanup}, cleanup, self.words.amount(type_, si))

    def _name(self, match: re.Match[str]) -> str:
        word = self.role(match[0])
        if word in self.taken or word in self.local or word in _NO_NAMES:
            return word
        point = self.words.points.get(word)
        if point is not None:
            return self._lift(word, "place", {"lit": {"lat": point.lat, "lng": point.lng}}, point.text, point.words)
        for type_, known in (("place", self._site.places), ("place", self._site.ports), ("region", self._site.regions)):
            if word in known:
                return self._lift(word, type_, {"lit": word}, word, self.words.places.get(word, ""))
        return word

    def _same(self, base: str, type_: str, text: str, words: str) -> Lifted | None:
        """Return the height that already has these words of the request, if they stand there once."""
        if base not in _HEIGHTS or not words or self.words.text.count(words) != 1:
            return None
        alike = (one for one in self._found.values() if one.name in _HEIGHTS and (one.type, one.text) == (type_, text))
        return next(alike, None)

    def _lift(self, key: str, type_: str, default: Any, text: str, words: str) -> str:
        base = _NICER.get(key, key) if key in _NICER else key
        base = re.sub(r"\W", "_", base) or type_
        known = self._found.get((base, type_, text)) or self._same(base, type_, text, words)
        if known is not None:
            return known.name
        used = (
            {one.name for one in self._found.values()}
            | self.taken
            | self.local
            | set(_NO_NAMES)
            | set(STANDARD.names())
        )
        name, number = base, 2
        while name in used:
            name, number = f"{base}_{number}", number + 1
        self._found[base, type_, text] = Lifted(name, type_, default, text, words)
        return name


def bare(text: str) -> str:
    """Return an expression without `${ }` around it."""
    text = text.strip()
    return text[2:-1].strip() if text.startswith("${") and text.endswith("}") and "${" not in text[2:] else text


def split_list(text: str) -> list[str]:
    """Split at the commas that stand in no brackets."""
    parts, depth, start = [], 0, 0
    for index, char in enumerate(text):
        depth += (char in "([") - (char in ")]")
        if char == "," and depth == 0:
            parts.append(text[start:index].strip())
            start = index + 1
    return [*parts, text[start:].strip()]


def _without_texts(text: str) -> tuple[str, list[str]]:
    """Return an expression with numbers in place of its quoted texts, and those."""
    kept: list[str] = []

    def keep(match: re.Match[str]) -> str:
        kept.append(match[0])
        return f"'{len(kept) - 1}'"

    return re.sub(r"'[^']*'|\"[^\"]*\"", keep, text), kept


def _argument_names(text: str) -> Callable[[int], str]:
    """Return what tells the name of the helper's argument that stands at a position of an expression."""
    spaced = _INSIDE.sub(lambda m: "0" * len(m[0]), text)
    try:
        tree = ast.parse(spaced.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return lambda _: ""
    lead = len(spaced) - len(spaced.lstrip())
    found: dict[int, str] = {}
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
            continue
        for keyword in node.keywords:
            for part in (keyword.value.right if isinstance(keyword.value, ast.BinOp) else keyword.value, keyword.value):
                found[lead + _start(part)] = keyword.arg or ""
        forms = STANDARD.forms(node.func.id)
        if forms:
            for arg, given in zip(forms[0].args, node.args, strict=False):
                found[lead + _start(given)] = arg.name
    return lambda at: found.get(at, "")


def _start(node: ast.expr) -> int:
    """Return where a number begins, without its sign."""
    return node.operand.col_offset if isinstance(node, ast.UnaryOp) else node.col_offset
