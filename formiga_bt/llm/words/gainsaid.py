"""Reasons why something cannot be, held against the site, the catalogue and the request: `45 m is too high`.

A reason falls only if these show that it is wrong, or if it is none. What endangers people is gainsaid only where nothing is
wanted but plain flights, which the limits, the dry run and the layers of safety hold.
"""

import re
from typing import Final

from formiga_bt.llm.vocabulary import verbs_of
from formiga_bt.llm.words.feasible import height_limit_m
from formiga_bt.llm.words.known_words import unknown_words
from formiga_bt.llm.words.strangers import speaks_of_stranger
from formiga_bt.llm.words.wording import DRONES, LIGHT_HEAVY, Words, read, types_said
from formiga_bt.llm.world import RequestWorld

_DENIES: Final = re.compile(
    r"\b(?:no|not|never|none|nobody|nothing|only|cannot|outside|beyond|too|higher|above|lower|longer|farther|further|more|less|"
    r"exceed\w*|limit\w*|forbid\w*|danger\w*|endanger\w*|hurt\w*|harm\w*|destroy\w*|fall\w*|crash\w*|colli\w+|weapon\w*|safe\w*|"
    r"unsafe|must|may|lack\w*|miss\w*|without|people|rules?|un\w+|im\w+|in\w{4,}|illegal|wrong|fails?|"
    r"sin|nunca|nadie|nada|ning\w+|fuera|peligr\w+|demasiado|solo|falta\w*|debe\w*|puede\w*)\b|n't\b",
    re.IGNORECASE,
)
"""A reason without any of these says of nothing that it is not there, not possible or not allowed."""
_BARE: Final = re.compile(
    r"(?:(?:that|this|it|the request|the task|your request)\s+(?:is|seems|are)\s+(?:not possible|impossible|not feasible)"
    r"|(?:that|this|it|the request|the task)\s+(?:cannot|can't|can not)\s+be\s+(?:done|met|flown|carried out)"
    r"|not possible|impossible|cannot be done)(?:\s+(?:here|at this site))?\W*",
    re.IGNORECASE,
)
_FLIES: Final = (
    r"(?:fly|go|look|see|watch|observe|hover|wait|stay|land|take off|climb|rise|circle|orbit|visit|check|inspect|patrol|return|"
    r"come|travel|move|zigzag|weave|pass|approach|reach|start|gather|park|rest|ask|tell|report)"
)
_EXPLORES: Final = r"(?:explore|search|scan|survey|map|comb|cover)"
_CANNOT: Final = r"\bno (?:verb|machine|drone)s? here can ({})\b([^.;]*)"
_LITTLE: Final = """
    a an the at to over above round around about from of in on near by there here it them this that place places region area
    regions areas
    site and home back for with m s min light heavy drone drones machine away up down through between then land or any all
"""
_MISSING: Final = re.compile(
    r"\bno verb here can\b|\bno such\b|\b(?:there (?:is|are)|(?:the )?site has|(?:do|does) not have|has)\s+(?:no|any|not)\b",
    re.IGNORECASE,
)
_DANGER: Final = re.compile(r"\b(?:endanger\w*|danger\w*|unsafe|not safe|hurt\w*|harm\w*)\b", re.IGNORECASE)
_RISKY: Final = re.compile(
    r"\b(?:each other|one another|into|through|on top|under|underneath|below|beneath|low\w*|close\w*|near\w*|"
    r"without|not?|fast\w*|same (?:place|spot|point|time|height)|together|entre sí|contra|bajo|debajo|sin|mism[oa]|"
    r"juntos|rápid\w*|cerca)\b",
    re.IGNORECASE,
)
"""Words of flights that may be a danger."""
_DANGERS: Final = re.compile(
    r"\b(?:people|persons?|some(?:body|one)|any(?:body|one)|every(?:body|one)|m[ae]n|wom[ae]n|child\w*|kids?|crowds?|visitors?|"
    r"spectators?|tourists?|animals?|cows?|cattle|sheep|horses?|dogs?|birds?|heads?|faces?|roads?|cars?|motors?|propellers?|rotors?|"
    r"fall\w*|drop\w*|throw\w*|hit\w*|crash\w*|colli\w+|ram\w*|chas\w+|scar\w+|frighten\w*|hunt\w*|attack\w*|burn\w*|fires?|"
    r"weapons?|bombs?|explod\w+|explos\w+|destroy\w*|cut\w*|kill\w*|hurt\w*|harm\w*|danger\w*|ignor\w+|disabl\w+|"
    r"(?:switch|turn)\w* off|gente|personas?|alguien|niñ\w+|hombres?|mujer\w*|animal\w*|vacas?|ovejas?|caball\w+|perros?|"
    r"motor\w*|hélices?|ca(?:er|iga|e)|tir[ae]\w*|choc\w+|choqu\w+|persig\w+|asust\w+|atac\w+|ataq\w+|quem\w+|fuego|armas?|"
    r"destru\w+|cort\w+|mat\w+|her[ií]\w+|peligr\w+|desactiv\w+|apag\w+)\b",
    re.IGNORECASE,
)
"""Words of what may be in danger, or endanger."""
_ONLY: Final = re.compile(r"\bonly\s+(?:\d+|one|two|three|four|five|six|seven|eight)\s+(?:of\b|\w+)", re.IGNORECASE)
_PLURAL: Final = re.compile(
    r"\b(?:drones|lwds|hwds|uavs|machines|all|every|each|many|swarm|dozen\w*|todos|todas)\b", re.IGNORECASE
)


