"""Of which machines of a tree a sentence speaks: `the second`, `both`, `two light drones`, `el otro`."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from formiga_bt.llm.edits.steps import EditCase, Machine
from formiga_bt.llm.words.amounts import NUMBERS
from formiga_bt.llm.words.wording import INTENTS, LIGHT_HEAVY

_NOUN: Final = r"(?:drones?|dron|uavs?|machines?|ones?)"
_OF_SOME: Final = (
    r"(?:\s+(?:of|de)\s+(?:the\s+|them\b|l[ao]s\s+)?(?:two|three|four|five|\d|dos|tres)?\s*"
    r"(?:[\w-]+\s+)?(?:drones|uavs)?)?"
)
_NO_TIME: Final = r"\b(?!\s+(?:time|place|minute|second|met\w+|lap|round)\b)"
_TYPES: Final = {word: name for name, words in LIGHT_HEAVY.items() for word in words}
_TYPE: Final = "|".join(map(re.escape, sorted(_TYPES, key=len, reverse=True)))
_MENTION: Final = re.compile(
    rf"(?<!\w)(?:(?P<first>(?:the|el|la) (?:first|primer[oa]?){_NO_TIME}(?:\s+{_NOUN}\b)?{_OF_SOME})"
    rf"|(?P<second>(?:the|a|el|la|un) (?:second|segund[oa]){_NO_TIME}(?:\s+{_NOUN}\b)?{_OF_SOME})"
    rf"|(?P<third>(?:the|a|el|la|un) (?:third|tercer[oa]?){_NO_TIME}(?:\s+{_NOUN}\b)?{_OF_SOME})"
    rf"|(?P<other>(?:the other|another|el otro|la otra|otro|otra){_NO_TIME}(?:\s+{_NOUN}\b)?)"
    rf"|(?:(?P<number>\d+|{'|'.join(NUMBERS)})\s+)?"
    rf"(?:(?P<type>(?:{_TYPE})\b(?:\s+(?:drones?|uavs?|dron)\b)?)|(?P<many>(?:drones|uavs|machines)\b))"
    r"|(?P<one>(?:one|uno)\b(?:\s+(?:of|de)\s+(?:them|ellos|(?:the|los)\s+(?:[\w-]+\s+){0,2}(?:drones|uavs|lwds|hwds))\b"
    r"|(?=\s+(?:drone|dron|uav|\w+s|\w+a|\w+e)\b)))"
    r"|(?P<all>(?:both|each|they|amb[oa]s|l[oa]s (?:dos|tres)\b(?! \w+es\b)|"
    r"tod[oa]s|cada un[oa]|all(?! (?:of )?the (?!drones|machines)))\b))",
    re.IGNORECASE,
)
_END: Final = re.compile(r"[.;!?](?=\s|$)")


@dataclass(frozen=True, slots=True)
class Subject:
    """Who is spoken of."""

    names: frozenset[str]
    """Roles. Of one machine: all that may be meant."""
    is_all: bool = False
    """All of them are meant."""


def who(case: EditCase, until: int, since: int = 0) -> Subject | None:
    """Return who is spoken of last before a position of the request, in the same sentence; None = nobody is named.

    Args:
        case: its machines are meant.
        until: the position of what is done.
        since: what stands before this is not looked at.
    """
    text = case.words.text
    begins = [found.end() for found in _END.finditer(text, 0, until)]
    begin = max(since, begins[-1] if begins else 0)
    machines = case.machines
    mentions = [*_mentions(case, begin, until)]
    found: Subject | None = None
    for match, id_ in mentions:
        found = _of_id(machines, id_, case) if id_ else _meant(match, machines, case, found)
    if found is None and len(machines) == 1:
        return Subject(frozenset({machines[0].name}), is_all=True)
    return found


def homes(case: EditCase) -> Iterator[tuple[int, int]]:
    """Yield where the request speaks of a way home."""
    text = re.sub(r'"[^"]*"', lambda quoted: " " * len(quoted[0]), case.words.text.casefold())
    yield from (found.span() for found in re.finditer(INTENTS["home"], text))


def _mentions(case: EditCase, begin: int, until: int) -> list[tuple[re.Match[str], str]]:
    text = case.words.text
    found = [(match, "") for match in _MENTION.finditer(text, begin) if match.end() <= until]
    for name, said in case.words.agents.items():
        found += [(match, name) for match in re.finditer(re.escape(said), text[:until]) if match.start() >= begin]
    return sorted(found, key=lambda one: one[0].start())


def _of_id(machines: Sequence[Machine], id_: str, case: EditCase) -> Subject:
    named = [one.name for one in machines if one.id == id_]
    type_ = case.world.site.agents[id_].type
    return Subject(frozenset(named or (one.name for one in machines if one.type == type_ and not one.id)))


def _meant(match: re.Match[str], machines: Sequence[Machine], case: EditCase, before: Subject | None) -> Subject:
    kind = match.lastgroup or ""
    everybody = frozenset(one.name for one in machines)
    if kind in ("first", "second", "third"):
        index = ("first", "second", "third").index(kind)
        alone = all(one.count == 1 for one in machines) and index < len(machines)
        return Subject(frozenset({machines[index].name}) if alone else frozenset())
    if kind == "other":
        of_one = before is not None and len(before.names) == 1
        return Subject(everybody - before.names if of_one and before is not None else everybody)
    if kind == "type":
        types, said = case.world.catalogue.types, match["type"].casefold()
        type_ = next(_TYPES[word] for word in sorted(_TYPES, key=len, reverse=True) if said.startswith(word))
        same = [one for one in machines if type_ in (one.type, *types[one.type].extends)]
        return _counted(same, match["number"], is_many=said.endswith("s"))
    if kind == "one":
        return Subject(everybody)
    return Subject(everybody, is_all=True) if kind == "all" else _counted(machines, match["number"], is_many=True)


def _counted(machines: Sequence[Machine], number: str | None, *, is_many: bool) -> Subject:
    """Return all of some machines, if there are as many of them as are spoken of; or one of them."""
    names = frozenset(one.name for one in machines)
    if not is_many:
        return Subject(names, is_all=sum(one.count for one in machines) == 1)
    wanted = (int(number) if number.isdigit() else NUMBERS[number.casefold()]) if number else 0
    return Subject(names if not wanted or wanted == sum(one.count for one in machines) else frozenset(), is_all=True)
