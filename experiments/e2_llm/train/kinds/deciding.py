"""Missions in which an answer or a charge decides: to fly or not at all, one place or another, one machine or another."""

from typing import Any, Final

from experiments.e2_llm.train.kinds.clauses import Clause, Draw, Steps, along, over
from experiments.e2_llm.train.kinds.conditions import percent_said
from experiments.e2_llm.train.kinds.missions import (
    Machine,
    Mission,
    chain,
    ended,
    joined,
    machine,
    names_of,
    person,
    third,
    told,
    tree,
)
from experiments.e2_llm.train.kinds.teams import crew_of
from experiments.e2_llm.train.phrases.second import FIRST_AGAIN, HOVERS, SECOND
from experiments.e2_llm.train.phrases.ways import EITHER, NOTHING, ONLY_IF
from experiments.e2_llm.train.phrases.wide.deciding import MORE_EITHER, MORE_NOTHING, MORE_ONLY_IF
from experiments.e2_llm.train.speaker import Metres, Speaker, widened

_EITHER: Final = widened(EITHER, MORE_EITHER)
_NOTHING: Final = (*NOTHING, *MORE_NOTHING)
_ONLY_IF: Final = widened(ONLY_IF, MORE_ONLY_IF)
_FLIGHTS: Final = ("over", "over_plain", "watch", "watch_plain", "ring", "ring_plain", "stop", "leave", "tour", "pass")


def only_if(draw: Draw) -> Mission:
    """Return a mission that is flown if somebody says yes, or the charge is enough; else nothing happens."""
    rng = draw.rng
    who = machine(draw, "drone", rng.choice(("lwd", "hwd")), by_id=rng.random() < 0.25)
    clauses = [draw.clause(rng.choice(_FLIGHTS))]
    if clauses[0].kind != "leave":
        clauses = ended(draw, [*clauses, draw.clause("over")] if rng.random() < 0.3 else clauses)
    flight, by_charge = chain(clauses, "drone"), rng.random() < 0.3
    asked, (question, en, es) = person(draw), draw.fact()
    percent = rng.choice((35, 40, 45, 50, 55, 60, 65, 70, 75, 80, 85))
    steps: Steps = [{"ask": question, "of": [asked.role], "save_as": "reply"}]
    steps.append({"if": "reply.answer == 'yes'", "then": flight})
    if by_charge:
        steps = [{"if": f"drone.battery > {percent} %", "then": flight}]

    def say(speaker: Speaker) -> str:
        values: dict[str, Any] = {
            "a": third(speaker, who, clauses),
            "m": who.said(speaker),
            "b": percent_said(speaker, percent),
        }
        values |= {"u": asked.said, "x": (en, es), "z": speaker.pick(_NOTHING), "question": question}
        return speaker.filled(speaker.pick(_ONLY_IF["charge" if by_charge else "asked"]), values)

    when = f"With more than {percent} % of charge" if by_charge else f"{asked.said[0]} is asked; on yes"
    agents = (who,) if by_charge else (who, asked)
    plan = f"{when} {told(clauses, 'the drone')}; else nothing happens"
    return Mission("only_if", tree("OnlyIf", agents, steps), plan, say, names_of(clauses))


def either(draw: Draw) -> Mission:
    """Return a mission in which an answer decides where, or who, and the rest is the same for both."""
    rng = draw.rng
    two_machines = rng.random() < 0.4
    tails = ("home", "ring_home", "ground_home") if two_machines else ("ring_home", "wait", "ground_home", "ground")
    tail = rng.choice(tails)
    p, q = draw.spot(plain=tail == "ring_home"), draw.spot(plain=True)
    h, t, r = draw.height(), draw.time(), Metres(rng.choice((10, 15, 20, 25, 30, 40)))
    asked, (question, en, es) = person(draw), draw.fact()
    one = machine(draw, "drone", rng.choice(("lwd", "hwd")), by_id=rng.random() < 0.2)
    other = one
    if two_machines:
        first, second = rng.sample(("lwd", "hwd"), 2)
        one, other = machine(draw, "light", first, plain=True), machine(draw, "heavy", second, plain=True)
        one, other = _named(one, first), _named(other, second)

    def job(who: Machine, spot: Any) -> Steps:
        if tail.startswith("ground"):
            return [{"do": "FlyAndLand", "agent": who.role, "at": spot.value}]
        if tail == "ring_home":
            return [along(who.role, f"circle({spot.value}, {r.value})", h)]
        return [over(who.role, spot, h)]

    def rest(who: Machine, spot: Any) -> Steps:
        waits: Steps = [{"wait": t.value}] if tail in ("wait", "ground_home") else []
        if tail == "wait":
            return [*waits, {"do": "FlyAndLand", "agent": who.role, "at": spot.value}]
        return [*waits, {"do": "ReturnHome", "agent": who.role}] if tail != "ground" else []

    yes, no = job(one, p), job(other, p if two_machines else q)
    after: Steps = []
    if two_machines or tail == "wait":
        yes, no = yes + rest(one, p), no + rest(other, p if two_machines else q)
    else:
        after = rest(one, p)
    steps: Steps = [
        {"ask": question, "of": [asked.role], "save_as": "reply"},
        {"if": "reply.answer == 'yes'", "then": yes, "else": no},
        *after,
    ]

    def say(speaker: Speaker) -> str:
        values: dict[str, Any] = {"a": one.said(speaker), "b": other.said(speaker), "u": asked.said, "x": (en, es)}
        values |= {"p": p, "q": q, "h": h, "t": t, "r": r, "question": question}
        head = speaker.filled(speaker.pick(_EITHER["who" if two_machines else "place"]), values)
        return head + speaker.filled(speaker.pick(_EITHER[tail]), values)

    where = f"{one.role} goes to {p.value}; on no {other.role} to {(p if two_machines else q).value}"
    then = {
        "ring_home": f"flies a circle of {r.value} there, returns",
        "home": "returns",
        "wait": f"waits {t.value}, lands there",
    }
    then |= {"ground_home": f"stays {t.value} on the ground, returns", "ground": "stays on the ground there"}
    up = "" if tail.startswith("ground") else f" at {h.value}"
    plan = f"{asked.said[0]} is asked; on yes {where}{up}; in both cases it {then[tail]}"
    agents = (one, other, asked) if two_machines else (one, asked)
    return Mission("either", tree("EitherWay", agents, steps), plan, say, (*p.names, *q.names))


