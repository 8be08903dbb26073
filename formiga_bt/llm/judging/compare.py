"""Compares a request with the task that was written for it and with what it did in a dry run.

It is cautious: it says only what is certain, from names of the site, counts, amounts and a few plain words. What it does not
say may still be wrong; the person who approves a task reads it.
"""

from typing import Final

from formiga_bt.lang.model import Task
from formiga_bt.llm.judging.amounts import amounts, misused, often, unread
from formiga_bt.llm.judging.asked import asked, only_asked
from formiga_bt.llm.judging.directions import directions
from formiga_bt.llm.judging.figures import figures, rings
from formiga_bt.llm.judging.homecoming import all_home, homecoming
from formiga_bt.llm.judging.landings import landings
from formiga_bt.llm.judging.machines import agents
from formiga_bt.llm.judging.places import ends, order, places, unnamed
from formiga_bt.llm.judging.sizes import assumed_sizes
from formiga_bt.llm.records import RehearsedFlight, Shortfall
from formiga_bt.llm.words.only_question import only_question
from formiga_bt.llm.words.wording import Words
from formiga_bt.llm.world import RequestWorld

OF_CHANGES: Final = frozenset({"place_not_used", "amount_not_used", "agent_not_used"})
"""What is certain of a request that only says what is to be changed."""


def compare(words: Words, task: Task, text: str, flight: RehearsedFlight, world: RequestWorld) -> list[Shortfall]:
    """Return what was asked for and is not so.

    Args:
        words: the request, as read.
        task: the checked task.
        text: its YAML.
        flight: its dry run; empty status = it was not flown.
        world: the site.
    """
    if only_question(words, world) is not None:
        return list(only_asked(words, text, flight, world))
    found = [
        *places(words, text),
        *unnamed(words, text, world),
        *amounts(words, text),
        *unread(words, text),
        *misused(words, task),
        *figures(words, text),
        *directions(words, task, text),
        *assumed_sizes(words, task, text),
        *rings(text, task, world),
        *often(words, text),
        *agents(words, task, flight, world),
    ]
    if flight.status == "SUCCEEDED":
        found += [
            *asked(words, text, flight, world),
            *landings(words, flight),
            *ends(words, flight),
            *homecoming(words, flight),
            *all_home(words, flight),
        ]
        found += order(words, flight, world)
    return found
