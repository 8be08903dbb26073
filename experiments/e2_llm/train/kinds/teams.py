"""Missions of two or three machines: side by side, in turn, and with a point at which they wait for each other."""

from collections.abc import Sequence
from typing import Any, Final

from experiments.e2_llm.train.kinds.clauses import Clause, Draw, Steps, over
from experiments.e2_llm.train.kinds.formations import plural
from experiments.e2_llm.train.kinds.missions import (
    SIDES,
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
from experiments.e2_llm.train.phrases.cases import CASES
from experiments.e2_llm.train.phrases.parts import THREE, TURNS, TWO
from experiments.e2_llm.train.phrases.wide.one_place import ONE_PLACE, PLAIN_INTRO, SAME_PLACE
from experiments.e2_llm.train.phrases.wide.relays import MORE_CASES
from experiments.e2_llm.train.phrases.wide.teams import (
    AT_ONCE,
    BACKWARDS,
    BODIES,
    ENDS_FIRST,
    IN_LINE,
    INTRO_PAIR,
    INTRO_TWINS,
    LABELS,
    LANDED_FIRST,
    MORE_THREE,
    MORE_TURNS,
    MORE_TWO,
    NAMED,
    ORDERED,
    ROLES,
    STRAIGHT,
    THREE_LABELS,
    THREE_NAMED,
    THREE_TOGETHER,
    TOGETHER,
)
from experiments.e2_llm.train.speaker import Metres, Speaker, Spot, Times, widened

_MEETING: Final = widened(CASES, MORE_CASES)
NAMES_FIRST: Final = 0.5
"""Of wide wordings of two machines, so many say first which machines there are, or how it ends."""

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


_Job = tuple[tuple[Machine, str], Sequence[Clause]]
_Roles = Sequence[tuple[str, str]]


def _called(who: Machine, speaker: Speaker) -> str:
    """Return a machine in words that need no other machine told before it."""
    options = who.es if speaker.language == "es" else who.en
    return str(speaker.rng.choice([one for one in options if one not in ("the other one", "el otro")]))


def _named_first(
    draw: Draw,
    speaker: Speaker,
    one: _Job,
    two: _Job,
    *,
    in_turn: bool = False,
    roles: _Roles = (),
    turned: float = 0.3,
) -> str:
    """Return the jobs of two machines in words that first say which machines there are.

    Args:
        draw: of the practice.
        speaker: who says it.
        one: a machine and its parts.
        two: the other one.
        in_turn: whether it starts when the first is home.
        roles: names of both that may be used, besides those for any two.
        turned: share of wordings that tell the second job before the first.
    """
    rng, lang = speaker.rng, speaker.language
    ((first, of), clauses), ((second, of_second), others) = one, two
    twins = of == of_second
    label, other = rng.choice((*(LABELS if twins else NAMED)[lang], *roles))
    frames = BACKWARDS if rng.random() < turned and (not twins or label in ORDERED) else BODIES
    frame, form = rng.choice((IN_LINE if in_turn else frames)[lang])
    intros = INTRO_PAIR if not twins else PLAIN_INTRO if in_turn else INTRO_TWINS
    values: dict[str, Any] = {"l": label, "k": other, "ms": plural(*draw.at.kinds[of][1:])}
    values |= {"a": _called(first, speaker), "b": _called(second, speaker)}
    values["i"] = speaker.filled(rng.choice(intros[lang]), values)
    values |= {"s": rng.choice(AT_ONCE[lang]), "t": rng.choice(TOGETHER[lang])}
    if lang == "es" and form == 0 and rng.random() < 0.3 and "debe" not in frame and frame.startswith("{i}. {L}:"):
        form = 2
    values |= {"c": joined(clauses, speaker, form), "d": joined(others, speaker, form)}
    return speaker.filled(frame, values, form)


def _three_named(speaker: Speaker, jobs: Sequence[_Job]) -> str:
    """Return the jobs of three machines, each with a name."""
    rng, lang = speaker.rng, speaker.language
    frame, form = rng.choice(THREE_NAMED[lang])
    texts = [joined(clauses, speaker, form) for _, clauses in jobs]
    values = dict(zip(("a", "b", "d"), (_called(who, speaker) for (who, _), _ in jobs), strict=True))
    values |= dict(zip(("l", "k", "m"), rng.choice(THREE_LABELS[lang]), strict=True))
    values |= dict(zip(("x", "y", "z"), texts, strict=True)) | {"t": rng.choice(THREE_TOGETHER[lang])}
    return speaker.filled(frame, values, form)


def _end_first(speaker: Speaker, one: _Job, two: _Job) -> str:
    """Return the jobs of two machines in words that tell the end first; "" = there is nothing before it."""
    (first, _), clauses = one
    (second, _), others = two
    rng, lang = speaker.rng, speaker.language
    form = 1 if lang == "en" else 0
    last = [_end_of(job) for job in (clauses, others)]
    values: dict[str, Any] = {"a": _called(first, speaker), "b": _called(second, speaker)}
    before = [joined(job[:-1], speaker, form) if len(job) > 1 else STRAIGHT[lang] for job in (clauses, others)]
    values |= dict(zip("ef", before, strict=True))
    if all(one.kind in ("land", "aside_land") for one in last) and max(len(clauses), len(others)) > 1:
        values |= {"p": _spot_of(last[0]), "q": _spot_of(last[1])}
        frames = LANDED_FIRST[lang] if min(len(clauses), len(others)) > 1 else LANDED_FIRST[lang][:2]
        return speaker.filled(rng.choice(frames), values, form)
    if min(len(clauses), len(others)) < 2:
        return ""
    values |= {"c": last[0].said(speaker, form), "d": last[1].said(speaker, form)}
    return speaker.filled(rng.choice(ENDS_FIRST[lang]), values, form)


def _spot_of(clause: Clause) -> Spot:
    """Return where a landing is."""
    values = clause.values
    if clause.kind == "land":
        spot: Spot = values["p"]
        return spot
    p, side, g = values["p"], values["side"], values["g"].m
    return Spot("", f"{g} m {side[0]} of {p.en}", f"{g} m al {side[1]} de {p.es}")


def _end_of(clauses: Sequence[Clause]) -> Clause:
    """Return the last part, with its place by name where it says `there`."""
    last = clauses[-1]
    if last.kind == "stay":
        return Clause("land", {"p": next(one.values["p"] for one in reversed(clauses) if "p" in one.values)})
    return Clause("land", {"p": last.values["p"]}) if last.kind == "land_end" else last


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
        told = list(zip(crew, jobs, strict=True))
        if speaker.wide and count == 2 and speaker.rng.random() < NAMES_FIRST:
            text = _end_first(speaker, *told) if speaker.rng.random() < 0.2 else ""
            return text or _named_first(draw, speaker, *told)
        if speaker.wide and count == 3 and speaker.rng.random() < 0.4:
            return _three_named(speaker, told)
        texts = [_said(speaker, who, clauses) for (who, _), clauses in told]
        plain, more = (TWO, MORE_TWO) if count == 2 else (THREE, MORE_THREE)
        frame = speaker.of(plain[speaker.language], more[speaker.language])
        return speaker.filled(frame, dict(zip("abd", texts, strict=False)))

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
        told = list(zip(crew, jobs, strict=True))
        if speaker.wide and speaker.rng.random() < 0.35:
            return _named_first(draw, speaker, *told, in_turn=True)
        texts = [_said(speaker, who, clauses) for (who, _), clauses in told]
        frame = speaker.of(TURNS[speaker.language], MORE_TURNS[speaker.language])
        return speaker.filled(frame, dict(zip("ab", texts, strict=True)))

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
            "c": speaker.pick(_MEETING[then]),
        }
        return speaker.filled(speaker.pick(_MEETING["meet"]), values)

    plan = f"{one.role} hovers over {p.value}, {two.role} over {q.value}; when both are there, {CASES[then][0][0]}"
    return Mission("meet", tree("MeetThenGo", (one, two), steps), plan, say, (*p.names, *q.names))