def gainsaid(reason: str, words: Words, world: RequestWorld) -> str:
    """Return what is wrong with a reason why something is impossible; "" = nothing is for certain.

    Args:
        reason: as a model gave it.
        words: the request, read.
        world: the site and its fleet.
    """
    if _BARE.fullmatch(reason.strip()):
        return "the answer says that it cannot be done, and gives no reason"
    if not _DENIES.search(reason):
        return f'the answer says that it cannot be done because "{reason.strip(" .")}", and that stands against nothing'
    return (
        _height(reason, words, world)
        or _distance(reason, words, world)
        or _verb(reason, world)
        or _count(reason, words)
        or _machine(reason, words, world)
        or _anything(reason, words, world)
    )


def is_groundless(reason: str, words: Words, world: RequestWorld) -> bool:
    """Return whether a reason speaks of danger, and the request of nothing that might be in danger or be one."""
    types, agents = world.catalogue.types, world.site.agents
    people = any(types[one].human for one in types_said(words, world.catalogue))
    people = people or any(types[agents[one].type].human for one in words.agents)
    said = _without(words)
    risky = people or _RISKY.search(said) is not None or _DANGERS.search(said) is not None
    return _DANGER.search(reason) is not None and not risky


def is_flown(words: Words, world: RequestWorld) -> bool:
    """Return whether nothing is said in a request but flights, in words that are all known, and nothing of people."""
    types, agents = world.catalogue.types, world.site.agents
    people = any(types[one].human for one in types_said(words, world.catalogue))
    people = people or any(types[agents[one].type].human for one in words.agents)
    return not people and not unknown_words(words, world)


def _height(reason: str, words: Words, world: RequestWorld) -> str:
    if not re.search(r"\bhigher than\b|\btoo high\b|\babove the limit\b", reason, re.IGNORECASE):
        return ""
    limit = height_limit_m(world)
    said = [one for one in read(reason, world.site, world.catalogue).amounts if one.type == "distance"]
    if not said or limit is None:
        return ""
    high = [one for one in said if one.si > limit]
    if not high:
        return f"the answer says that {said[0].words} is too high, and {limit:g} m are allowed"
    if not any(words.amount("distance", one.si) for one in high):
        return f"the answer says that {high[0].words} is too high, and the request says nothing of it"
    return ""


