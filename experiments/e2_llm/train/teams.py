"""Missions of two or three machines: side by side, in turn, and with a point at which they wait for each other."""

from collections.abc import Sequence
from typing import Any, Final

from experiments.e2_llm.train.clauses import Clause, Draw, Steps, over
from experiments.e2_llm.train.missions import (
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
    tree,
)
from experiments.e2_llm.train.phrases import THREE, TURNS, TWO
from experiments.e2_llm.train.phrases_cases import CASES
from experiments.e2_llm.train.speaker import Speaker

_KINDS: Final = (
    "over",
    "over",
    "watch",
    "watch",
    "land",
    "stop",
    "ring",
    "zigzag",
    "line",
    "explore",
    "tour",
    "pass",
    "shuttle",
    "watch_plain",
    "ring_plain",
    "ring_plain",
    "zigzag_plain",
    "explore_plain",
    "tour_plain",
    "over_plain",
)


def crew_of(draw: Draw, count: int) -> list[tuple[Machine, str]]:
    """Return so many machines that the site has, and their shipped types."""
    have = {of: len(draw.at.ids[of]) for of in ("lwd", "hwd")}
    found: list[tuple[Machine, str]] = []
    drawn: list[str] = []
    for number in range(count):
        of = draw.rng.choice([one for one in have if drawn.count(one) < have[one]])
        drawn.append(of)
        role = (
            f"{draw.at.kinds[of][0]}_{'abc'[number]}"
            if drawn.count(of) > 1 or draw.rng.random() < 0.4
            else ("light" if of == "lwd" else "heavy")
        )
        found.append((machine(draw, role, of, other=drawn.count(of) == 2, plain=True), of))
    return found


def _told(who: Machine, clauses: Sequence[Clause]) -> str:
    return f"{who.role} " + ", ".join(one.plan for one in clauses)


def _said(speaker: Speaker, who: Machine, clauses: Sequence[Clause]) -> str:
    return f"{who.said(speaker)} {joined(clauses, speaker, 1 if speaker.language == 'en' else 0)}"


def side_by_side(draw: Draw) -> Mission:
    """Return two or three machines, each with its own parts, at the same time."""
    count = draw.rng.choice((2, 2, 2, 3)) if len(draw.at.ids["lwd"]) + len(draw.at.ids["hwd"]) > 2 else 2
    crew = crew_of(draw, count)
    jobs = [ended(draw, parts(draw, of, 2 if count == 2 else 1, kinds=_KINDS)) for _, of in crew]
    agents: list[Machine | Person] = [who for who, _ in crew]
    if draw.rng.random() < 0.2:
        asked = person(draw)
        agents.append(asked)
        jobs[0].insert(1, ask_clause(draw, asked))
    branches: Steps = []
    for (who, _), clauses in zip(crew, jobs, strict=True):
        steps = chain(clauses, who.role)
        branches.append(steps[0] if len(steps) == 1 else {"sequence": steps})

    def say(speaker: Speaker) -> str:
        texts = [_said(speaker, who, clauses) for (who, _), clauses in zip(crew, jobs, strict=True)]
        frames = (TWO if count == 2 else THREE)[speaker.language]
        return speaker.filled(speaker.of(frames), dict(zip("abd", texts, strict=False)))

    plan = "In parallel: " + "; ".join(_told(who, clauses) for (who, _), clauses in zip(crew, jobs, strict=True))
    return Mission(f"team_{count}", tree("SideBySide", agents, [{"parallel": branches}]), plan, say, _names(jobs))


def in_turn(draw: Draw) -> Mission:
    """Return two machines, one after the other."""
    crew = crew_of(draw, 2)
    jobs = [
        [*parts(draw, of, 1, kinds=("over", "watch", "ring", "stop", "tour")), draw.clause("home")] for _, of in crew
    ]
    steps = [step for (who, _), clauses in zip(crew, jobs, strict=True) for step in chain(clauses, who.role)]

    def say(speaker: Speaker) -> str:
        texts = [_said(speaker, who, clauses) for (who, _), clauses in zip(crew, jobs, strict=True)]
        return speaker.filled(speaker.of(TURNS[speaker.language]), dict(zip("ab", texts, strict=True)))

    plan = "In turn: " + "; then ".join(_told(who, clauses) for (who, _), clauses in zip(crew, jobs, strict=True))
    return Mission("in_turn", tree("OneByOne", [who for who, _ in crew], steps), plan, say, _names(jobs))


def meet(draw: Draw) -> Mission:
    """Return two machines that go on when both are in place."""
    (one, _), (two, _) = crew_of(draw, 2)
    p, q = draw.spots(2)
    h = draw.height()
    then = draw.rng.choice(("then_home", "then_land", "swap"))
    both = ((one, p, q), (two, q, p))
    home: list[dict[str, Any]] = [{"do": "ReturnHome", "agent": who.role} for who, _, _ in both]
    match then:
        case "then_home":
            after = home
        case "then_land":
            after = [{"do": "FlyAndLand", "agent": who.role, "at": spot.value} for who, spot, _ in both]
        case _:
            after = [
                {"sequence": [over(who.role, other, h), back]} for (who, _, other), back in zip(both, home, strict=True)
            ]
    steps: Steps = [{"parallel": [over(who.role, spot, h) for who, spot, _ in both]}, {"parallel": after}]

    def say(speaker: Speaker) -> str:
        values = {
            "a": one.said(speaker),
            "b": two.said(speaker),
            "p": p,
            "q": q,
            "h": h,
            "c": speaker.pick(CASES[then]),
        }
        return speaker.filled(speaker.pick(CASES["meet"]), values)

    plan = f"{one.role} hovers over {p.value}, {two.role} over {q.value}; when both are there, {CASES[then][0][0]}"
    return Mission("meet", tree("MeetThenGo", (one, two), steps), plan, say, (*p.names, *q.names))


def _names(jobs: Sequence[Sequence[Clause]]) -> tuple[str, ...]:
    return tuple(name for clauses in jobs for name in names_of(clauses))