def at_one_place(draw: Draw) -> Mission:
    """Return two machines that work at the same place at one time: one at it, one round or beside it."""
    rng = draw.rng
    (one, _), (two, _) = crew = crew_of(draw, 2)
    p, q, far = draw.spots(3)
    h, low = draw.height(), Metres(rng.choice((10, 12, 15, 18)))
    jobs = [_inner(draw, p, q, low), _outer(draw, p, far, h)]
    goes_off = any(one.values.get("p") == q for one in jobs[0])
    branches: Steps = []
    for (who, _), clauses in zip(crew, jobs, strict=True):
        steps = chain(clauses, who.role)
        branches.append(steps[0] if len(steps) == 1 else {"sequence": steps})

    def say(speaker: Speaker) -> str:
        form = 1 if speaker.language == "en" else 0
        place_first = speaker.rng.random() < 0.35
        again = Spot(p.value, speaker.rng.choice(SAME_PLACE[0]), speaker.rng.choice(SAME_PLACE[1]), p.names)
        first = _there(jobs[0], p, again) if place_first else jobs[0]
        second = jobs[1] if goes_off else _there(jobs[1], p, again)
        if speaker.wide and not place_first and speaker.rng.random() < 0.4:
            text = _end_first(speaker, (crew[0], jobs[0]), (crew[1], jobs[1])) if speaker.rng.random() < 0.3 else ""
            turned = 0.3 if second is jobs[1] else 0.0  # before `the same place` comes its name
            roles = ROLES[speaker.language] * 2
            return text or _named_first(draw, speaker, (crew[0], first), (crew[1], second), roles=roles, turned=turned)
        values: dict[str, Any] = {"p": p, "a": one.said(speaker), "b": two.said(speaker)}
        values |= {"c": joined(first, speaker, form), "d": joined(second, speaker, form)}
        return speaker.filled(speaker.pick(ONE_PLACE["place_first" if place_first else "named"]), values, form)

    plan = "In parallel: " + "; ".join(_told(who, clauses) for (who, _), clauses in zip(crew, jobs, strict=True))
    return Mission("one_place", tree("WorkAtOnePlace", (one, two), [{"parallel": branches}]), plan, say, _names(jobs))


