"""Compares whom a request wants to be asked with whom a task asks in its dry run."""

import re
from collections.abc import Iterator

from formiga_bt.llm.records import Flight, Shortfall
from formiga_bt.llm.wording import Words, types_said
from formiga_bt.llm.world import World


def asked(words: Words, flight: Flight, world: World) -> Iterator[Shortfall]:
    """Find questions that were wanted and not put, and those that nobody wanted.

    Args:
        words: the request, as read.
        flight: the dry run; it succeeded.
        world: the site.
    """
    if words.means("ask") and not flight.asked:
        yield Shortfall(
            "nobody_asked", "the request wants somebody to be asked or to confirm, and the task asks nobody"
        )
    for type_ in world.catalogue.types.values():
        types_asked = {world.site.agents[one].type for one in flight.asked if one in world.site.agents}
        pattern = rf"\bask(?:s|ed)?\s+(?:the\s+|a\s+)?{re.escape(type_.label or type_.name)}\b"
        if type_.human and types_asked and type_.name not in types_asked and re.search(pattern, words.text.casefold()):
            yield Shortfall(
                "wrong_person",
                f"the request wants a {type_.name} to be asked, and the task asks {', '.join(sorted(types_asked))}",
            )
    people = {t.name for t in world.catalogue.types.values() if t.human}
    named = types_said(words, world.catalogue) & people
    by_id = {a for a in words.agents if world.catalogue.types[world.site.agents[a].type].human}
    asks = any(row.action == "Confirm" and row.path for row in (flight.timeline.actions if flight.timeline else ()))
    if asks and not words.means("ask") and not named and not by_id and not _speaks_of_people(words.text):
        yield Shortfall("asked_unasked", "the task puts a question to people, and the request does not want that")


def _speaks_of_people(text: str) -> bool:
    return (
        re.search(
            r"\b(?:person|people|somebody|someone|operator|human|okay|ok|until|unless|if|when|"
            r"persona|gente|alguien|operador\w*|si|cuando|hasta que|a menos que)\b",
            text.casefold(),
        )
        is not None
    )
