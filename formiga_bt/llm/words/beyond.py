"""What cannot be, as the answers of a model showed: an unknown place, a way longer than any charge, a height too high.

`feasible` finds what is certain before a model is asked; this is known only from trees that say what the request says.
"""

import re
from collections.abc import Sequence
from typing import Final

from formiga_bt.llm.records import Round
from formiga_bt.llm.words.feasible import Impossible, height_limit_m
from formiga_bt.llm.words.spoken import said
from formiga_bt.llm.words.wording import read
from formiga_bt.llm.world import RequestWorld

_CAMEL: Final = re.compile(r"(?<=[a-z])(?=[A-Z])")
SAME_M: Final = 1.0
"""So near to it a height is the one that the request says."""
_MOST_NAMES: Final = 12


def beyond(rounds: Sequence[Round], request: str, world: RequestWorld) -> Impossible | None:
    """Return why none of the answers passed, if that lies in the request and not in the model.

    Args:
        rounds: all of them, none of which passed.
        request: in words.
        world: the site and its fleet.
    """
    return _unknown(rounds, request, world) or _too_far(rounds) or _too_high(rounds, request, world)


def _unknown(rounds: Sequence[Round], request: str, world: RequestWorld) -> Impossible | None:
    """Find a name of the request that every answer took for one of the site's."""
    trees = [one for one in rounds if one.yaml or one.shortfalls]
    names = [{found.unknown for found in one.shortfalls if found.code == "E010"} - {""} for one in trees]
    common = sorted(set.intersection(*names)) if names else []
    here_too = {*world.catalogue.types, *world.site.people, *world.site.agents}
    for name in common:
        if name.rstrip("s") in here_too or name in here_too:
            continue  # somebody, where the model should have named a place or a role
        words = said(_CAMEL.sub("_", name), request)
        if words:
            here = ["base", *world.site.places, *world.site.regions][:_MOST_NAMES]
            return Impossible(f'the site {world.site.name} has no "{words}"', f"one of {', '.join(here)}")
    return None


def _too_far(rounds: Sequence[Round]) -> Impossible | None:
    """Find an answer that is right but for the charge of all machines, which were full."""
    for one in rounds:
        errors = [found for found in one.shortfalls if found.severity == "error"]
        flight = one.flight
        if flight is None or len(errors) != 1 or flight.code != "no_agent":
            continue
        for agent, numbers in flight.short.items():
            return Impossible(f"that is too far for any machine here: {agent} has {numbers}", "a nearer place")
    return None


def _too_high(rounds: Sequence[Round], request: str, world: RequestWorld) -> Impossible | None:
    """Find an answer that flies as high as the request says, which is higher than anything may."""
    limit = height_limit_m(world)
    for one in rounds:
        flight = one.flight
        height = flight.breach if flight is not None and flight.code == "envelope.max_height" else None
        if limit is None or height is None:
            continue
        asked = [a for a in read(request, world.site, world.catalogue).amounts if a.type == "distance"]
        said = next((a.words for a in asked if a.si > limit and abs(a.si - height) < SAME_M), "")
        if said:
            why = f"{said} is higher than any drone may fly here ({limit:g} m over the ground)"
            return Impossible(why, f"the same at {limit:g} m")
    return None
