"""Missions of two machines of which one flies at a time: the same again, by turns, the second after a yes."""

from typing import Any, Final

from experiments.e2_llm.train.kinds.clauses import Draw, Steps
from experiments.e2_llm.train.kinds.missions import Mission, chain, joined, names_of, parts, person, tree
from experiments.e2_llm.train.kinds.teams import crew_of
from experiments.e2_llm.train.phrases.turns import RELAY
from experiments.e2_llm.train.phrases.wide.relays import MORE_RELAY
from experiments.e2_llm.train.speaker import Speaker, Times, widened

_RELAYED: Final = widened(RELAY, MORE_RELAY)

_SAME = ("over", "over_plain", "watch", "watch_plain", "ring", "ring_plain", "stop", "tour", "pass", "rings", "line")


def does_same(draw: Draw) -> Mission:
    """Return two machines that have the same job, the second when the first is home."""
    (one, first), (two, second) = crew_of(draw, 2)
    clauses = [*parts(draw, "hwd" if "hwd" in (first, second) else "lwd", 2, kinds=_SAME), draw.clause("home")]
    steps = [*chain(clauses, one.role), *chain(clauses, two.role)]

    def say(speaker: Speaker) -> str:
        text = joined(clauses, speaker, 1 if speaker.language == "en" else 0)
        values = {"a": one.said(speaker), "b": two.said(speaker), "c": text}
        return speaker.filled(speaker.pick(_RELAYED["same"]), values)

    told = ", ".join(clause.plan for clause in clauses)
    plan = f"{one.role} {told}; then {two.role} does the same"
    return Mission("same_after", tree("SameAgain", (one, two), steps), plan, say, names_of(clauses))


def by_turns(draw: Draw) -> Mission:
    """Return two machines that relieve each other, twice or three times."""
    rng = draw.rng
    (one, first), (two, second) = crew_of(draw, 2)
    of = "hwd" if "hwd" in (first, second) else "lwd"
    clauses = [*parts(draw, of, 2, kinds=("watch", "ring", "ring_plain", "stop", "stop", "pass")), draw.clause("home")]
    n = Times(rng.choice((2, 2, 3)))
    cycle = [*chain(clauses, one.role), *chain(clauses, two.role)]
    steps: Steps = [{"repeat": n.value, "steps": cycle}]

    def say(speaker: Speaker) -> str:
        text = joined(clauses, speaker, 1 if speaker.language == "en" else 0)
        values = {"a": one.said(speaker), "b": two.said(speaker), "c": text, "n": n}
        return speaker.filled(speaker.pick(_RELAYED["turns"]), values)

    told = ", ".join(clause.plan for clause in clauses)
    plan = f"{n.n} times: {one.role} {told}; then {two.role} does the same"
    return Mission("by_turns", tree("TakeTurns", (one, two), steps), plan, say, names_of(clauses))


def after_yes(draw: Draw) -> Mission:
    """Return a flight of one machine, after which somebody's yes lets a second one start."""
    rng = draw.rng
    (one, first), (two, second) = crew_of(draw, 2)
    kinds = ("over", "over_plain", "watch", "ring", "stop")
    lead = [*parts(draw, first, 1, kinds=kinds), draw.clause("home")]
    follow = [*parts(draw, second, 1, kinds=kinds), draw.clause("home")]
    if rng.random() < 0.25:
        follow = [draw.clause("leave")]
    asked, (question, en, es) = person(draw), draw.fact()
    told_no = rng.random() < 0.45
    ask: dict[str, Any] = {"ask": question, "of": [asked.role]}
    then = chain(follow, two.role)
    steps: Steps = [*chain(lead, one.role), ask, *then]
    if told_no:
        kept = ask | {"save_as": "reply"}
        steps = [*chain(lead, one.role), kept, {"if": "reply.answer == 'yes'", "then": then}]

    def say(speaker: Speaker) -> str:
        form = 1 if speaker.language == "en" else 0
        values = {"a": one.said(speaker), "b": two.said(speaker), "u": asked.said, "x": (en, es)}
        values |= {"c": joined(lead, speaker, form), "d": joined(follow, speaker, form)}
        text = speaker.filled(speaker.pick(_RELAYED["after_yes"]), values)
        return text + (speaker.pick(_RELAYED["on_no"]) if told_no else "")

    first_told, then_told = (", ".join(clause.plan for clause in job) for job in (lead, follow))
    plan = f"{one.role} {first_told}; {asked.said[0]} is asked; on yes {two.role} {then_told}"
    plan += "; on no nothing more" if told_no else ""
    agents = (one, two, asked)
    return Mission("after_yes", tree("SecondAfterYes", agents, steps), plan, say, names_of([*lead, *follow]))
