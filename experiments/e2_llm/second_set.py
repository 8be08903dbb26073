"""The second set: requests of other kinds, in several wordings and two languages, each with its oracle as data.

A family has wordings with blanks, cases that fill them, checks of the flights, and a reference tree that passes them; families
that must be refused or asked back have none. Files: `second/<kind>.yaml`.
"""

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

import msgspec
import yaml
from msgspec import Struct

from experiments.e2_llm.checks import check
from experiments.e2_llm.fly import Scene, World, fly, place_of
from experiments.e2_llm.shorthand import task_text
from experiments.e2_llm.verdicts import Verdict, together

LANGUAGES: Final = ("en", "es")
SAID: Final[Mapping[str, Mapping[str, str]]] = {
    "en": {
        "north_field": "the north field", "east_field": "the east field", "south_field": "the south field",
        "west_field": "the west field", "lake_shore": "the lake shore", "camp": "the camp", "base": "the base",
        "lake": "the lake", "bog": "the bog",
    },
    "es": {
        "north_field": "el campo norte", "east_field": "el campo este", "south_field": "el campo sur",
        "west_field": "el campo oeste", "lake_shore": "la orilla del lago", "camp": "el campamento", "base": "la base",
        "lake": "el lago", "bog": "la turbera",
    },
}  # fmt: skip
"""How people call places; other blanks are said as they are."""


class Flight(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One flight and its checks."""

    expect: list[dict[str, Any]]
    scene: dict[str, Any] = {}
    """Of `fly.Scene`."""


class Family(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Requests that differ in what fills their blanks."""

    id: str
    words: dict[str, list[str]]
    """Language -> wordings."""
    cases: list[dict[str, Any]]
    answer: tuple[str, ...] = ("task",)
    """What is right: task, impossible, question."""
    flights: list[Flight] = []
    reference: dict[str, Any] = {}
    wrong: list[dict[str, Any]] = []
    """Wrong trees; besides, the reference of another case is one."""


class Second(Struct, frozen=True, kw_only=True):
    """One request, filled in."""

    kind: str
    family: str
    case: int
    words: dict[str, tuple[str, ...]]
    answer: tuple[str, ...]
    flights: tuple[Flight, ...]
    reference: str
    """A task file; "" where nothing must fly."""
    wrong: tuple[str, ...]

    @property
    def id(self) -> str:
        """Return a name of its own."""
        return f"{self.kind}/{self.family}/{self.case}"

    @property
    def wordings(self) -> tuple[str, ...]:
        """Return all wordings, languages in turn."""
        return tuple(text for language in LANGUAGES for text in self.words.get(language, ()))


@cache
def families() -> tuple[tuple[str, Family], ...]:
    """Return all families with their kinds."""
    found = []
    for path in sorted((Path(__file__).parent / "second").glob("*.yaml")):
        for one in msgspec.convert(yaml.load(path.read_text(encoding="utf-8"), Loader=yaml.CSafeLoader), list[Family]):
            found.append((path.stem, one))
    return tuple(found)


def second_set() -> list[Second]:
    """Return all requests."""
    return [_made(kind, one, case) for kind, one in families() for case in range(len(one.cases))]


def _made(kind: str, family: Family, case: int) -> Second:
    blanks = family.cases[case]

    def words(language: str) -> tuple[str, ...]:
        said = {key: SAID[language].get(str(value), str(value)) for key, value in blanks.items()}
        return tuple(_sentence(text.format(**said)) for text in family.words[language])

    filled = _filled(msgspec.to_builtins(family), blanks)
    return Second(
        kind=kind,
        family=family.id,
        case=case,
        words={language: words(language) for language in LANGUAGES},
        answer=tuple(family.answer),
        flights=tuple(msgspec.convert(filled["flights"], list[Flight])),
        reference=task_text(filled["reference"]) if family.reference else "",
        wrong=tuple(task_text(one) for one in filled["wrong"]),
    )


def _sentence(text: str) -> str:
    text = text.replace(" a el ", " al ").replace(" de el ", " del ")
    return text[:1].upper() + text[1:]


def _filled(value: Any, blanks: Mapping[str, Any]) -> Any:
    if isinstance(value, str):
        whole = re.fullmatch(r"<(\w+)>", value)
        if whole:
            return blanks[whole[1]]
        return re.sub(r"<(\w+)>", lambda match: str(blanks[match[1]]), value)
    if isinstance(value, list):
        return [_filled(one, blanks) for one in value]
    if isinstance(value, dict):
        return {_filled(key, blanks): _filled(one, blanks) for key, one in value.items()}
    return value


def site_of(world: World) -> dict[str, Any]:
    """Return places and regions for checks."""
    names = ["base", *world.site.places, *world.site.ports]
    regions = {name: [(c.east_m, c.north_m) for c in one.corners] for name, one in world.site.regions.items()}
    return {"places": {name: place_of(world, name) for name in names}, "regions": regions}


def judge_tree(request: Second, yaml_text: str, values: Mapping[str, str], world: World) -> Verdict:
    """Return what a tree's flights lack."""
    found = []
    for flight in request.flights:
        flown = fly(yaml_text, values, world, msgspec.convert(flight.scene, Scene))
        found.append(check(flown, flight.expect, site_of(world)))
        if not found[-1].ok:
            break
    return together(found)