def _named(who: Machine, of: str) -> Machine:
    return Machine("light" if of == "lwd" else "heavy", who.type, who.en, who.es, who.id)


def second_if(draw: Draw) -> Mission:
    """Return a flight of two machines: an answer decides whether the second one starts, or both, or one joins the other."""
    rng = draw.rng
    how = rng.choice(("keeps", "both", "joins"))
    (one, _), (two, _) = crew_of(draw, 2)
    if how != "keeps":  # the one that goes there is named first
        one, two = two, one
    asked, (question, en, es) = person(draw), draw.fact()
    spot, h = draw.spot(plain=True), draw.height()
    goal = spot if rng.random() < 0.5 else draw.spot(plain=True)
    watch = draw.clause(rng.choice(("watch", "ring", "rings")))
    job = [Clause("stop", {"p": goal, "t": draw.time()})]
    if how == "keeps" or rng.random() < 0.3:
        job = [draw.clause(rng.choice(("over", "watch", "ring", "rings", "tour")))]
    job.append(draw.clause("home"))
    ask: dict[str, Any] = {"ask": question, "of": [asked.role], "save_as": "reply"}
    up, home, flight = over(one.role, spot, h), _home(one), chain(job, two.role)
    steps: Steps = [up, ask, {"if": "reply.answer == 'yes'", "then": flight}, home]
    if how != "keeps":
        above: Steps = [{"sequence": flight}, {"sequence": [*chain([watch], one.role), home]}]
        steps = [ask, {"if": "reply.answer == 'yes'", "then": [{"parallel": above}]}]
        steps[1] |= {"else": flight} if how == "joins" else {}

    def say(speaker: Speaker) -> str:
        form = 1 if speaker.language == "en" else 0
        values: dict[str, Any] = {"a": one.said(speaker), "b": two.said(speaker), "u": asked.said, "x": (en, es)}
        hovers = speaker.filled(speaker.pick(HOVERS), {"p": spot, "h": h})
        values |= {"k": hovers if how == "keeps" else watch.said(speaker, form), "d": joined(job, speaker, form)}
        values |= dict.fromkeys(("a_", "b_"), speaker.pick(FIRST_AGAIN)) | {"question": question}
        return speaker.filled(speaker.pick(SECOND[how]), values)

    told_job = ", ".join(one.plan for one in job)
    plans = {
        "keeps": f"{one.role} hovers over {spot.value} at {h.value}; {asked.said[0]} is asked; on yes {two.role} "
        f"{told_job}; then {one.role} returns",
        "both": f"{asked.said[0]} is asked; on yes in parallel: {two.role} {told_job}; {one.role} {watch.plan}, returns",
    }
    plan = plans["keeps" if how == "keeps" else "both"] + (f"; on no {two.role} alone" if how == "joins" else "")
    names = (*names_of([watch, *job]), *spot.names)
    return Mission("second_if", tree("SecondIfSo", (one, two, asked), steps), plan, say, names)


def told_before(draw: Draw) -> Mission:
    """Return a flight whose second part, told before the question, is left out without a yes."""
    rng = draw.rng
    who = machine(draw, "drone", rng.choice(("lwd", "hwd", "drone")), plain=True)
    kinds = ("over", "watch", "watch", "ring", "ring_plain", "over_plain", "watch_plain", "pass")
    start, extra = draw.clause(rng.choice(kinds)), draw.clause(rng.choice(kinds))
    asked, (question, en, es) = person(draw), draw.fact()
    steps: Steps = [
        *chain([start], "drone"),
        {"ask": question, "of": [asked.role], "save_as": "reply"},
        {"if": "reply.answer == 'yes'", "then": chain([extra], "drone")},
        _home(who),
    ]

    def say(speaker: Speaker) -> str:
        form = 1 if speaker.language == "en" else 0
        values: dict[str, Any] = {"a": who.said(speaker), "u": asked.said, "x": (en, es), "question": question}
        values |= {"c": start.said(speaker, form), "d": extra.said(speaker, form)}
        return speaker.filled(speaker.pick(SECOND["earlier"]), values)

    plan = f"One drone {start.plan}; {asked.said[0]} is asked; on yes it {extra.plan}; in both cases it returns"
    return Mission("told_before", tree("SecondPartIfSo", (who, asked), steps), plan, say, names_of([start, extra]))


def _home(who: Machine) -> dict[str, Any]:
    return {"do": "ReturnHome", "agent": who.role}
