"""Who goes where, in the short form: one machine, a team of several, one place or a list of places.

A team is a role with a count. What it is told, all its members do at the same time, each at its own place of a list; the next
step waits for all of them. A single machine flies a list of places one after another. Two machines never use one spot.
"""

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Final

from formiga_bt.llm.words.wording import Words

GAP: Final = "5 m"
"""Between machines where the request says nothing."""
_LIST: Final = re.compile(r"(?:circle|zigzag|line|triangle|polygon|reverse|lawnmower)\s*\(.*\)|\[.*\]", re.DOTALL)
_APART: Final = re.compile(
    r"\W*(?:apart|from each other|from one another|between (?:them|the two|both|each)|between\b(?=\s*[.,;)]|$)|of space\b|"
    r"beside each other|off each other|from the (?:other|first)\b|between (?:the )?(?:neighbou?rs|machines|drones|any two)\b|"
    r"(?:uno|una) (?:del?|de la) otr[oa]|entre (?:s[ií]|ellos|ellas|los dos|cada)\b|de separaci[oó]n\b|de distancia entre\b)",
    re.IGNORECASE,
)
_COMPASS: Final = re.compile(r"\b(south|west)\s*=\s*(-?)\s*(?=[\dA-Za-z_])")
_AWAY: Final = re.compile(r"(?:\d\s*k?m|\bmet(?:er|re)s?|\baway|\bfar|\bapart)\s+$", re.IGNORECASE)
"""What stands before a `from` that begins no way: `20 m from the camp`."""
_WAY: Final = re.compile(r"(zigzag|line)\(\s*([A-Za-z_]\w*)\s*,\s*([A-Za-z_]\w*)\s*,(.*)\)", re.DOTALL)

_FLIES_BACK: Final = re.compile(
    r"\b(?:zig-?zag\w*|weav\w+|swing\w*|snak\w+|slalom\w*)\s+(?:\w+\s+){0,3}?back\b(?!\s+(?:home|and\s+forth))"
    r"|\bback\s+(?:again\s+)?(?:in|by|with|along)\s+(?:an?\s+)?(?:\w+\s+)?(?:zig-?zag\w*|slalom|line)"
    r"|\b(?:way|leg|trip|flight)\s+back\b(?!\s+home)|\breturn(?:s|ing)?\s+(?:\w+\s+){0,2}?(?:in|by|with)\s+(?:an?\s+)?(?:\w+\s+)?zig-?zag"
    r"|\b(?:vuel[vt]\w+|regres\w+)\s+(?:\w+\s+){0,2}?en\s+zig-?zag",
    re.IGNORECASE,
)
"""A way that is flown back need not begin where the request says `from`."""

_ROW: Final = re.compile(
    r"line\(\s*([A-Za-z_]\w*)\s*,\s*offset\(\s*\1\s*,\s*(north|east)\s*=\s*(-?)\s*(\d+(?:\.\d+)?)\s*m\s*\)\s*,\s*(\d+)\s*\)"
)


def is_list(text: str) -> bool:
    """Return whether a value means several places."""
    return _LIST.fullmatch(text.strip()) is not None


def gap_of(words: Words) -> str:
    """Return how far apart machines are to be, as the request says it, or ""."""
    for amount in words.amounts:
        if amount.type != "distance":
            continue
        before, after = words.text[: amount.at], words.text[amount.at + len(amount.words) :]
        if _APART.match(after) or re.search(r"\b(?:spacing|gap)(?: of| is)?\s*$", before, re.IGNORECASE):
            return f"{amount.si:g} m"
    return ""


def in_a_row(place: str, count: int, gap: str) -> str:
    """Return a list of places for a team that is sent to one place: side by side."""
    metres = float(gap.split()[0]) * (count - 1)
    return f"line({place}, offset({place}, east={metres:g} m), {count})"


def spaced(text: str, count: int, gap: str) -> str:
    """Return a row for a team, with the gap between neighbours as a value of its own.

    A model gives the gap as the length of the whole row, too.

    Args:
        text: the value; what is no such row is returned as it is.
        count: how many they are.
        gap: as the request says it; "" = it says nothing.
    """
    row = _ROW.fullmatch(text.strip())
    metres = float(gap.split()[0]) if gap else 0.0
    if row is None or count < 3 or int(row[5]) != count or float(row[4]) not in (metres, metres * (count - 1)):
        return text
    place, way = row[1], f"{row[2]}={row[3]}"
    further = (f"offset({place}, {way}{f'{n} * ' if n > 1 else ''}{gap})" for n in range(1, count))
    return f"[{', '.join([place, *further])}]"


def in_compass(text: str) -> str:
    """Return a value in which `south=5 m` is `north=-5 m`."""

    def turned(match: re.Match[str]) -> str:
        return f"{'north' if match[1] == 'south' else 'east'}={'' if match[2] else '-'}"

    return _COMPASS.sub(turned, text)


def turned_round(text: str, words: Words, been: Sequence[str] = ()) -> str:
    """Return a way with its ends as the request has them, if the model has them the wrong way round.

    Args:
        text: the way; what is none is returned as it is.
        words: the request.
        been: where the machine was sent before: who was at both ends flies back.
    """
    match = _WAY.fullmatch(text.strip())
    if match is None or _FLIES_BACK.search(words.text) or (match[3] in been[:-1] and been[-1] == match[2]):
        return text
    ends = from_to(words)
    return f"{match[1]}({match[3]}, {match[2]},{match[4]})" if (match[3], match[2]) in ends else text


def from_to(words: Words) -> set[tuple[str, str]]:
    """Return the pairs of places of which the request says `from the one to the other`, and of the way back says nothing."""
    ways = set(_ways(words))
    return {(a, b) for a, b in ways if a != b and (b, a) not in ways}


def _ways(words: Words) -> Iterator[tuple[str, str]]:
    """Yield the two ends of each way, as the text has them: two ways of `from A to B and on to C`.

    A way ends at the first place that it goes to; what is told after that, `from A to B, one goes to C`, is another matter.
    """
    names = {text.casefold(): name for name, text in words.places.items()}
    if not names:
        return
    place = rf"(?:the\s+)?({'|'.join(map(re.escape, sorted(names, key=len, reverse=True)))})(?!\w)"
    way = re.compile(rf"\bfrom\s+{place}(?:(?!\bfrom\b)[^.;])*?\b(?:to|towards?|until)\s+{place}", re.IGNORECASE)
    more = re.compile(rf",?(?:\s+and)?(?:\s+then)?(?:\s+on)?\s+to\s+{place}", re.IGNORECASE)
    for found in way.finditer(words.text):
        if _AWAY.search(words.text[: found.start()]):
            continue
        seen = [names[found[1].casefold()], names[found[2].casefold()]]
        at = found.end()
        while (on := more.match(words.text, at)) is not None and names[on[1].casefold()] not in seen:
            seen.append(names[on[1].casefold()])
            at = on.end()
        yield from pairwise(seen)


def member_of(team: str, taken: set[str]) -> str:
    """Return what one member of a team is called: `drone` of `drones`."""
    name = team[:-1] if len(team) > 2 and team.endswith("s") else f"each_of_{team}"
    while name in taken:
        name = f"each_{name}"
    return name
