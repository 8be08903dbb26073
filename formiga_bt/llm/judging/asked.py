"""Compares whom a request wants to be asked, and when, with whom a task asks in its dry run."""

import re
from collections.abc import Iterator, Sequence

from formiga_bt.base.asking import CONFIRM
from formiga_bt.llm.judging.outcome import over_first
from formiga_bt.llm.records import RehearsedFlight, Shortfall
from formiga_bt.llm.words.questions import AskedQuestion, Person, questions
from formiga_bt.llm.words.wording import Words, types_said
from formiga_bt.llm.world import RequestWorld
from formiga_bt.show.facts import ActionFact


def asked(words: Words, text: str, flight: RehearsedFlight, world: RequestWorld) -> Iterator[Shortfall]:
    """Find questions that were wanted and not put, and those that nobody wanted.

    Args:
        words: the request, as read.
        text: the YAML of the task.
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
    rows = [one for one in (flight.timeline.actions if flight.timeline else ()) if one.action == CONFIRM and one.path]
    if rows and not words.means("ask") and not named and not by_id and not _speaks_of_people(words.text):
        yield Shortfall("asked_unasked", "the task puts a question to people, and the request does not want that")
    for question in questions(words, world):
        yield from _whom(question, rows, world, is_all="policy: all" in text)
        yield from _when(question, rows, flight, world)


def only_asked(words: Words, text: str, flight: RehearsedFlight, world: RequestWorld) -> Iterator[Shortfall]:
    """Find what is wrong with a task where the request wants a question and nothing else.

    What it names, a place or an amount, belongs to the question. See `asked` for the arguments.
    """
    if flight.status == "SUCCEEDED":
        yield from asked(words, text, flight, world)
    for agent in flight.visited:
        yield Shortfall(
            "flies_unasked", f"the request only wants somebody to be asked, and {agent} takes part in the task"
        )


def _whom(
    question: AskedQuestion, rows: Sequence[ActionFact], world: RequestWorld, *, is_all: bool
) -> Iterator[Shortfall]:
    """Find people of one question who are not asked, or are asked together where the word of each counts."""
    of = {one: [row for row in rows if _is_of(row, one, world)] for one in question.people}
    names = " and ".join(sorted({row.agent for row in rows}))
    missing = [one for one, theirs in of.items() if not theirs]
    if rows and missing and (question.all or len(missing) == len(of)):
        for one in missing:
            name = one.id or f"a {one.type}"
            text = f"the request wants {name} to be asked, and the task asks {names} only"
            yield Shortfall(
                "person_not_asked", text, help='one {"ask": "...", "of": [ROLE]} for each', about=one.id or one.type
            )
    elif question.all and not is_all:
        puts = {(row.path, row.start) for theirs in of.values() for row in theirs}
        if rows and len(puts) < len(of):
            who = " and ".join(one.id or f"a {one.type}" for one in question.people)
            text = f"the request wants {who} to agree, and the task goes on with the first answer of any of them"
            yield Shortfall(
                "asked_together", text, help='one {"ask": "...", "of": [ROLE]} for each, one after the other'
            )


def _when(
    question: AskedQuestion, rows: Sequence[ActionFact], flight: RehearsedFlight, world: RequestWorld
) -> Iterator[Shortfall]:
    """Find a question that is put before the one machine is where the request has it by then."""
    last = max((row.start for row in rows for one in question.people if _is_of(row, one, world)), default=None)
    if last is None or len(flight.visited) != 1:
        return
    for place in question.after:
        reached = over_first(flight, next(iter(flight.visited)), place)
        if reached is not None and last < reached:
            text = f"the request has the machine at {place} before anybody is asked, and the task asks before that"
            yield Shortfall("asked_too_early", text, help=f"put the ask behind the flight to {place}", about=place)


def _is_of(row: ActionFact, person: Person, world: RequestWorld) -> bool:
    agent = world.site.agents.get(row.agent)
    return row.agent == person.id if person.id else agent is not None and agent.type == person.type


def _speaks_of_people(text: str) -> bool:
    return (
        re.search(
            r"\b(?:person|people|somebody|someone|operator|human|okay|ok|until|unless|if|when|"
            r"persona|gente|alguien|operador\w*|si|cuando|hasta que|a menos que)\b",
            text.casefold(),
        )
        is not None
    )
