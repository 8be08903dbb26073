"""Missions of one machine, and how differently people put them: as a sentence, backwards, as a list, by radio."""

import re
from collections.abc import Sequence
from typing import Final

from experiments.e2_llm.train.kinds.clauses import Clause, Draw
from experiments.e2_llm.train.kinds.missions import (
    TASKS,
    Machine,
    Mission,
    Person,
    ask_clause,
    chain,
    ended,
    joined,
    machine,
    names_of,
    parts,
    person,
    told,
    tree,
)
from experiments.e2_llm.train.phrases.parts import SINGLE
from experiments.e2_llm.train.phrases.wide.talk import (
    BACKWARDS,
    CALLS,
    ENDS_CALL,
    FRONT_JOINS,
    LISTS,
    MORE_SINGLE,
    PURPOSES,
    RADIO,
    SENTENCES,
)
from experiments.e2_llm.train.speaker import Speaker


def single(draw: Draw) -> Mission:
    """Return one machine's mission of one to four parts, now and then with a message, a pause or a question in it."""
    of = draw.rng.choice(("lwd", "lwd", "lwd", "hwd", "hwd", "drone"))
    who = machine(draw, "drone", of, by_id=of != "drone" and draw.rng.random() < 0.2)
    clauses = ended(draw, parts(draw, of, 3))
    agents: list[Machine | Person] = [who]
    dice = draw.rng.random()
    if dice < 0.14:
        clauses.insert(draw.rng.randint(1, len(clauses)), draw.clause("tell"))
    elif dice < 0.32:
        asked = person(draw)
        agents.append(asked)
        clauses.insert(draw.rng.randint(0, max(1, len(clauses) - 1)), ask_clause(draw, asked))
    main = next(one.kind for one in clauses if one.kind in TASKS)

    def say(speaker: Speaker) -> str:
        return widely(speaker, who, clauses) if speaker.wide else framed(speaker, who, clauses)

    kind = "ask" if len(agents) > 1 else "single" if len(clauses) <= 2 else "single_long"
    return Mission(
        kind, tree(TASKS[main], agents, chain(clauses, "drone")), told(clauses, "One drone"), say, names_of(clauses)
    )


def framed(speaker: Speaker, who: Machine, clauses: Sequence[Clause]) -> str:
    """Return a request for one machine, parts in a row."""
    frame, form = speaker.of(SINGLE[speaker.language], MORE_SINGLE[speaker.language])
    text = joined(clauses, speaker, form)
    return speaker.filled(frame, {"a": who.said(speaker), "c": text}, form)


TALK: Final = 0.12
"""How often each of the ways of talking beside `framed` is taken."""
LAST: Final = ("home", "home_own", "land", "aside_land", "tell")
"""Ends that are clear when they are said first: they do not lean on what was said before."""


def widely(speaker: Speaker, who: Machine, clauses: Sequence[Clause]) -> str:
    """Return a request for one machine as very different people put it."""
    dice = speaker.rng.random()
    if dice < TALK:
        return radioed(speaker, who, clauses)
    way = framed
    if len(clauses) > 1 and dice < 2 * TALK and clauses[-1].kind in LAST:
        way = backwards
    elif len(clauses) > 1 and 2 * TALK <= dice < 3 * TALK:
        way = one_by_one
    elif len(clauses) > 1 and 3 * TALK <= dice < 3.5 * TALK:
        way = listed
    text = way(speaker, who, clauses)
    dice = speaker.rng.random()
    if dice < TALK / 2:
        return f"{speaker.pick(PURPOSES)} {text[:1].upper()}{text[1:]}"
    return f"{text} {speaker.pick(PURPOSES)}" if dice < TALK else text


def backwards(speaker: Speaker, who: Machine, clauses: Sequence[Clause]) -> str:
    """Return a request that says the end first."""
    frame, end, form = speaker.of(BACKWARDS[speaker.language])
    front = joined(clauses[:-1], speaker, form, FRONT_JOINS)
    return speaker.filled(frame, {"a": who.said(speaker), "e": clauses[-1].said(speaker, end), "c": front})


def one_by_one(speaker: Speaker, who: Machine, clauses: Sequence[Clause]) -> str:
    """Return a request with a sentence for each part."""
    first, between, last, form = speaker.of(SENTENCES[speaker.language])
    frames = [first, *[between] * (len(clauses) - 2), last]
    values = {"a": who.said(speaker)}
    said = [
        speaker.filled(frame, values | {"c": one.said(speaker, form)})
        for frame, one in zip(frames, clauses, strict=True)
    ]
    return "".join(said)


def listed(speaker: Speaker, who: Machine, clauses: Sequence[Clause]) -> str:
    """Return a request whose parts have numbers."""
    mark, between = speaker.of((("{}.", ". "), ("{})", "; "), ("({})", " "), ("-", " ")))
    parts = [f"{mark.format(i + 1)} {one.said(speaker, bare(speaker))}" for i, one in enumerate(clauses)]
    return f"{speaker.filled(speaker.pick(LISTS), {'a': who.said(speaker)})} {between.join(parts)}."


def radioed(speaker: Speaker, who: Machine, clauses: Sequence[Clause]) -> str:
    """Return a request as people say it by radio."""
    short = speaker.rng.random() < 0.6
    parts = [speaker.filled(speaker.pick(CALLS), {"a": _called(speaker, who)})]
    for one in clauses:
        both = RADIO.get(one.kind)
        said = speaker.filled(speaker.pick(both), one.values) if both else one.said(speaker, bare(speaker))
        if short and one.kind not in ("ask", "tell"):
            said = re.sub(r"\b(?:the|el|la) (?=\w)", "", said)
        parts.append(f"{said[:1].upper()}{said[1:]}.")
    return " ".join(parts) + speaker.pick(ENDS_CALL)


def _called(speaker: Speaker, who: Machine) -> str:
    return re.sub(r"^(?:an?|any|some|one|un|cualquier) (?=\w)", "", who.said(speaker))


def bare(speaker: Speaker) -> int:
    """Return the form of a verb that stands alone."""
    return 2 if speaker.language == "es" else 0