def _inner(draw: Draw, p: Spot, q: Spot, low: Metres) -> list[Clause]:
    """Return what the one does that works at the place itself."""
    time = draw.time()
    match draw.rng.choice(("land", "land", "stop", "stop_away", "watch", "watch", "watch_tell", "stop_tell", "over")):
        case "land":
            return [Clause("land", {"p": p})]
        case "stop":
            return [Clause("stop", {"p": p, "t": time}), draw.clause("home")]
        case "stop_away":
            return [Clause("stop", {"p": p, "t": time}), Clause("land", {"p": q})]
        case "watch":
            return [Clause("watch", {"p": p, "h": low, "t": time}), draw.clause("home")]
        case "watch_tell":
            return [Clause("watch", {"p": p, "h": low, "t": time}), draw.clause("tell"), draw.clause("home")]
        case "stop_tell":
            return [Clause("stop", {"p": p, "t": time}), draw.clause("tell"), draw.clause("home")]
    return [Clause("over", {"p": p, "h": low}), draw.clause("tell"), Clause("land", {"p": q})]


def _outer(draw: Draw, p: Spot, q: Spot, h: Metres) -> list[Clause]:
    """Return what the one does that goes round the place or stands beside it."""
    rng = draw.rng
    r, side = Metres(rng.choice((10, 15, 18, 25, 30, 40, 45))), rng.choice(SIDES)
    near = draw.at.beside(p.value, side[0], rng.choice((15, 20, 25, 30, 40)))
    values = {"p": p, "r": r, "h": h}
    match rng.choice(("ring", "ring", "ring_plain", "rings", "rings", "beside", "beside", "both")):
        case "ring":
            found = [Clause("ring", values)]
        case "ring_plain":
            found = [Clause("ring_plain", values | {"h": Metres(30)})]
        case "rings":
            found = [Clause("rings", values | {"n": Times(rng.choice((2, 3, 4)))})]
        case "beside":
            found = [Clause("watch", {"p": near, "h": h, "t": draw.time()})]
        case _:
            found = [Clause("watch", {"p": near, "h": h, "t": draw.time()}), Clause("ring", values)]
    dice = rng.random()
    if dice < 0.15:
        found.append(draw.clause("wait"))
    elif dice < 0.35:
        found.append(draw.clause("tell"))
    dice = rng.random()
    if dice < 0.4:
        return [*found, draw.clause("home")]
    if dice < 0.7:
        return [*found, Clause("aside_land", {"p": p, "side": side, "g": Metres(rng.choice((15, 20, 25, 30, 35)))})]
    return [*found, Clause("land", {"p": q})]


def _there(clauses: Sequence[Clause], p: Spot, again: Spot) -> list[Clause]:
    """Return parts that call a place by other words: it was named before."""
    found = []
    for one in clauses:
        here = one.values.get("p")
        if here == p:
            one = Clause(one.kind, one.values | {"p": again})
        elif isinstance(here, Spot) and here.names == p.names:
            en, es = here.en.split(" of ")[0], here.es.split(" de ")[0]
            told = Spot(here.value, f"{en} of {again.en}", f"{es} de {again.es}", here.names)
            one = Clause(one.kind, one.values | {"p": told})
        found.append(one)
    return found


def _names(jobs: Sequence[Sequence[Clause]]) -> tuple[str, ...]:
    return tuple(name for clauses in jobs for name in names_of(clauses))
