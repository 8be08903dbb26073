"""What cannot be, for certain, so that no model is asked: too many machines, unknown agents, heights beyond the limit."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from formiga_bt.llm.vocabulary import AgentVerb
from formiga_bt.llm.words.mentions import unquoted
from formiga_bt.llm.words.strangers import stranger
from formiga_bt.llm.words.wording import Words
from formiga_bt.llm.world import RequestWorld

_HIGH: Final = re.compile(
    r"\s*(?:high|up|above|altitude|of altitude|over|de alt(?:o|ura)|korkeudella|korkealla)\b", re.IGNORECASE
)
_HEIGHT_OF: Final = re.compile(
    r"\b(?:height|altitude|high|up to|climbs? to|korkeus|altura|sub[ea]n? (?:a|hasta))\s+(?:of\s+|to\s+|is\s+|de\s+)?$",
    re.IGNORECASE,
)


DOINGS: Final = (
    "spray", "paint", "clean", "wash", "shoot", "attack", "drop", "throw", "grab", "weld", "dig", "harvest", "pick berries",
    "mow", "burn", "sow", "fertilize", "fertilise", "repair", "chase", "photograph", "film", "measure", "push", "pull", "sing",
    "ruiskuta", "maalaa", "pese", "pudota", "kuvaa",
)  # fmt: skip
"""What drones are asked to do and only some can; it is said only if no verb of the catalogue speaks of it."""
_ORDERED: Final = (
    r"(?:^|[.!?;:,]\s*|\b(?:and|then|to|will|should|must|shall|can|please|drones?|it|ja|sitten)\s+)"
    r"(?:please\s+)?({})(?:s|es)?\b"
)
"""A doing where it is an order, not where it tells of a place: `fly to where they spray`."""


_MOVING: Final = re.compile(
    r"(?:drops?\s+(?:by|in (?:at|on)|over to|(?:down )?to \d)|pulls?\s+(?:back|up|away|over|out)\b(?!\s+(?:the|an?|its?)\b)"
    r"|push(?:es)?\s+(?:on|off|ahead|forward)\b(?!\s+(?:the|an?|its?)\b)|shoots?\s+(?:up(?!\s+(?:the|an?)\b)|over|across|past)\b)",
    re.IGNORECASE,
)
"""Such a word where it only says how a machine moves: `drop by the camp`, `pull back to the base`."""
_UNSAFE: Final = re.compile(
    r"\b(?:disable|deactivate|override|bypass|ignore|switch off|turn off|desactiva|anula|ignora|apaga)\b"
    r"(?:\s+(?:all|your|its|their|any|the|of|todas?|todos?|sus?|tus?|las?|los|el|de)){0,3}\s+"
    r"(?:battery |charge |safety |flight |height |reserva de |lím\w+ de |reglas de )?"
    r"(?:rules?|reserves?|geofences?|fences?|limits?|safety|separation|checks?|envelopes?|gates?|reglas?|reservas?|límites?|seguridad|"
    r"batería|vallas?|separación)\b",
    re.IGNORECASE,
)
"""An order to go without what no tree can switch off."""
_NEVER: Final = re.compile(
    r"(?:\b(?:not|never|cannot|nobody|no\s+one|without|nor|no|nunca|jamás|sin)|n't)"
    r"(?:\s+(?:ever|simply|just|please|(?:try|attempt)\s+to|under\s+any\s+circumstances?|may|must|shall|should|to))*\s+$",
    re.IGNORECASE,
)
"""What stands before such an order that forbids it: `never switch off ..`."""


@dataclass(frozen=True, slots=True)
class Impossible:
    """Why a request cannot be met, and what could be instead."""

    why: str
    instead: str


def impossible(words: Words, world: RequestWorld, verbs: Mapping[str, AgentVerb]) -> Impossible | None:
    """Return what stands against a request for certain, or None."""
    return (
        _unsafe(words)
        or _too_many(words, world)
        or _nobody(words, world)
        or _stranger(words, world)
        or _too_high(words, world)
        or _cannot(words, verbs)
    )


def _unsafe(words: Words) -> Impossible | None:
    text = unquoted(words.text)
    match = next((one for one in _UNSAFE.finditer(text) if _NEVER.search(text[: one.start()]) is None), None)
    if match is None:
        return None
    return Impossible(
        f'the request says "{match[0].strip()}", and that is what no task can switch off', "the same within the rules"
    )


def _cannot(words: Words, verbs: Mapping[str, AgentVerb]) -> Impossible | None:
    known = " ".join(f"{verb.name} {verb.help} {' '.join(verb.fields)}" for verb in verbs.values()).casefold()
    for match in re.finditer(_ORDERED.format("|".join(DOINGS)), words.text, re.IGNORECASE):
        if match[1].casefold() not in known and not _MOVING.match(f"{match[1]}{words.text[match.end(1) :]}"):
            can = ", ".join(verb.name for verb in verbs.values())
            return Impossible(f'the request says "{match[1]}", and nothing here can do that; verbs: {can}', "")
    return None


def _too_many(words: Words, world: RequestWorld) -> Impossible | None:
    types = world.catalogue.types
    for name, wanted in words.counts.items():
        here = [
            a for a in world.site.agents.values()
            if not types[a.type].human and (name in ("*", a.type) or name in types[a.type].extends)
        ]  # fmt: skip
        if wanted > len(here):
            noun = "drones" if name == "*" else (types[name].label or name) + "s"
            have = f"only {len(here)} {noun if len(here) != 1 else noun[:-1]}" if here else f"no {noun}"
            instead = f"the same with {len(here)}" if here else ""
            return Impossible(f"the request speaks of {wanted} {noun}; the site {world.site.name} has {have}", instead)
    return None


def _nobody(words: Words, world: RequestWorld) -> Impossible | None:
    """Find agents that are named as those of the site are, and are not there."""
    site = world.site
    for type_ in world.catalogue.types:
        for match in re.finditer(rf"(?<!\w){re.escape(type_)}_(\d+)(?!\w)", words.text, re.IGNORECASE):
            if match[0].casefold() not in {name.casefold() for name in site.agents}:
                have = [a.id for a in site.agents.values() if a.type == type_]
                instead = f"with one of {', '.join(have)}" if have else ""
                return Impossible(f"the site {site.name} has no {match[0]}", instead)
    return None


def _stranger(words: Words, world: RequestWorld) -> Impossible | None:
    who = stranger(words, world)
    if not who:
        return None
    site, types = world.site, world.catalogue.types
    here = [one.id for one in site.agents.values() if not types[one.type].human]
    return Impossible(f'the site {site.name} has no "{who}"', f"with one of {', '.join(here)}" if here else "")


def height_limit_m(world: RequestWorld) -> float | None:
    """Return how high over the ground a machine may fly here, at most; None = nothing is said."""
    limits = [t.limits["max_height_m"] for t in world.catalogue.types.values() if "max_height_m" in t.limits]
    limits += [world.site.envelope["max_height_m"]] if "max_height_m" in world.site.envelope else []
    return min(limits, default=None)


def _too_high(words: Words, world: RequestWorld) -> Impossible | None:
    limit = height_limit_m(world)
    if limit is None:
        return None
    for amount in words.amounts:
        at = amount.at
        before, after = words.text[:at], words.text[at + len(amount.words) :]
        is_height = _HIGH.match(after) is not None or _HEIGHT_OF.search(before) is not None
        if amount.type == "distance" and is_height and amount.si > limit and not _is_aside(after):
            why = f"{amount.words} is higher than any drone may fly here ({limit:g} m over the ground)"
            return Impossible(why, f"the same at {limit:g} m")
    return None


def _is_aside(after: str) -> bool:
    """Return whether `over` or `above` goes on to something that is no height: `200 m over to the lake`."""
    return re.match(r"\s*over\s+(?:to|there)\b", after, re.IGNORECASE) is not None
