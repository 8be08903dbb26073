"""What a request says for certain of questions to people: who is asked, who must agree, and what has been done by then.

    Ask picker_1 and then picker_2 whether they are ready.      both, each by itself
    A watcher or a picker must agree.                           one of them
    It hovers over the camp; if a watcher agrees, it lands.     it is over the camp when the watcher is asked

What can be read in two ways is not read: who compares a task with it must not raise a wrong alarm.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Literal

from formiga_bt.geo import Place
from formiga_bt.llm.mentions import unquoted
from formiga_bt.llm.spoken import pattern_of
from formiga_bt.llm.wording import PEOPLE, Words
from formiga_bt.llm.world import World

Next = Literal["land", "leave", "go on", ""]
"""What a yes leads to: a landing, a way from where the machine is, a wait that ends; "" = that is not read."""
_I: Final = re.IGNORECASE
_DET: Final = (
    r"(?:(?:(?:one|any|some|uno|alguno|cualquiera) (?:of|de)|both|either|the|an?|one|another|some|el|la|los|las|un|una|otro|"
    r"otra|al?|del?)\s+)*"
)
_YES: Final = (
    r"(?:yes|ok|okay|permission|approval|confirmation|consent|agreement|word|go-ahead|clearance|answer|"
    r"s[ií]|permiso|confirmación|aprobación|visto bueno)"
)
_BY: Final = r"(?:from|of|by|de|del)"
_SAYS: Final = (
    rf"(?:says?|said|answers?|answered)\s+(?:yes|so|that|it|ok|okay)\b|(?:gives?|gave|given)\s+(?:\w+\s+)?{_YES}\b"
    r"|(?:agree|confirm|approve|permit|consent|okay)(?:s|d|ed|ted|ting)?\b|allows?\b|allowed\b"
    r"|di(?:ce|cen|ga|gan|cho)\s+(?:que\s+)?s[ií]\b|confirm[ae]n?\b|aprueb[ae]n?\b|acept[ae]n?\b|autori[cz][ae]n?\b"
    rf"|d(?:a|an|é|en)\s+(?:\w+\s+)?{_YES}\b|est[áé]n? de acuerdo\b"
)
_LINK: Final = re.compile(
    rf"[\s)]*(?:there\s*)?(?:{_SAYS})?[\s,)]*(?:(?:and|y|e|or|o|u|then|also|afterwards|next|likewise|plus|luego|después|además|"
    r"también|followed by|as well as|after (?:that|him|her))[\s,]+)*(?:(?:asks?|pregunta|consulta)\s+)?"
    rf"(?:(?:an?|the|el|un)\s+)?(?:{_YES}\s+{_BY}\s+)?(?:(?:from|by|to)\s+)?{_DET}[\s(]*",
    _I,
)
"""What stands between two people of one question."""
_JOINS: Final = re.compile(r"[,]|\b(?:and|y|e|or|o|u|then|also|plus|luego|después|followed|well)\b", _I)
_OR: Final = re.compile(r"\b(?:or|o|u)\b", _I)
_ONE_OF: Final = re.compile(
    r"\b(?:either|(?:one|any|some) of|whoever|which(?:ever)? of|uno de|alguno de|cualquiera de)\s+(?:\w+\s+)?$", _I
)
_ASK: Final = r"\b(?:asks?|asking|consults?|preg[uú]nt(?:a|e|ar|an|en)(?:les?)?|consult(?:a|e|ar|an|en)(?:les?)?)"
_ASKED_BEFORE: Final = re.compile(
    rf"(?P<ask>{_ASK})\s+(?:first\s+|primero\s+)?(?:for\s+)?(?:{_YES}\s+{_BY}\s+)?{_DET}$"
    rf"|\b{_YES}\s+{_BY}\s+{_DET}$"
    rf"|\b(?:approved|confirmed|allowed|cleared|authori[sz]ed|okayed)\s+by\s+{_DET}$"
    rf"|(?P<put>\b(?:puts?|poses?)\s+(?:the|an?|one|this|that)\s+question|\bha(?:z|ga) una pregunta)\s+(?:to|al?)\s+{_DET}$",
    _I,
)
_AUX: Final = (
    r"(?:(?:both|each|all|have|has|had|must|need to|needs to|is to|are to|should|shall|will|also|first|ambos|los dos|también|"
    r"haya|hayan|ha|han|deben?|tienen? que)\s+)*"
)
_AGREES_AFTER: Final = re.compile(
    rf"[\s),]*(?:there\s+|allí\s+)?{_AUX}(?:{_SAYS}|(?:is|are|must be)\s+asked\b)|'s\s+{_YES}\b", _I
)
_SAYS_NO: Final = re.compile(
    r"[\s),]*(?:\w+\s+)?(?:says?|said|answers?|dicen?|digan?)\s+(?:que\s+)?no\b|[\s),]*(?:\w+\s+)?(?:need |does |do |is |are )?"
    r"(?:not|n't)\b",
    _I,
)
_OTHER_CASE: Final = re.compile(
    r"\b(?:no|not|never|otherwise|else|unless|without|instead|neither|nobody|sin|nunca|tampoco|ni|or|o|failing)\b|n't\b",
    _I,
)
_IF: Final = re.compile(r"\b(?:if|when|whenever|in case|should|si|cuando|en caso)\b", _I)
_THERE: Final = re.compile(
    r"\b(?:when|once|cuando)\b[^,]*\b(?:there|land\w*|arriv\w*|hover\w*|over|down|aterri\w*|lleg\w*|allí)\b", _I
)
_CONDITION: Final = re.compile(
    r"\b(?P<only>only\s+|s[oó]lo\s+|solamente\s+)?(?P<word>if|when|once|as soon as|after|until|provided(?: that)?|si|cuando|"
    r"en cuanto|hasta que|después de que)\s+(?:[^,.;:]*?\s)?$",
    _I,
)
_CONSEQUENT: Final = (
    r"\s*(?:then\s+|entonces\s+)?(?P<who>(?:it|the (?:\w+ )?drone|el dron(?: \w+)?|(?:lwd|hwd)_\d+)\s+)?"
    r"(?:may\s+|can\s+|is to\s+|shall\s+|puede\s+|debe\s+)?(?:then\s+)?"
)
_LAND: Final = r"(?:lands?|(?:goes|go|comes|come|sets|set) down|descends?|touch\w* down|aterri\w+|baja|desciend\w+)\b"
_LEAVE: Final = (
    r"(?:(?:comes?|fl(?:y|ies)|goes?|heads?|gets?) (?:(?:back|straight|right) )?home|(?:comes?|fl(?:y|ies)|goes?|heads?) back|"
    r"returns?|(?:takes?|lifts?) off again|(?:fl(?:y|ies)|goes?|carr(?:y|ies)) on|continues?|home|"
    r"vuelv\w+|regres\w+|despeg\w+ (?:de nuevo|otra vez)|sigu?e\w*|contin\w+)\b"
)
_WAITS: Final = re.compile(
    r"\b(?:waits?|hovers?|stays?|hangs?|holds?|stands?|espera|flota|se queda|permanece)\b[^,.;:]*$", _I
)
_TURNED: Final = re.compile(
    r"\b(?:before(?:hand)?|prior|previously|in advance|ahead|antes|previamente|de antemano|once allowed|meanwhile|while|"
    r"mientras|permission|permiso|(?:first|primero),?\s+(?:it\s+)?(?:asks?|pregunta)|asks?\s+first|pregunta primero)\b",
    _I,
)
"""What may turn the order of a sentence round."""
_BEFORE_LEAVING: Final = re.compile(rf"[^.;:]*?\b(?P<b>before|antes de(?: que)?)(?={_CONSEQUENT}{_LEAVE})", _I)
_PLANNED: Final = re.compile(
    r"\b(?:is to|are to|shall|should|may|can|could|would|wants?|plan\w*|must|ready|about to|deb\w+|pued\w+|quier\w+|tiene que|"
    r"if|when|once|si|cuando|not|never|no|or|o)\b",
    _I,
)
_ASIDE: Final = re.compile(
    r"\b(?:circ\w+|c[ií]rc\w+|orbit\w*|rings?|zig\w*|laps?|vueltas?|round|around|alrededor|between|entre|near|beside|next|"
    r"from|desde|(?:north|south|east|west) of|al (?:norte|sur|este|oeste)|line|triang\w*|every|each|repeat\w*|cada)\b",
    _I,
)
_GOES_TO: Final = re.compile(
    r"\b(?:to|over|at|above|onto|on|in|al?|sobre|en|hasta|encima de)\s+(?:the\s+|el\s+|la\s+|los\s+|las\s+)?$", _I
)
_BOUNDARY: Final = re.compile(r"[.;:](?!\d)")
_PART: Final = re.compile(r"[.;:,](?!\d)|\b(?:and|then|y|luego|entonces)\b", _I)


@dataclass(frozen=True, slots=True)
class Person:
    """Somebody to be asked."""

    type: str
    id: str = ""
    """"" = anybody of the type."""


@dataclass(frozen=True, slots=True)
class Question:
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


def questions(words: Words, world: World) -> tuple[Question, ...]:
    """Return the questions that a request speaks of for certain, in its order; a person is in the first one only.

    Args:
        words: the request, as read.
        world: its people.
    """
    text = unquoted(words.text)
    found: list[Question] = []
    seen: set[Person] = set()
    for group in _groups(text, list(_mentions(text, words, world))):
        start, end = group[0].start, group[-1].end
        people = tuple(dict.fromkeys(one for mention in group for one in mention.people))
        known = all(one in seen or (not one.id and one.type in {p.type for p in seen}) for one in people)
        if known or not _is_asked(text, start, end):
            continue
        seen |= set(people)
        between = "".join(text[a.end : b.start] for a, b in pairwise(group))
        any_ = _OR.search(between) is not None or _ONE_OF.search(text[:start]) is not None
        after, then = _moment(text, start, end, words, world)
        found.append(Question(people, not any_, start, end, after, then))
    return tuple(found)


def _mentions(text: str, words: Words, world: World) -> Iterator[_Mention]:
    """Yield whom a text names, in its order; a type that only says what somebody named by id is, is left out."""
    types, agents = world.catalogue.types, world.site.agents
    ids = [one for one in words.agents if types[agents[one].type].human]
    named = [
        _Mention((Person(agents[one].type, one),), *match.span())
        for one in ids
        for match in re.finditer(pattern_of(one), text, _I)
    ]
    found = list(named)
    for type_ in types.values():
        if not type_.human or type_.name == "person":
            continue
        nouns = {type_.name, *([type_.label] if type_.label else []), *PEOPLE.get(type_.name, ())}
        of_type = [one.id for one in agents.values() if one.type == type_.name]
        pattern = rf"(?<![\w-])(?P<noun>{'|'.join(map(re.escape, sorted(nouns, key=len, reverse=True)))})(?P<s>s|es)?(?![\w-])"
        for match in re.finditer(pattern, text, _I):
            before, after = text[: match.start()], text[match.end() :]
            if any(
                one.start - match.end() >= 0 and _IS_NAMED.fullmatch(text[match.end() : one.start]) for one in named
            ):
                continue
            if any(match.start() - one.end >= 0 and _IS_A.fullmatch(text[one.end : match.start()]) for one in named):
                continue
            same = [one for one in ids if agents[one].type == type_.name]
            if match["s"] or re.search(r"\b(?:all|every|each|todos los)\s+(?:the\s+)?$", before, _I):
                people = _several(before, type_.name, of_type)
            elif same and re.search(r"\b(?:the|this|that|el|la|al|del)\s+$", before, _I):
                people = (Person(type_.name, same[0]),) if len(same) == 1 else ()
            else:
                people = (Person(type_.name),)
            if people and not after.startswith("_"):
                found.append(_Mention(people, *match.span()))
    yield from sorted(found, key=lambda one: one.start)


_IS_NAMED: Final = re.compile(r"\s*(?:there|here|allí|ahí)?[\s,(:]*(?:called |named )?", _I)
"""What stands between `the picker` and its id."""
_IS_A: Final = re.compile(r"\s*[,(]\s*(?:an?|the|un|una|el|la)\s+", _I)


def _several(before: str, type_: str, ids: list[str]) -> tuple[Person, ...]:
    """Return whom `both pickers` means; a plain `pickers` is any of them."""
    two = re.search(r"\b(?:both|the two|two|ambos|los dos|dos)\s+(?:the\s+)?$", before, _I) is not None
    every = re.search(r"\b(?:all|every|each|todos los)\s+(?:the\s+)?$", before, _I) is not None
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


def _is_asked(text: str, start: int, end: int) -> bool:
    """Return whether those who are named there are asked for certain, not only if something else happens."""
    clause = text[_clause(text, start) : start]
    if (
        _SAYS_NO.match(text, end) is not None
        or _OR.match(text[end:].lstrip(" ,)"))
        or _OTHER_CASE.search(clause) is not None
    ):
        return False
    before = _ASKED_BEFORE.search(clause)
    if before is not None:
        is_told = before["ask"] or before["put"]
        lead = clause[: before.start()]
        return not is_told or _IF.search(lead) is None or _THERE.search(lead) is not None
    return _AGREES_AFTER.match(text, end) is not None


def _clause(text: str, at: int) -> int:
    """Return where the clause begins in which something stands."""
    return max((match.end() for match in _BOUNDARY.finditer(text, 0, at)), default=0)


def _moment(text: str, start: int, end: int, words: Words, world: World) -> tuple[tuple[str, ...], Next]:
    """Return where the machine has been when people are asked, and what a yes leads to; ((), "") = that is not certain."""
    lead = text[:start]
    leaving = _BEFORE_LEAVING.match(text, end)
    rest = text[: leaving.start("b")] + text[leaving.end("b") :] if leaving is not None else text
    if _TURNED.search(rest) is not None:
        return (), ""
    condition = _CONDITION.search(lead[_clause(text, start) :])
    until: int
    then: Next
    if leaving is not None and condition is None:
        until, then = _clause(text, start), "leave"
        ask = _ASKED_BEFORE.search(lead)
        if until == 0 and ask is not None and ask["ask"]:
            until = ask.start()
    elif condition is not None:
        until, then = _by_condition(text, _clause(text, start) + condition.start(), end, condition)
    else:
        until, then = _by_asking(text, start, end)
    if not then:
        return (), ""
    places = _reached(text[:until], words, world, to_land=then == "land")
    return (places, then) if places else ((), "")


def _by_condition(text: str, at: int, end: int, condition: re.Match[str]) -> tuple[int, Next]:
    """Return up to where a request says what comes before `if ... agrees`, and what follows a yes.

    Args:
        text: the request.
        at: where `if` begins.
        end: where the people end.
        condition: the match of it.
    """
    lead = text[:at].rstrip()
    word = condition["word"].casefold()
    if word in ("until", "hasta que"):
        return (at, "go on") if _WAITS.search(lead) is not None else (0, "")
    ends = re.search(r"(?P<mark>[.;:,])\s*(?:(?:and|but|then|y|pero|luego)\s*)?$", lead, _I)
    comma = re.search(r"[,.;:]", text[end:])
    if ends is not None and comma is not None:  # hovers there; if she agrees, it lands
        behind = text[end + comma.end() :]
        match = re.match(rf"{_CONSEQUENT}(?:(?P<land>{_LAND})|{_LEAVE})", behind, _I)
        if match is None or (ends["mark"] == "," and not match["who"]):
            return 0, ""
        return at, "land" if match["land"] else "leave"
    parts = list(_PART.finditer(lead))
    part = parts[-1].end() if parts else 0
    match = re.match(rf"{_CONSEQUENT}(?:(?P<land>{_LAND})|{_LEAVE})", lead[part:], _I)
    if match is None:
        return 0, ""
    # lands there and takes off again only when she agrees: with `only` it is what stands beside it
    return (part if condition["only"] else _clause(text, part)), "land" if match["land"] else "leave"


def _by_asking(text: str, start: int, end: int) -> tuple[int, Next]:
    """Return up to where a request says what comes before `asks her whether`, and what follows a yes."""
    ask = _ASKED_BEFORE.search(text[:start])
    if ask is None or not ask["ask"]:
        return 0, ""
    lead = text[: ask.start()]
    sequence = re.search(
        r"\b(?:then|there|after that|afterwards|luego|después|allí|entonces)[\s,]+(?:it\s+)?$"
        r"|[.;:,]\s*(?:it\s+)?$|\b(?:and|y)\s+$",
        lead,
        _I,
    )
    clause = re.match(r"[^.;:]*", text[end:])
    asked = clause[0] if clause is not None else ""
    after = re.search(rf"(?:[,.;:]|\b(?:then|yes|and)\b){_CONSEQUENT}(?:(?P<land>{_LAND})|{_LEAVE})", text[end:], _I)
    if sequence is None or after is None or re.search(r"\b(?:may|allowed|can|puede|clear|safe)\b", asked, _I):
        return 0, ""
    return ask.start(), "land" if after["land"] else "leave"


def _reached(text: str, words: Words, world: World, *, to_land: bool) -> tuple[str, ...]:
    """Return the places that a machine goes to in this part of a request, in its order; () = not certain.

    Args:
        text: the part.
        words: the whole request, as read.
        world: the site.
        to_land: a landing is what is asked for, so that there was none.
    """
    if _PLANNED.search(text) is not None or _ASIDE.search(text) is not None:
        return ()
    if re.search(r"\b(?:home|base|ports?|casa|puerto|return\w*|vuelve|regres\w+)\b", text, _I) is not None:
        return ()  # all of the flight is told
    if to_land and re.search(rf"\b{_LAND}", text, _I) is not None:
        return ()
    found: list[tuple[int, str]] = []
    for name, said in words.places.items():
        at = text.casefold().find(said.casefold())
        if at >= 0 and isinstance(world.site.places.get(name), Place) and _GOES_TO.search(text[:at]) is not None:
            found.append((at, name))
    return tuple(name for _, name in sorted(found))


def must_agree(asked: Iterable[Question]) -> tuple[Person, ...]:
    """Return all who must agree by themselves."""
    return tuple(dict.fromkeys(one for question in asked if question.all for one in question.people))
