"""Landings that a request wants at a place, or needs, for something is brought there: somebody lands there, or beside it."""

import math
import re
from collections.abc import Iterator
from typing import Final

from formiga_bt.base.asking import CONFIRM
from formiga_bt.llm.judging.plain import is_refused
from formiga_bt.llm.records import RehearsedFlight, Shortfall
from formiga_bt.llm.words.landings import DELIVERS_TO, NO_LANDING
from formiga_bt.llm.words.mentions import unquoted
from formiga_bt.llm.words.wording import Words

BESIDE_M: Final = 60.0
"""So near to a place a machine lands beside it."""
_LAND_AT: Final = (
    r"\b(?:land(?:s|ing)?|touch(?:es)? down|(?<!be )(?<!is )(?<!are )(?:set|put)s? down|settles?(?: down)?|alights?)\s+"
    r"(?:together\s+)?(?:at|in|on|by|near|beside)\s+(?:the\s+)?"
)
_TO, _AND_LAND = r"\b(?:to|towards?)\s+(?:the\s+)?", r",?\s+(?:and|to)\s+(?:then\s+)?lands?\b"
_MACHINES: Final = (
    r"(?:\s+(?:the|an?|both|all|of|its|two|three|four|\d+|light|heavy)){0,4}\s+"
    r"(?:them|it|both|all|itself|themselves|drones?|lwds?|hwds?|uavs?|machines?)"
)
_LANDS: Final = (
    r"(?:\b(?:lands?|landings?|alights?|touch(?:es|ing)? down|touch-?downs?|com(?:es?|ing) down(?! to\b)"
    rf"|(?:set|sit|put)(?:s|t?ing)?(?:{_MACHINES})?(?: \w+ly)? down(?!\s+(?:an?|the|its|their|some|\d+|on paper)\b)"
    rf"|settles?(?: down)?(?=\s+(?:at|in|on|by|near|beside)\b)|park(?:s|ing)?{_MACHINES}|aterri[zc]\w+"
    r"|se pos(?:an?|en?)|posarse|tom(?:an?|en?|ar) tierra)\b)"
)
_UNSURE: Final = re.compile(
    r"\b(?:not|never|no|nobody|none|without|avoid\w*|except|unless|instead|rather|if|should|declin\w*|refus\w*|in case|whether|"
    r"may|might|permission|allowed|ready|clear\w*|otherwise|else|before|battery|wind|emergency|again|take-?offs?|takes? off|"
    r"starts? from|"
    r"sin|nunca|tampoco|ni|salvo|si|caso|permiso|rechaz\w*|niega|antes|bater[ií]a|viento|de nuevo|otra vez|despega\w*|"
    r"(?:north|south|east|west)\w*|away|further|farther|up from)\b|n't\b"
)
"""What leaves open whether it lands there: another case, a permission, somewhere off the place."""
_HOME: Final = re.compile(
    r"\b(?:home|port|ports|base|return\w*|back|station|casa|puertos?|vuelv\w*|volver|regres\w*|retorn\w*|palaa\w*|kotiin)\b"
)
_ELSEWHERE: Final = (
    r"(?!\b(?:look\w*|hover\w*|wait\w*|stay\w*|stand\w*|that|which|who|whose|nearest|closest|while|when|once|until|till|after|"
    r"having|from|for|and|then|or|over|other|another|que|cuando|mientras|tras|desde|después|sobre|y|luego|o)\b)"
)
_GO: Final = (
    r"\b(?:fl(?:y|ies|ying|ight)|go(?:es|ing)?|head\w*|travel\w*|mov\w+|send\w*|bring\w*|takes?|taking|proceed\w*|dash\w*|"
    r"hop\w*|pop\w*|gets?|com(?:es?|ing)|runs?|trip|journey|vuel\w+|volar|van?|vay\w+|ir|viaj\w+|dirige\w*|acud\w+|"
    r"lleg\w+|llev\w+|env[ií]\w+|mand\w+)\b"
)
_ARRIVES: Final = (
    rf"(?:{_GO}(?:(?!\b(?:and|y|look\w*|next|close|message)\b)[^,])" + r"{0,40}?\b(?:to|into|towards?|hasta|hacia|al?)"
    r"|\bdrop(?:s|ping)? in (?:at|on)|\bstop(?:s|ping)? (?:by|at)|\barriv\w+ at|\breach(?:es|ing)?|\b(?:bound|make|makes) for"
    r"|\b(?:destination|destino|target)\s*(?:is|:|es)?)\s+(?:the\s+|el\s+|la\s+|los\s+|las\s+)?"
)
_OFF_AGAIN: Final = re.compile(
    r"\b(?:other|another|second|otr[oa]|segund[oa]|nearest)\b|\b(?:to|towards?|hasta|hacia)\s+(?!(?:land|touch|set|sit|park|each)\b)"
)
_BY_AIR: Final = re.compile(
    r"\b(?:drop\w*|lower\w*|winch\w*|releas\w*|rope|throw\w*|parachut\w*|hover\w*|solt\w+|suelt\w+|baj\w+|cuerda|lanz\w+|"
    r"paraca[ií]das|flot\w+)\b"
)
_FLIES: Final = frozenset({"TakeOff", "GoTo", "LandIn", "Explore", CONFIRM, "MiniFinder"})
"""Actions that let nothing down from the air."""
_AT_OTHER: Final = re.compile(r"[^,]{0,20}?\b(?:at|by|near|beside|where|next|behind|junto|cerca|donde)\b")