def _distance(reason: str, words: Words, world: RequestWorld) -> str:
    if not re.search(r"\boutside the fence\b|\bbeyond the fence\b|\btoo far\b", reason, re.IGNORECASE) or words.points:
        return ""
    said = [one for one in read(reason, world.site, world.catalogue).amounts if one.type == "distance"]
    if said and not words.amount("distance", said[0].si):
        return f"the answer says that {said[0].words} is too far, and the request says nothing of it"
    return ""


def _verb(reason: str, world: RequestWorld) -> str:
    """Find what a verb of the catalogue does: nothing else may be said of it than where."""
    verbs = verbs_of(world)
    doings = _FLIES if {"FlyTo", "GoTo"} & verbs.keys() else "(?!)"
    for doing in (doings, _EXPLORES if "Explore" in verbs else "(?!)"):
        found = re.search(_CANNOT.format(doing), reason, re.IGNORECASE)
        if found is None:
            continue
        rest = found[2]
        site = world.site
        for name in sorted([*site.places, *site.regions, *site.ports, *site.agents], key=len, reverse=True):
            rest = re.sub(rf"(?<!\w){re.escape(name).replace('_', '[_ ]')}(?!\w)", " ", rest, flags=re.IGNORECASE)
        if all(word in _LITTLE.split() for word in re.findall(r"[^\W\d_]+", rest.casefold())):
            return f"the answer says that nothing here can {found[1]}, and drones can"
    return ""


def _count(reason: str, words: Words) -> str:
    """Find `only so many` where the request asks for no more: too many were refused before a model was asked."""
    if not _ONLY.search(reason) or not (words.counts or not _PLURAL.search(words.text)):
        return ""
    return "the answer says that there are too few machines, and there are enough"


def _machine(reason: str, words: Words, world: RequestWorld) -> str:
    """Find a type that is there, said not to be; and `no such machine` where the request has no other than the site's."""
    types, agents = world.catalogue.types, world.site.agents.values()
    there = {one.type for one in agents} | {up for one in agents for up in types[one.type].extends}
    for name in sorted(there):
        nouns = [name, types[name].label, *LIGHT_HEAVY.get(name, ()), *(DRONES if name == "drone" else ())]
        listed = "|".join(re.escape(one) + "s?" for one in sorted({*filter(None, nouns)}, key=len, reverse=True))
        none = rf"\b(?:there (?:is|are)|has|have)\s+(?:no|not any)\s+(?:{listed})"
        if re.search(rf"{none}(?:\s+(?:at|on|in) (?:this|the) site|\s+here)?\s*(?:[.;]|$)", reason, re.IGNORECASE):
            return f"the answer says that there is no {types[name].label or name} here, and there is"
    if re.search(r"\bno such (?:machine|drone|agent|vehicle|aircraft)\b", reason, re.IGNORECASE):
        named = words.agents or types_said(words, world.catalogue) & there
        drone = re.search(rf"\b(?:{'|'.join(DRONES)})\b", words.text, re.IGNORECASE)
        strange = speaks_of_stranger(words) or re.search(r"\b(?!point_)[^\W\d_]+_\d+\b", _without(words), re.IGNORECASE)
        if (named or drone) and not strange:
            return "the answer says that the site has no such machine, and it has those of the request"
    return ""


def _without(words: Words) -> str:
    """Return a request without the ids and places of the site in it."""
    text = words.text
    for name in (*words.agents.values(), *words.places.values()):
        text = text.replace(name, " ")
    return text


def _anything(reason: str, words: Words, world: RequestWorld) -> str:
    """Find what is said to be missing, where the request has no word but those of flights: nothing can be."""
    if _MISSING.search(reason) and is_flown(words, world):
        return f'the answer says "{reason.strip(" .")}", and the request wants nothing but flights'
    if _DANGER.search(reason) and not _RISKY.search(_without(words)) and is_flown(words, world):
        return f'the answer says "{reason.strip(" .")}", and the request wants nothing but plain flights'
    return ""
