"""Keeps the evaluation out of training: its wordings, and near-duplicates of its trees.

A wording leaks when it shares six words in a row with a wording of an evaluation, numbers aside, unless these are all among
words that every request has. A tree leaks when `measures.is_near` (relative edit distance of steps at most 0.25) finds it near
a reference of T6 to T10, as shipped or in the short form, or one of the second set's. References of fewer than five steps are
near to much that everybody says (`fly there, come home`): of T6 to T10 the same steps leak, of the second set nothing.
"""

import re
from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any, Final

from experiments.e2_llm.fresh import FRESH
from experiments.e2_llm.measures import NEAR, is_near
from experiments.e2_llm.requests import WORDS
from experiments.e2_llm.second_set import families, second_set
from experiments.e2_llm.trees import steps_of
from formiga_bt.base.packaged import folder
from formiga_bt.lang.json_form.writing import from_yaml
from formiga_bt.lang.model import Catalogue

WINDOW: Final = 6
THRESHOLD: Final = NEAR
LEAST_STEPS: Final = 5
"""References of the second set with fewer steps are no secret."""
_STOP: Final = """
    a an and at after all altitude are as back be by come comes distance down drone drones each first fly
    flies for from go goes have heavy height high home i in is it its land lands let light m min metres meters
    of off on one or over please port return returns s same second seconds send shall should that the them
    then there time to two up while with # un una y a el la los las en de del que al por con dron drones
    ligero pesado vuelve vuelva casa su puerto luego sobre metros segundos minutos se es lo altura distancia
"""
STOP: Final = frozenset(_STOP.split())
"""Words that every request has; `#` is a number."""
_FLOWN: Final = {"FetchHome": "ReturnHome", "FlyOver": "FlyTo", "LandNear": "LandIn"}
SHORT_FORMS: Final[tuple[tuple[str, ...], ...]] = (
    ("call FlyAlong", "call FlyTo", "call ReturnHome"),
    (
        "parallel",
        "(",
        "call FlyTo",
        "call FlyTo",
        "call FlyTo",
        ")",
        "parallel",
        "(",
        "LandIn",
        "LandIn",
        "LandIn",
        ")",
    ),
    ("call FlyAlong", "LandIn"),
    ("call FlyTo", "call FlyAlong", "LandIn"),
    ("parallel", "(", "call FlyAndLand", "sequence", "(", "call FlyAlong", "LandIn", ")", ")"),
    (
        "parallel",
        "(",
        "call FlyAndLand",
        "call FlyAndLand",
        ")",
        "ask",
        "parallel",
        "(",
        "sequence",
        "(",
        "TakeOff",
        "call ReturnHome",
        ")",
        "call FlyAndLand",
        ")",
    ),
)
"""T6 to T10 as the product writes them in its short form, in steps."""
OF_PAPER: Final = ("circle", "triangle", "zig_zag", "patrol_and_escort", "delivery")


def words_of(text: str) -> list[str]:
    """Return the words of a request: small, numbers as `#`."""
    return ["#" if word[0].isdigit() else word for word in re.findall(r"[^\W_]+", text.casefold())]


def grams(text: str) -> set[tuple[str, ...]]:
    """Return what six words in a row a text has, without those that say nothing."""
    words = words_of(text)
    rows = (tuple(words[i : i + WINDOW]) for i in range(len(words) - WINDOW + 1))
    return {row for row in rows if not set(row) <= STOP}


@cache
def evaluated() -> frozenset[tuple[str, ...]]:
    """Return the word rows of all evaluation wordings, as they stand there and with every case filled in."""
    texts: list[str] = [text for wordings in (*WORDS.values(), *FRESH.values()) for text in wordings]
    texts += [text for _, family in families() for wordings in family.words.values() for text in wordings]
    texts += [text for one in second_set() for text in one.wordings]
    return frozenset(row for text in texts for row in grams(text))


def leaked(request: str) -> set[tuple[str, ...]]:
    """Return the word rows that a request shares with an evaluation."""
    return grams(request) & evaluated()


class Guard:
    """Knows the references of the evaluations."""

    def __init__(self, catalogue: Catalogue) -> None:
        trees = [(folder("trees") / f"{name}.yaml").read_text(encoding="utf-8") for name in OF_PAPER]
        self._references: list[Any] = [_plain(from_yaml(text, catalogue)) for text in trees]
        self._references += [{"steps": _nested(iter(row))} for row in SHORT_FORMS]
        second = {one.reference: _plain(from_yaml(one.reference, catalogue)) for one in second_set() if one.reference}
        self._references += [one for one in second.values() if steps_of(one).size > LEAST_STEPS]
        self._short = {shape(one) for one in self._references if steps_of(one).size <= LEAST_STEPS}
        self._references = _different([one for one in self._references if steps_of(one).size > LEAST_STEPS])
        self._seen: dict[str, bool] = {}

    def is_near(self, data: Any) -> bool:
        """Return whether a task in JSON form is near a reference."""
        tree = _plain(data)
        key = shape(tree)
        if key not in self._seen:
            near = key in self._short or any(is_near(tree, one, THRESHOLD) for one in self._references)
            self._seen[key] = near
        return self._seen[key]


def shape(data: Any) -> str:
    """Return the kinds of steps of a task as text."""

    def text(branch: Any) -> str:
        return branch.label + ("(" + " ".join(map(text, branch.children)) + ")" if branch.children else "")

    return text(steps_of(data))


def _different(trees: Sequence[Any]) -> list[Any]:
    return list({shape(one): one for one in trees}.values())


def _plain(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _FLOWN.get(value, value) if key == "call" else _plain(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_plain(one) for one in data]
    return data


def _nested(row: Iterable[str]) -> list[Any]:
    found: list[Any] = []
    for word in row:
        if word == "(":
            found[-1] = {next(iter(found[-1])): _nested(row)}
        elif word == ")":
            return found
        elif word.startswith("call "):
            found.append({"call": word.removeprefix("call ")})
        elif word in ("parallel", "sequence"):
            found.append({word: []})
        elif word == "ask":
            found.append({"ask": "?"})
        else:
            found.append({"action": word})
    return found
