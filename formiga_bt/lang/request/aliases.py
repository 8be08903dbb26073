"""Other names under which callers may request tasks and pass their parameters.

Authors write names only; aliases are for those who call: the command line, HTTP, scenarios, and apps with words of their own.
A name always goes before an alias. Two degrees, `lat` and `lng` (or `lon`), stand for one place: the param that is called,
or has the alias, `target`, else the only one of type place. With an ending (`lat2`, `lng2`) they are `target2`.
"""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Final

from msgspec import Struct

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model import Param, Task
from formiga_bt.lang.text.document import Entry
from formiga_bt.lang.text.reading import Problems, read_words, shorten

TASK_NAME: Final = re.compile(r"[A-Z][A-Za-z0-9]*")
_HEAD: Final = re.compile(
    r"^(?:task:[ \t]*([A-Za-z]\w*)|aliases:[ \t]*(?:\[([^\]]*)\])?((?:\n[ \t]*-[^\n]*)*))", re.MULTILINE
)
_DEGREES: Final = re.compile(r"(lat|lng|lon)(\w*)")
_PLACE: Final = "target"


def names_in(text: str) -> list[str]:
    """Return a task's name, then its aliases, from the text of its file without reading the rest; empty: it is no task."""
    name, aliases = "", []
    for found in _HEAD.finditer(text):
        name = name or found[1] or ""
        aliases += re.findall(r"[A-Za-z]\w*", re.sub(r"#[^\n]*", "", f"{found[2] or ''} {found[3] or ''}"))
    return [name, *aliases] if name else []


def read_task_aliases(entry: Entry, name: str, problems: Problems) -> tuple[str, ...]:
    """Return the other names of a task; one that is no task's name is E008, one that is there twice E018."""
    found: list[str] = []
    for at in read_words(entry.value, problems, "aliases"):
        if not TASK_NAME.fullmatch(at.text):
            what = f"a task's name is CamelCase, this is '{shorten(at.text)}'"
            problems.add("E008", at.mark, what, "such as: PickUp")
        elif at.text in (name, *found):
            problems.add("E018", at.mark, f"this task is called '{at.text}' already", "remove it")
        else:
            found.append(at.text)
    return tuple(found)


def check_params(params: Mapping[str, Param], marks: Mapping[str, Mark], problems: Problems) -> None:
    """Report E018 for an alias that means two params.

    Args:
        params: of a task or subtree.
        marks: where the aliases of each are written.
        problems: where to report.
    """
    owner = {name: name for name in params}
    for param in params.values():
        for alias in param.aliases:
            other = owner.setdefault(alias, param.name)
            if other != param.name or alias == param.name:
                what = (
                    f"'{alias}' is the param '{other}' already" if alias != other else f"'{alias}' is a param already"
                )
                problems.add("E018", marks[param.name], what, "each alias is for one param")


def by_alias(params: Mapping[str, Param]) -> dict[str, Param]:
    """Return params by their names and by their aliases."""
    found = {alias: param for param in params.values() for alias in param.aliases}
    return found | dict(params)


def find_task(tasks: Mapping[str, Task], word: str) -> Task | None:
    """Return the task of a name, else the first one that has it as an alias, else None."""
    return tasks.get(word) or next((task for task in tasks.values() if word in task.aliases), None)


class Degrees(Struct, frozen=True):
    """Latitude and longitude that were given apart for one place."""

    param: Param
    names: tuple[str, str]
    """Under which they were given; the second one is "" if it is missing."""


def degrees_of(params: Mapping[str, Param], given: Collection[str]) -> Iterator[Degrees]:
    """Iterate over the places among the params of which the callers gave degrees apart; names of params are left alone."""
    known = by_alias(params)
    places = [param for param in params.values() if param.type.name == "place"]
    ends: dict[str, dict[str, str]] = {}
    for name in given:
        found = _DEGREES.fullmatch(name)
        if found is not None and name not in known:
            ends.setdefault(found[2], {}).setdefault("lat" if found[1] == "lat" else "lng", name)
    for end, pair in ends.items():
        param = known.get(_PLACE + end) or (places[0] if not end and len(places) == 1 else None)
        if param is not None and param.type.name == "place":
            yield Degrees(param, (pair.get("lat") or pair["lng"], pair["lng"] if len(pair) == 2 else ""))


def given_params(params: Mapping[str, Param], given: Iterable[str]) -> set[str]:
    """Return the names of the params that callers gave, under whatever names."""
    names = list(given)
    known = by_alias(params)
    apart = {name: one.param.name for one in degrees_of(params, names) for name in one.names}
    return {known[name].name if name in known else apart.get(name, name) for name in names}
