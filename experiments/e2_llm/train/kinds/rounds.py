"""Missions said tersely: stops in an order with one height and one pause for all, there and back, every so often."""

from collections.abc import Sequence
from typing import Any, Final

from experiments.e2_llm.train.kinds.clauses import Draw, Steps, along, over
from experiments.e2_llm.train.kinds.missions import Mission, machine, tree
from experiments.e2_llm.train.kinds.teams import crew_of
from experiments.e2_llm.train.phrases.turns import ROUNDS
from experiments.e2_llm.train.phrases.wide.turns import MORE_ROUNDS
from experiments.e2_llm.train.speaker import Metres, Speaker, Spot, Time, Times, widened

_ROUNDS: Final = widened(ROUNDS, MORE_ROUNDS)


def stops(draw: Draw) -> Mission:
    """Return one machine that has a list of places to go to, in their order."""
    rng = draw.rng
    who = machine(draw, "drone", rng.choice(("lwd", "hwd", "drone")), plain=True)
    how = rng.choice(("stops_pass", "stops_ring", "stops_ring", "stops_ground", "stops_ground"))
    spots = draw.spots(rng.choice((2, 3, 3, 4, 4)) if how != "stops_pass" else rng.choice((3, 4)))
    h, t, r = draw.height(), draw.time(), Metres(rng.choice((10, 15, 20, 25, 30)))
    steps: Steps = []
    match how:
        case "stops_ring":
            steps += [along("drone", f"circle({one.value}, {r.value})", h) for one in spots]
        case "stops_ground":
            for spot in spots:
                steps += [{"do": "FlyAndLand", "agent": "drone", "at": spot.value}, {"wait": t.value}]
        case _:
            steps.append(along("drone", "[" + ", ".join(one.value for one in spots) + "]", h))
    steps.append({"do": "ReturnHome", "agent": "drone"})

    def say(speaker: Speaker) -> str:
        between = speaker.of((", ", ", ", " - ", "; ", " > "))
        values = {"a": who.said(speaker), "ps": between.join(speaker.say(one) for one in spots), "h": h, "t": t, "r": r}
        return speaker.filled(speaker.pick(_ROUNDS[how]), values)

    where = ", ".join(one.value for one in spots)
    plan = {
        "stops_ring": f"One drone flies a circle of {r.value} round {where} at {h.value}, returns",
        "stops_ground": f"One drone lands at {where} for {t.value} each, returns",
    }.get(how, f"One drone flies along {where} at {h.value}, returns")
    names = tuple(name for one in spots for name in one.names)
    return Mission("stops", tree("StopsInOrder", (who,), steps), plan, say, names)


def two_rounds(draw: Draw) -> Mission:
    """Return two machines with a list of places each, at the same time."""
    rng = draw.rng
    (one, _), (two, _) = crew_of(draw, 2)
    spots = draw.spots(4)
    cut = rng.choice((1, 2, 2, 3))
    h, t = draw.height(), draw.time()

    def way(role: str, stops: Sequence[Spot]) -> Steps:
        found: Steps = []
        for spot in stops:
            found += [over(role, spot, h), {"wait": t.value}]
        return [*found, {"do": "ReturnHome", "agent": role}]

    ways = ((one, spots[:cut]), (two, spots[cut:]))
    steps: Steps = [{"parallel": [{"sequence": way(who.role, some)} for who, some in ways]}]

    def say(speaker: Speaker) -> str:
        ps, qs = (", ".join(speaker.say(spot) for spot in some) for _, some in ways)
        values = {"a": one.said(speaker), "b": two.said(speaker), "ps": ps, "qs": qs, "h": h, "t": t}
        return speaker.filled(speaker.pick(_ROUNDS["stops_two"]), values)

    told = "; ".join(f"{who.role} visits {', '.join(spot.value for spot in some)}" for who, some in ways)
    plan = f"In parallel: {told}; at {h.value}, {t.value} at each; both return"
    names = tuple(name for spot in spots for name in spot.names)
    return Mission("stops", tree("TwoRounds", (one, two), steps), plan, say, names)


def there_and_back(draw: Draw) -> Mission:
    """Return one machine that goes from a place to another and back, so many times."""
    rng = draw.rng
    who = machine(draw, "drone", rng.choice(("lwd", "hwd", "drone")), plain=True)
    (p, q), h, n = draw.spots(2), draw.height(), Times(rng.choice((2, 2, 3, 4)))
    ground, t = rng.random() < 0.3, Time(rng.choice((10, 20, 30, 40, 60)))

    def to(spot: Any) -> Steps:
        if ground:
            return [{"do": "FlyAndLand", "agent": "drone", "at": spot.value}, {"wait": t.value}]
        return [over("drone", spot, h)]

    home = {"do": "ReturnHome", "agent": "drone"}
    steps: Steps = [*to(p), {"repeat": n.value, "steps": [*to(q), *to(p)]}, home]

    def say(speaker: Speaker) -> str:
        values = {"a": who.said(speaker), "p": p, "q": q, "h": h, "t": t, "n": n}
        return speaker.filled(speaker.pick(_ROUNDS["there_back_ground" if ground else "there_back"]), values)

    up = f"landing for {t.value} at each end" if ground else f"at {h.value}"
    plan = f"One drone goes to {p.value}, then {n.n} times to {q.value} and back, {up}; returns"
    return Mission("there_and_back", tree("ThereAndBack", (who,), steps), plan, say, (*p.names, *q.names))


def periodic(draw: Draw) -> Mission:
    """Return a short flight that is done every so often, so many times."""
    rng = draw.rng
    who = machine(draw, "drone", rng.choice(("lwd", "hwd", "drone")), by_id=False, plain=True)
    p, h, t = draw.spot(), draw.height(), Time(rng.choice((10, 20, 30, 40, 60)))
    n, e = Times(rng.choice((2, 3, 4, 5, 6))), Time(60 * rng.choice((6, 8, 10, 15, 20, 30)))
    flight = [over("drone", p, h), {"wait": t.value}, {"do": "ReturnHome", "agent": "drone"}]
    steps: Steps = [{"repeat": n.value, "every": e.value, "steps": flight}]

    def say(speaker: Speaker) -> str:
        values = {"a": who.said(speaker), "p": p, "h": h, "t": t, "n": n, "e": e}
        return speaker.filled(speaker.pick(_ROUNDS["periodic"]), values)

    plan = f"{n.n} times, every {e.value}: the drone hovers over {p.value} at {h.value} for {t.value} and returns"
    return Mission("periodic", tree("EverySoOften", (who,), steps), plan, say, p.names)