def landings(words: Words, flight: RehearsedFlight) -> Iterator[Shortfall]:
    """Find places at which a request wants a landing, and where in the dry run nobody landed."""
    done = {row.action for row in flight.timeline.actions} if flight.timeline is not None else set()
    by_sentence, brought = set(_wanted(words)), set(_brought(words)) if done <= _FLIES else set()
    for name, said in words.places.items():
        if name == "base" or is_refused(words.text, said):
            continue
        there = re.escape(said.casefold()) + r"(?!\w)"
        text = words.alone(name).casefold()
        wanted = re.search(_LAND_AT + there, text) or re.search(_TO + there + _AND_LAND, text) or name in by_sentence
        if wanted and not _lands_at(flight, name):
            text_ = f'the request wants a landing at "{said}", and nobody lands at {name}'
            yield Shortfall("not_landed_there", text_, about=name)
        elif name in brought and not _lands_at(flight, name):
            text_ = f'the request has something brought to "{said}", and nobody lands at {name}'
            yield Shortfall("not_landed_there", text_, about=name)


def _wanted(words: Words) -> Iterator[str]:
    """Yield the places at which a sentence, which names no other, wants a landing: `drop in at the camp and park them`."""
    for name, own in _of_one_place(words):
        if re.search(rf"{_LANDS}(?:{_ELSEWHERE}[^,:]){{0,50}}?\s(?:at|in|on|by|near|beside|around|en|junto al?)\s"
                     r"(?:the\s+|el\s+|la\s+)?·", own):  # fmt: skip
            yield name
            continue
        after = re.search(rf"{_ARRIVES}·([^:]{{0,100}}?){_LANDS}", own)
        if after is not None and not _OFF_AGAIN.search(after[1]) and not _AT_OTHER.match(own[after.end() :]):
            yield name


def _brought(words: Words) -> Iterator[str]:
    """Yield the places to which something is to be brought that no machine can let down from the air."""
    if _BY_AIR.search(words.text.casefold()) is None:
        yield from (name for name, own in _of_one_place(words) if re.search(DELIVERS_TO + "·", own))


def _of_one_place(words: Words) -> Iterator[tuple[str, str]]:
    """Yield the place and the text of each sentence that names one place once, as `·`, and leaves nothing open."""
    text = NO_LANDING.sub(" ", unquoted(words.text).casefold())
    for sentence in re.split(r"[.;!?\n](?!\d)", text):
        named = {
            name: said.casefold()
            for name, said in words.places.items()
            if re.search(rf"(?<!\w){re.escape(said.casefold())}(?!\w)", words.alone(name, sentence))
        }
        if len(named) != 1 or "base" in named:
            continue
        name, said = next(iter(named.items()))
        own = sentence.replace(said, "·").replace("side by side", "abreast")
        if own.count("·") != 1 or _UNSURE.search(own) or _HOME.search(own):
            continue
        yield name, own


def _lands_at(flight: RehearsedFlight, name: str) -> bool:
    """Return whether somebody landed at a place or beside it; a region has no one place."""
    landed = {where for places in flight.landed.values() for where in places}
    if name in landed:
        return True
    spots = {mark.name: mark for mark in flight.chart.marks} if flight.chart is not None else {}
    spot = spots.get(name)
    beside = [re.fullmatch(r"(-?\d+) E (-?\d+) N", where) for where in landed]
    if spot is None:
        return any(beside)
    if spot.kind == "port" and "home" in landed:
        return True
    return any(
        at is not None and math.dist((float(at[1]), float(at[2])), (spot.at.east_m, spot.at.north_m)) <= BESIDE_M
        for at in beside
    )
