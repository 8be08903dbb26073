"""Missions that end: on the ground somewhere for good, alone or side by side, or at home however that is called."""

from typing import Any, Final

from experiments.e2_llm.train.kinds.clauses import Clause, Draw, Steps, beside
from experiments.e2_llm.train.kinds.formations import in_a_row, plural
from experiments.e2_llm.train.kinds.missions import (
    RINGS,
    SIDES,
    Machine,
    Mission,
    Person,
    chain,
    joined,
    machine,
    names_of,
    person,
    told,
    tree,
)
from experiments.e2_llm.train.phrases.parts import SINGLE
from experiments.e2_llm.train.phrases.turns import PARKED
from experiments.e2_llm.train.phrases.ways import NOT_HOME
from experiments.e2_llm.train.phrases.wide.deciding import MORE_NOT_HOME
from experiments.e2_llm.train.phrases.wide.turns import MORE_PARKED
from experiments.e2_llm.train.speaker import Metres, Speaker, widened

_PARKED: Final = widened(PARKED, MORE_PARKED)
_NOT_HOME: Final = (*NOT_HOME, *MORE_NOT_HOME)


def settle(draw: Draw) -> Mission:
    """Return one machine that lands and stays, or lands and comes home, or ends at its own port after a circle."""
    rng = draw.rng
    of = rng.choice(("lwd", "lwd", "hwd", "drone"))
    who = machine(draw, "drone", of, by_id=of != "drone" and rng.random() < 0.2)
    clauses = _ends(
        draw, rng.choice(("good", "good", "after", "after", "aside", "land_home", "ring_home", "base_home"))
    )
    stays = clauses[-1].kind.startswith("leave")
    more = stays and rng.random() < 0.35

    def say(speaker: Speaker) -> str:
        frame, form = speaker.of([one for one in SINGLE[speaker.language] if not (more and "?" in one[0])])
        text = speaker.filled(frame, {"a": who.said(speaker), "c": joined(clauses, speaker, form)}, form)
        return text + (" " + speaker.pick(_NOT_HOME) if more else "")

    kind = "for_good" if stays else "own_port"
    task = "LandForGood" if stays else "BackToPort"
    steps = chain(clauses, "drone")
    return Mission(kind, tree(task, (who,), steps), told(clauses, "One drone"), say, names_of(clauses))


def _ends(draw: Draw, how: str) -> list[Clause]:
    rng = draw.rng
    own = Clause("home_own", {})
    match how:
        case "good":
            return [draw.clause("leave")]
        case "after":
            kind = rng.choice(("over", "over_plain", "watch", "watch_plain", "ring", "ring_plain", "line", "pass"))
            return [draw.clause(kind), draw.clause("leave")]
        case "aside":
            ring = draw.clause(rng.choice(("ring", "ring_plain", "watch")))
            gap = Metres(rng.choice((5, 8, 10, 15, 20)))
            spot = ring.values["p"] if len(ring.values["p"].names) == 1 and "(" not in ring.values["p"].value else None
            values = {"p": spot or draw.spot(plain=True), "side": rng.choice(SIDES), "g": gap}
            return [ring, Clause("leave_aside", values)]
        case "land_home":
            return [draw.clause(rng.choice(("land", "stop", "stop"))), own]
        case "ring_home":
            ring = draw.clause(rng.choice(RINGS))
            again = Clause("recentre", {"p": ring.values["p"], "h": ring.values["h"]})
            return [ring, again, own] if rng.random() < 0.5 else [ring, own]
    base = Clause(rng.choice(("over", "watch")), {"p": draw.base(), "h": draw.height(), "t": draw.time()})
    return [draw.clause("over"), base, own] if rng.random() < 0.5 else [base, own]


def parked(draw: Draw) -> Mission:
    """Return two to four machines that land some metres from each other, and stay there or come home later."""
    rng = draw.rng
    of = rng.choice([key for key in ("lwd", "lwd", "hwd") if len(draw.at.ids[key]) > 1] or ["lwd"])
    name = draw.at.kinds[of][0]
    end = rng.choice(("good", "good", "good", "home", "ask_home"))
    p, g, t = draw.spot(plain=True), Metres(rng.choice((6, 8, 10, 12, 15, 20))), draw.time()
    asked, (question, en, es) = person(draw), draw.fact()
    between: Steps = [{"ask": question, "of": [asked.role]}] if end == "ask_home" else [{"wait": t.value}]
    mixed = rng.random() < 0.5
    agents: list[Any]
    if mixed:
        one, two = machine(draw, "light", "lwd", plain=True), machine(draw, "heavy", "hwd", plain=True)
        agents = [one, two]
        spots = (p.value, beside(p, SIDES[2], g))
        landings = [{"do": "FlyAndLand", "agent": w.role, "at": at} for w, at in zip(agents, spots, strict=True)]
        steps: Steps = [{"parallel": landings}]
        back: Steps = [{"parallel": [{"do": "ReturnHome", "agent": who.role} for who in agents]}]
        count = 2
    else:
        count = rng.randint(2, min(len(draw.at.ids[of]), 3)) if len(draw.at.ids[of]) > 1 else 2
        steps = [{"do": "FlyAndLand", "agent": "drones", "at": in_a_row(p, g, count)}]
        back = [{"do": "ReturnHome", "agent": "drones"}]
        agents = [Team("drones", name, count)]
    steps += [] if end == "good" else [*between, *back]

    def say(speaker: Speaker) -> str:
        values: dict[str, Any] = {"p": p, "g": g, "n": count, "ms": plural(*draw.at.kinds[of][1:])}
        if mixed:
            values |= {"a": agents[0].said(speaker), "b": agents[1].said(speaker)}
        last = speaker.filled(speaker.pick(_PARKED[end]), {"t": t, "u": asked.said, "x": (en, es)})
        text = speaker.filled(speaker.pick(_PARKED["two" if mixed else "more"]).replace("{e}", "\0"), values)
        return text.replace("\0", last)

    people: list[Machine | Person] = [asked] if end == "ask_home" else []
    pause = {"good": "stay there", "home": f"return after {t.value}"}.get(end, f"return when {asked.said[0]} agrees")
    plan = f"{'Both' if count == 2 else f'{count} {name}'} land at {p.value}, {g.value} apart; they {pause}"
    return Mission("parked", tree("ParkSideBySide", [*agents, *people], steps), plan, say, p.names)


class Team:
    """A role of several machines of a type."""

    def __init__(self, role: str, type_: str, count: int) -> None:
        self.entry: dict[str, Any] = {"name": role, "type": type_, "count": count}
