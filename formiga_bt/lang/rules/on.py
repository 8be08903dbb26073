"""`on` of a rule: an agent's event, the border of a region that it passes, or its silence."""

import re
from collections.abc import Mapping
from typing import Final

from msgspec import Struct

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model import AgentType, Happening, OnEvent, OnPassage, OnSilence, Site
from formiga_bt.lang.model.rules import Passage
from formiga_bt.lang.params import descendants
from formiga_bt.lang.shipped import types_help
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.text.reading import Problems, did_you_mean, fix_word, quoted_list, shorten
from formiga_bt.lang.text.synonyms import nearest, surely
from formiga_bt.lang.types import AGENT, POSITION, TIME, Type, record_of

_EVENT: Final = re.compile(r"(\w+)\.(\w+)")
_CALL: Final = re.compile(r"(\w+)\(\s*(\w+)\s*(?:,\s*([\w.]+)\s*)?\)")
_OPEN: Final = re.compile(r"(?:leaves|enters|crosses)\([^)]*")
_PASSAGES: Final[Mapping[str, Passage]] = {"leaves": "leaves", "enters": "enters", "crosses": "crosses"}
_WORDS: Final = (*_PASSAGES, "silent")
FORMS: Final = "picker.sos, leaves(picker, regions.NAME), enters(..), crosses(picker, fence), silent(picker)"
FENCE: Final = "fence"
OWN: Final = ("agent", "at", "position")
"""Names in `event` besides the fields of an agent's own event."""


class Heard(Struct, frozen=True):
    """What `on` says."""

    on: Happening
    types: tuple[str, ...]
    event: Type
    """Of `event` in the arguments."""
    watched: str


def read_on(at: Scalar, site: Site, types: Mapping[str, AgentType], problems: Problems) -> Heard | None:
    """Return what a rule is on, or None (reported)."""
    text = at.text.strip()
    event, call = _EVENT.fullmatch(text), _CALL.fullmatch(text)
    if event is not None:
        return _event(at, event[1], event[2], types, problems)
    if call is None or call[1] not in _WORDS:
        _unreadable(at, call[1] if call is not None else "", problems)
        return None
    word, of, where = call[1], call[2], call[3]
    kinds = _kinds(_part(at, of), types, problems)
    if word == "silent":
        if where is not None:
            problems.add("E130", at.mark, "silent takes an agent type alone", "such as: silent(picker)")
            return None
        return _heard(OnSilence(), kinds, {}, "silent") if kinds else None
    return _passage(at, _PASSAGES[word], where, kinds, site, types, problems)


def _unreadable(at: Scalar, word: str, problems: Problems) -> None:
    if _OPEN.fullmatch(at.text.strip()):
        what = f"'{shorten(at.text)}' ends at its comma: inside {{ }} a text with a comma needs quotes"
        problems.add("E130", at.mark, what, 'such as: on: "leaves(picker, regions.field)"')
        return
    guess = did_you_mean(word, _WORDS) if word else ""
    what = f"a rule cannot be on '{shorten(at.text)}'{guess}"
    problems.add("E130", at.mark, what, f"such as: {FORMS}")


def _part(at: Scalar, word: str) -> Scalar:
    """Return a word of a scalar as a scalar of its own."""
    start = re.search(rf"\b{re.escape(word)}\b", at.text)
    mark = at.mark_at(start.start(), start.end()) if start is not None else at.mark
    return Scalar(word, mark)


def _kinds(at: Scalar, types: Mapping[str, AgentType], problems: Problems) -> tuple[str, ...]:
    if at.text not in types:
        meant = surely(at.text, types)
        what = f"no agent type is called '{shorten(at.text)}'{did_you_mean(at.text, types)}"
        problems.add("E020", at.mark, what, types_help(at, types), fix_word(at, meant))
        return ()
    return descendants(at.text, types)


def _event(at: Scalar, of: str, word: str, types: Mapping[str, AgentType], problems: Problems) -> Heard | None:
    kinds = _kinds(_part(at, of), types, problems)
    if not kinds:
        return None
    fields = types[of].events.get(word)
    if fields is None:
        have = types[of].events
        meant = nearest(word, have)
        told = f"events: {quoted_list(have)}" if have else "it reports no events"
        guess = f"; did you mean '{meant}'?" if meant else ""
        mark = at.mark_at(at.text.rindex(word), at.text.rindex(word) + len(word))
        problems.add("E021", mark, f"{of} has no event '{word}'{guess}", told, fix_word(Scalar(word, mark), meant))
        return None
    taken = next((name for name in fields if name in OWN), "")
    if taken:
        what = f"the event '{word}' has a field '{taken}', which `event` of a rule has already"
        problems.add("E130", at.mark, what, "rename the field in the catalogue")
        return None
    return _heard(OnEvent(word), kinds, fields, f"event {word}")


def _passage(
    at: Scalar,
    what: Passage,
    where: str | None,
    kinds: tuple[str, ...],
    site: Site,
    types: Mapping[str, AgentType],
    problems: Problems,
) -> Heard | None:
    still = next((name for name in kinds if types[name].mobility in ("fixed", "none")), "")
    if still:
        text = f"{still} never moves: its mobility is {types[still].mobility}"
        problems.add("E130", at.mark, text, "people and machines that move pass borders")
        return None
    name = (where or "").removeprefix("site.")
    if name == FENCE and site.fence is not None:
        return _heard(OnPassage(what, FENCE, site.fence), kinds, {"position": POSITION}, _of(what, site.fence))
    name = name.removeprefix("regions.")
    if name in site.regions and name != where:
        outline = site.regions[name]
        return _heard(OnPassage(what, name, outline), kinds, {"position": POSITION}, _of(what, outline))
    mark: Mark = _part(at, where.rpartition(".")[2]).mark if where else at.mark
    if where is None:
        problems.add("E130", at.mark, f"'{what}' needs an agent type and a region", f"such as: {FORMS}")
    elif name == FENCE:
        problems.add("E010", mark, "the site has no fence", "add fence: to the site file")
    else:
        known = [f"regions.{one}" for one in site.regions] + ([FENCE] if site.fence is not None else [])
        meant = nearest(f"regions.{name}", known)
        guess = f"; did you mean '{meant}'?" if meant else ""
        told = f"it is written regions.NAME or fence; there are {quoted_list(known)}" if known else "add it to regions:"
        problems.add("E010", mark, f"no region is called '{shorten(where)}'{guess}", told)
    return None


def _of(what: str, outline: object) -> str:
    return f"{what} {outline}"


def _heard(on: Happening, kinds: tuple[str, ...], fields: Mapping[str, Type], watched: str) -> Heard | None:
    if not kinds:
        return None
    agent = Type(AGENT.name, of=kinds, foreign=True)
    return Heard(on, kinds, record_of(agent=agent, at=TIME, **fields), f"{watched} {','.join(kinds)}")
