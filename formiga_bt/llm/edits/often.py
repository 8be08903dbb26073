"""Edits for what is to be done several times: the laps of a ring, the rounds between two places."""

import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

from formiga_bt.llm.edits.steps import EditCase, Edited, Found, at, span, steps_of
from formiga_bt.llm.edits.who import who

_LAPS: Final = re.compile(r"\b(?:laps|rounds|vueltas)$", re.IGNORECASE)
_CLOSED: Final = ("circle", "triangle", "polygon")
_NAMED: Final[Mapping[str, str]] = {
    "circle": r"\b(?:circle\w*|circling|ring|orbit\w*|around|round|c[ií]rculo|anillo|rode\w+|alrededor)\b",
    "zigzag": r"\bzig-?zag\w*",
    "triangle": r"\btri[aá]ng\w+",
}
"""Figure -> words of a sentence that speaks of it."""
_FIGURE: Final = re.compile(r"\s*([a-z]+)\(")
_TWO: Final = re.compile(r"\s*\[\s*(\w+)\s*,\s*(\w+)\s*\]\s*|\s*line\(\s*(\w+)\s*,\s*(\w+)\s*,.*\)\s*")


def repeated(case: EditCase) -> Iterator[Edited]:
    """What is to be done several times, and stands there once, is repeated: not the take-off, not the way home."""
    said, often = case.wrong.about, case.wrong.wanted
    begin = case.words.text.find(said)
    if begin < 0 or often < 2 or not case.is_plain:
        return
    ends = _ends(case, begin, begin + len(said))
    found = _between(case, *ends) if ends is not None else _figure(case, begin, said)
    if found is None:
        return
    (path, first), count, what = found
    machines = {one.name: one.count for one in case.machines}
    agent, subject = str(first.get("agent")), who(case, begin)
    if machines.get(agent) != 1 or (subject is not None and (agent not in subject.names)):
        return
    if subject is not None and subject.is_all and len(subject.names) > 1:
        return  # each of several
    listed, index = at(case.tree, path[:-1]), int(path[-1])
    again = {"repeat": str(often), "steps": listed[index : index + count]}
    yield span(case.tree, path, count, [again]), f"{agent} flies {what} {often} times, as the request says"


def _figure(case: EditCase, begin: int, said: str) -> tuple[Found, int, str] | None:
    """Return the one figure that is flown, if the words are those of its laps."""
    flown = [(one, name) for one in steps_of(case.tree) if (name := _figure_of(one))]
    if len(flown) != 1:
        return None
    one, name = flown[0]
    is_meant = _LAPS.search(said) and name in _CLOSED
    return (one, 1, f"the {name}") if is_meant or _is_beside(case.words.text, begin, said, name) else None


def _is_beside(text: str, begin: int, said: str, figure: str) -> bool:
    """Return whether a number of times is one of a figure: `circles the camp 3 times`, `3 times round the camp`."""
    if figure not in _NAMED:
        return False
    since = max(text.rfind(mark, 0, begin) for mark in (". ", "; ")) + 1
    before = [match.end() for match in re.finditer(_NAMED[figure], text[since:begin], re.IGNORECASE)]
    if before and re.search(r"\b(?:and|then|y|luego)\b|,", text[since + before[-1] : begin], re.IGNORECASE) is None:
        return True
    return re.match(rf"\s+(?:in a |en )?(?:{_NAMED[figure]})", text[begin + len(said) :], re.IGNORECASE) is not None


def _figure_of(found: Found) -> str:
    way = found[1].get("way") if found[1].get("do") == "FlyAlong" else None
    match = _FIGURE.match(way) if isinstance(way, str) else None
    return match[1] if match is not None and match[1] != "line" else ""


def _ends(case: EditCase, begin: int, end: int) -> tuple[str, str] | None:
    """Return the two places between which a machine flies so often, where they stand beside the number."""
    names = {said.casefold(): name for name, said in case.words.places.items()}
    if not names:
        return None
    place = rf"(?:the\s+|el\s+|la\s+)?({'|'.join(map(re.escape, sorted(names, key=len, reverse=True)))})(?!\w)"
    ways = rf"(?:from|between|desde|del?|entre)\s+{place}\s+(?:to|and|al?|hasta|y)\s+{place}"
    text = case.words.text
    behind = re.compile(rf"\s+(?:back and forth\s+)?{ways}", re.IGNORECASE).match(text, end)
    before = re.search(rf"{ways}(?:,?\s+back and forth)?,?\s*$", text[:begin], re.IGNORECASE)
    found = behind or before
    return None if found is None else (names[found[1].casefold()], names[found[2].casefold()])


def _between(case: EditCase, one: str, other: str) -> tuple[Found, int, str] | None:
    """Return where a machine flies to one place and then to another, how many steps that are, and what it is."""
    what, steps = f"from {one} to {other}", list(steps_of(case.tree))
    whole = [found for found in steps if _is_way(found[1], one, other)]
    goals = [found for found in steps if found[1].get("to", found[1].get("at")) in (one, other)]
    if len(whole) == 1 and not goals:
        return whole[0], 1, what
    if whole or len(goals) != 2 or [step.get("to", step.get("at")) for _, step in goals] != [one, other]:
        return None
    (first, a), (last, b) = goals
    if first[:-1] != last[:-1] or first[-2] == "parallel" or a.get("agent") != b.get("agent"):
        return None
    listed: list[Any] = at(case.tree, first[:-1])
    begin, end = int(first[-1]), int(last[-1]) + 1
    if not all(isinstance(step, dict) and ("wait" in step or step in (a, b)) for step in listed[begin:end]):
        return None
    if end < len(listed) and isinstance(listed[end], dict) and "wait" in listed[end]:
        end += 1
    return goals[0], end - begin, what


def _is_way(step: Mapping[str, Any], one: str, other: str) -> bool:
    match = _TWO.fullmatch(step["way"]) if isinstance(step.get("way"), str) else None
    return match is not None and (match[1] or match[3], match[2] or match[4]) == (one, other)
