"""What a request says for certain of questions to people: who is asked, who must agree, and what has been done by then.

    Ask picker_1 and then picker_2 whether they are ready.      both, each by itself
    A watcher or a picker must agree.                           one of them
    It hovers over the camp; if a watcher agrees, it lands.     it is over the camp when the watcher is asked

What can be read in two ways is not read: who compares a task with it must not raise a wrong alarm.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from formiga_bt.llm.words.mentions import unquoted
from formiga_bt.llm.words.moments import Next, moment_of
from formiga_bt.llm.words.question_words import AGREES, ASKED, AUX, BY, CASE, DET, SAYS, YES, clause_of
from formiga_bt.llm.words.spoken import pattern_of
from formiga_bt.llm.words.wording import PEOPLE, Words
from formiga_bt.llm.world import RequestWorld

_LINK: Final = re.compile(
    rf"[\s)]*(?:there\s*)?(?:'s)?\s*(?:{AUX}(?:{SAYS}))?[\s,)]*(?:(?:and|y|e|or|o|u|then|also|afterwards|next|likewise|plus|"
    r"luego|después|además|también|followed by|as well as|so (?:does|do|must|has)|after (?:that|him|her))[\s,]+)*"
    r"(?:(?:asks?|pregunta|consulta)\s+)?"
    rf"(?:(?:an?|the|el|un)\s+)?(?:{YES}\s+{BY}\s+)?(?:(?:from|by|to|of|de)\s+)?{DET}[\s(]*",
    CASE,
)
"""What stands between two people of one question."""
_GOES_ON: Final = re.compile(
    rf"[\s,;)]*(?:que\s+)?{AUX}(?:{SAYS})?[\s,;]*(?:(?:and|y|then|also|after that|luego|después|have|has|get|"
    rf"asks?|pide|permission|permiso|{YES}|from|of|by|al?|de)\s+)*{DET}",
    CASE,
)
"""What stands between two questions that are one."""
_JOINS: Final = re.compile(r"[,]|\b(?:and|y|e|or|o|u|then|also|plus|luego|después|followed|well)\b", CASE)
_OR: Final = re.compile(r"\b(?:or|o|u)\b", CASE)
_ONE_OF: Final = re.compile(
    r"\b(?:either|(?:one|any|some) of|whoever|which(?:ever)? of|uno de|alguno de|cualquiera de)\s+(?:\w+\s+)?$", CASE
)
_SAYS_NO: Final = re.compile(
    r"[\s),]*(?:\w+\s+)?(?:says?|said|answers?|dicen?|digan?)\s+(?:que\s+)?no\b|[\s),]*(?:\w+\s+)?(?:need |does |do |is |are )?"
    r"(?:not|n't)\b",
    CASE,
)
_OTHER_CASE: Final = re.compile(
    r"\b(?:no|not|never|otherwise|else|unless|without|instead|neither|nobody|sin|nunca|tampoco|ni|or|o|failing)\b|n't\b",
    CASE,
)
_IF: Final = re.compile(r"\b(?:if|when|whenever|in case|should|si|cuando|en caso)\b", CASE)
_THERE: Final = re.compile(
    r"\b(?:when|once|cuando)\b[^,]*\b(?:there|land\w*|arriv\w*|hover\w*|over|down|aterri\w*|lleg\w*|allí)\b", CASE
)


@dataclass(frozen=True, slots=True)
class Person:
    """Somebody to be asked."""

    type: str
    id: str = ""
    """"" = anybody of the type."""


@dataclass(frozen=True, slots=True)
class AskedQuestion:
    """People who are asked something at one moment."""

    people: tuple[Person, ...]
    all: bool
    """Whether each of them must agree; else any of them."""
    start: int
    """Where the words begin that name them."""
    end: int
    after: tuple[str, ...] = ()
    """Places where the machine has been by then, for certain."""
    then: Next = ""


@dataclass(frozen=True, slots=True)
class _Mention:
    people: tuple[Person, ...]
    start: int
    end: int


def questions(words: Words, world: RequestWorld) -> tuple[AskedQuestion, ...]:
    """Return the questions that a request speaks of for certain, in its order; a person is in the first one only.

    Args:
        words: the request, as read.
        world: its people.
    """
    text = unquoted(in_one_line(words))
    found: list[AskedQuestion] = []
    seen: set[Person] = set()
    for group in _groups(text, list(_mentions(text, words, world))):
        start, end = group[0].start, group[-1].end
        people = tuple(dict.fromkeys(one for mention in group for one in mention.people))
        known = all(one in seen or (not one.id and one.type in {p.type for p in seen}) for one in people)
        if known or not _is_asked(text, group):
            continue
        seen |= set(people)
        between = "".join(text[a.end : b.start] for a, b in pairwise(group))
        any_ = _OR.search(between) is not None or _ONE_OF.search(text[:start]) is not None
        after, then = moment_of(text, start, end, words, world)
        found.append(AskedQuestion(people, not any_, start, end, after, then))
    return tuple(_together(text, found))


def _together(text: str, found: Iterable[AskedQuestion]) -> Iterator[AskedQuestion]:
    """Yield the questions; those are one of which each only goes on with the people: `ask her; then have him confirm`."""
    last: AskedQuestion | None = None
    for one in found:
        between = text[last.end : one.start] if last is not None else ""
        if last is not None and last.all and one.all and _GOES_ON.fullmatch(between) is not None and not last.after:
            last = AskedQuestion((*last.people, *one.people), True, last.start, one.end, one.after, one.then)
            continue
        if last is not None:
            yield last
        last = one
    if last is not None:
        yield last


def in_one_line(words: Words) -> str:
    """Return a request without runs of white space; where something stands in it is meant so."""
    return " ".join(words.text.split())


def _mentions(text: str, words: Words, world: RequestWorld) -> Iterator[_Mention]:
    """Yield whom a text names, in its order; a type that only says what somebody named by id is, is left out."""
    types, agents = world.catalogue.types, world.site.agents
    ids = [one for one in words.agents if types[agents[one].type].human]
    named = [
        _Mention((Person(agents[one].type, one),), *match.span())
        for one in ids
        for match in re.finditer(pattern_of(one), text, CASE)
    ]
    found = list(named)
    for type_ in types.values():
        if not type_.human or type_.name == "person":
            continue
        nouns = {type_.name, *([type_.label] if type_.label else []), *PEOPLE.get(type_.name, ())}
        of_type = [one.id for one in agents.values() if one.type == type_.name]
        pattern = rf"(?<![\w-])(?P<noun>{'|'.join(map(re.escape, sorted(nouns, key=len, reverse=True)))})(?P<s>s|es)?(?![\w-])"
        for match in re.finditer(pattern, text, CASE):
            before, after = text[: match.start()], text[match.end() :]
            if any(
                one.start - match.end() >= 0 and _IS_NAMED.fullmatch(text[match.end() : one.start]) for one in named
            ):
                continue
            if any(match.start() - one.end >= 0 and _IS_A.fullmatch(text[one.end : match.start()]) for one in named):
                continue
            same = [one for one in ids if agents[one].type == type_.name]
            if match["s"] or re.search(r"\b(?:all|every|each|todos los)\s+(?:the\s+)?$", before, CASE):
                people = _several(before, type_.name, of_type)
            elif same and re.search(r"\b(?:the|this|that|el|la|al|del)\s+$", before, CASE):
                people = (Person(type_.name, same[0]),) if len(same) == 1 else ()
            else:
                people = (Person(type_.name),)
            if people and not after.startswith("_"):
                found.append(_Mention(people, *match.span()))
    yield from sorted(found, key=lambda one: one.start)


_IS_NAMED: Final = re.compile(r"\s*(?:there|here|allí|ahí)?[\s,(:]*(?:called |named )?", CASE)
"""What stands between `the picker` and its id."""
_IS_A: Final = re.compile(r"\s*[,(]\s*(?:an?|the|un|una|el|la)\s+", CASE)


def _several(before: str, type_: str, ids: list[str]) -> tuple[Person, ...]:
    """Return whom `both pickers` means; a plain `pickers` is any of them."""
    two = re.search(r"\b(?:both|the two|two|ambos|los dos|dos)\s+(?:the\s+)?$", before, CASE) is not None
    every = re.search(r"\b(?:all|every|each|todos los)\s+(?:the\s+)?$", before, CASE) is not None
    if every or (two and len(ids) == 2):
        return tuple(Person(type_, one) for one in ids)
    return (Person(type_),)


def _groups(text: str, mentions: list[_Mention]) -> Iterator[list[_Mention]]:
    """Yield the people who are named together: `picker_1, then picker_2`; `a yes from the one and a yes from the other`."""
    group: list[_Mention] = []
    for one in mentions:
        between = text[group[-1].end : one.start] if group else ""
        if group and not (_LINK.fullmatch(between) and _JOINS.search(between)):
            yield group
            group = []
        group.append(one)
    if group:
        yield group


def _is_asked(text: str, group: Sequence[_Mention]) -> bool:
    """Return whether those who are named together are asked for certain, not only if something else happens."""
    start, end = group[0].start, group[-1].end
    clause = text[clause_of(text, start) : start]
    if (
        _SAYS_NO.match(text, end) is not None
        or _OR.match(text[end:].lstrip(" ,)"))
        or _OTHER_CASE.search(clause) is not None
    ):
        return False
    before = ASKED.search(clause)
    if before is not None:
        is_reported = before["ask"] or before["put"]
        lead = clause[: before.start()]
        return not is_reported or _IF.search(lead) is None or _THERE.search(lead) is not None
    return any(AGREES.match(text, one.end) is not None for one in group)
