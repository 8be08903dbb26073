"""Missions of machines that do the same, each at its own place; and of two that come together, wait, and part."""

from collections.abc import Sequence
from typing import Any, Final

from experiments.e2_llm.train.kinds.clauses import Clause, Draw, Steps, beside
from experiments.e2_llm.train.kinds.missions import SIDES, Machine, Mission, Person, chain, machine, person, tree
from experiments.e2_llm.train.phrases.plain import FORMATION, FORMATION_THEN, PARTING
from experiments.e2_llm.train.phrases.wide.formations import MORE_FORMATION, MORE_FORMATION_THEN, THEN_TOO
from experiments.e2_llm.train.phrases.wide.parting import (
    COMES_DOWN,
    HOVER_BOTH,
    LAND_BOTH,
    MORE_PARTING,
    STAYS,
    TAKES_STATION,
    WHO_PARTS,
)
from experiments.e2_llm.train.speaker import Metres, Speaker, Spot, widened

_FORMED: Final = widened(FORMATION, MORE_FORMATION)
_FORMED_THEN: Final = widened(FORMATION_THEN, MORE_FORMATION_THEN) | dict(THEN_TOO)
_PARTED: Final = widened(PARTING, MORE_PARTING)

_TASKS: Final = {
    "line": "StandInLine",
    "row": "StandInRow",
    "each": "OneEach",
    "ring": "Surround",
    "triangle": "StandAsTriangle",
}


def formation(draw: Draw) -> Mission:
    """Return several machines of one type that go to a list of places together, and what they do then."""
    rng = draw.rng
    of = rng.choice([key for key in ("lwd", "lwd", "hwd") if len(draw.at.ids[key]) > 1] or ["lwd"])
    name, label, spanish = draw.at.kinds[of]
    have = len(draw.at.ids[of])
    count = rng.randint(2, max(2, min(have, 4)))
    kinds = [
        one for one in ("line", "row", "each", "ring", "triangle") if count >= 3 or one not in ("ring", "triangle")
    ]
    kinds = [one for one in kinds if count == 3 or one != "triangle"]
    kind = rng.choice([*kinds, "triangle", "triangle"] if count == 3 else kinds)
    p, h, t = draw.spot(plain=True), Metres(rng.choice((15, 20, 25, 30, 35, 40))), draw.time()
    values: dict[str, Any] = {"p": p, "h": h, "n": count, "m": (label, spanish), "ms": plural(label, spanish)}
    spots = draw.spots(min(count, 4))
    match kind:
        case "line":
            values["q"] = q = spots[0]
            way = f"line({p.value}, {q.value}, {count})"
        case "row":
            values["g"] = g = Metres(rng.choice((8, 10, 12, 15, 20, 25)))
            way = in_a_row(p, g, count)
        case "each":
            values["ps"] = spots
            way = "[" + ", ".join(one.value for one in spots) + "]"
        case "ring":
            values["r"] = r = Metres(rng.choice((20, 25, 30, 40)))
            way = f"circle({p.value}, {r.value}, points={count})"
        case _:
            values["r"] = r = Metres(rng.choice((12, 18, 25, 35, 40)))
            way = f"triangle({p.value}, {r.value})"
    then = rng.choice(list(_FORMED_THEN))
    asked, (question, en, es) = person(draw), draw.fact()
    told = draw.told()
    team = {"name": "drones", "type": name, "count": count}
    steps: Steps = [{"do": "FlyTo", "agent": "drones", "to": way, "height": h.value}]
    if then.startswith("wait"):
        steps.append({"wait": t.value})
    if then.startswith("ask"):
        steps.append({"ask": question, "of": [asked.role]})
    if then.startswith("tell"):
        steps.append({"notify": told[0]})
    if then.endswith("land"):
        steps.append({"do": "FlyAndLand", "agent": "drones", "at": way})
    else:
        steps.append({"do": "ReturnHome", "agent": "drones"})
    agents = [team, asked.entry] if then.startswith("ask") else [team]

    def say(speaker: Speaker) -> str:
        more = {"t": t, "u": asked.said, "x": (en, es), "y": told}
        end = speaker.filled(speaker.pick(_FORMED_THEN[then]), more)
        text = speaker.filled(speaker.pick(_FORMED[kind]).replace("{c}", "\0"), values).replace("\0", end)
        return text[:1].upper() + text[1:]

    ends = {"wait": f"wait {t.value}", "ask": f"{asked.said[0]} must confirm", "tell": "people are told"}
    end = ends.get(then.split("_")[0], "")
    last = "land there" if then.endswith("land") else "return"
    plan = f"{count} {name} go to {way} at {h.value}, " + (f"{end}, " if end else "") + f"then they {last}"
    names = tuple(name for one in (p, *spots) for name in one.names)
    return Mission("formation", {"tree": {"task": _TASKS[kind], "agents": agents, "steps": steps}}, plan, say, names)


def in_a_row(p: Spot, gap: Metres, count: int) -> str:
    """Return the places of machines side by side, as the tree has them."""
    return "[" + ", ".join([p.value, *(beside(p, SIDES[2], Metres(gap.m * i)) for i in range(1, count))]) + "]"


def plural(label: str, spanish: str) -> tuple[str, str]:
    """Return the name of a type of machines, said of several, in English and Spanish."""
    first, *rest = spanish.split()
    many = first + ("es" if first[-1] not in "aeiouó" else "s")
    words = [
        f"{word}s"
        if word[-1] in "aeo" and word not in ("de", "con", "cámara", "carga")
        else f"{word}es"
        if word[-1] == "r"
        else word
        for word in rest
    ]
    return f"{label}s", " ".join([many, *words])


def parting(draw: Draw) -> Mission:
    """Return two machines, each at its place; after an answer or a time each goes its own way."""
    rng = draw.rng
    same = rng.random() < 0.6
    first_of, second_of = ("lwd", "lwd") if same and len(draw.at.ids["lwd"]) > 1 else rng.sample(("lwd", "hwd"), 2)
    twins = first_of == second_of
    one = machine(draw, "one" if twins else _role(first_of), first_of, plain=True)
    two = machine(draw, "other" if twins else _role(second_of), second_of, other=twins, plain=True)
    p, q, r = draw.spots(3)
    h, t, g = draw.height(), draw.time(), Metres(rng.choice((6, 8, 10, 12, 15, 20)))
    apart = rng.random() < 0.5
    lands = rng.random() < 0.6
    to_one, to_two = (p.value, beside(p, SIDES[2], g)) if apart else (p.value, q.value)
    both: Steps = [
        {"do": "FlyAndLand", "agent": who.role, "at": spot}
        if lands
        else {"do": "FlyTo", "agent": who.role, "to": spot, "height": h.value}
        for who, spot in ((one, to_one), (two, to_two))
    ]
    timed = rng.random() < 0.35
    asked, (question, en, es) = person(draw), draw.fact()
    between: Steps = [{"wait": t.value}] if timed else [{"ask": question, "of": [asked.role]}]
    jobs = [
        _job(draw, kind, r, h)
        for kind in rng.choice(
            (
                ("home", "land"),
                ("home", "look"),
                ("look", "home"),
                ("land", "home"),
                ("home", "home"),
                ("home", "stay"),
                ("ring", "home"),
                ("stay", "home"),
                ("stay", "land"),
                ("ring", "stay"),
                ("tell", "home"),
                ("home", "tell"),
            )
        )
    ]
    branches: Steps = []
    for who, clauses in zip((one, two), jobs, strict=True):
        steps = chain(clauses, who.role)
        if steps:
            branches.append(steps[0] if len(steps) == 1 else {"sequence": steps})
    after: Steps = [{"parallel": branches}] if len(branches) > 1 else [*(branches[0].get("sequence") or branches)]
    steps = [{"parallel": both}, *between, *after]

    def say(speaker: Speaker) -> str:
        form = 1 if speaker.language == "en" else 0
        es_ = speaker.language == "es"
        lang = speaker.language
        stays = speaker.of(("se queda donde está" if es_ else "stays where it is",), STAYS[lang])
        texts = [_joined(clauses, speaker, form) or stays for clauses in jobs]
        values: dict[str, Any] = {
            "a": one.said(speaker),
            "b": two.said(speaker),
            "u": asked.said,
            "x": (en, es),
            "t": t,
            "p": p,
            "g": g,
        }
        values["e1"] = speaker.pick(_PARTED["one"]).format(c=texts[0])
        values["e2"] = speaker.pick(_PARTED["other"]).format(c=texts[1])
        names = speaker.rng.choice(WHO_PARTS[lang])
        values |= {"l": names[0], "k": names[1]}
        if speaker.wide and twins:
            values["e1"], values["e2"] = (f"{name} {text}" for name, text in zip(names, texts, strict=True))
        if not twins:
            values["e1"], values["e2"] = f"{_the(one, es_)} {texts[0]}", f"{_the(two, es_)} {texts[1]}"
        both_said = twins and speaker.rng.random() < 0.6
        values |= {"n": 2, "ms": plural(*draw.at.kinds[first_of][1:])}
        if apart:
            land = (
                speaker.of(("aterrizan" if es_ else "land",), LAND_BOTH[lang])
                if lands
                else speaker.of(("flotan a {h}" if es_ else "hover ({h} high)",), HOVER_BOTH[lang])
            )
            land = speaker.filled(land, {"h": h})
            head = speaker.filled(speaker.pick(_PARTED["apart_two" if both_said else "apart"]), values | {"land": land})
            return head + speaker.filled(speaker.pick(_PARTED["after_time" if timed else "after_ask"]), values)
        if lands:
            verb = speaker.of(("aterriza en {p}" if es_ else "lands at {p}",), COMES_DOWN[lang])
        else:
            verb = speaker.of(("vuela a {p} a {h}" if es_ else "flies to {p} at {h}",), TAKES_STATION[lang])
        values["d1"], values["d2"] = (speaker.filled(verb, {"p": spot, "h": h}) for spot in (p, q))
        if both_said:
            head = speaker.filled(speaker.pick(_PARTED["pair"]), values)
            return head + speaker.filled(speaker.pick(_PARTED["after_time" if timed else "after_ask"]), values)
        return speaker.filled(speaker.pick(_PARTED["parting_timed" if timed else "parting"]), values)

    agents: list[Machine | Person] = [one, two] if timed else [one, two, asked]
    first, second = (", ".join(c.plan for c in clauses) or "stays" for clauses in jobs)
    pause = f"wait {t.value}" if timed else f"{asked.said[0]} must confirm"
    plan = f"{one.role} goes to {to_one}, {two.role} to {to_two}; {pause}; then {one.role} {first}; {two.role} {second}"
    return Mission("parting", tree("MeetAndPart", agents, steps), plan, say, (*p.names, *q.names, *r.names))


def _role(of: str) -> str:
    return "light" if of == "lwd" else "heavy"


def _the(who: Machine, spanish: bool) -> str:
    said = (who.es if spanish else who.en)[0]
    return ("el " if spanish else "the ") + said.split(" ", 1)[1]


def _job(draw: Draw, kind: str, spot: Spot, height: Metres) -> list[Clause]:
    match kind:
        case "home":
            return [draw.clause("home")]
        case "land":
            return [Clause("land", {"p": spot})]
        case "tell":
            return [draw.clause("tell"), draw.clause("home")]
        case "look":
            return [Clause("watch", {"p": spot, "h": height, "t": draw.time()}), draw.clause("home")]
        case "ring":
            return [
                Clause("ring", {"p": spot, "r": Metres(draw.rng.choice((12, 18, 25))), "h": height}),
                draw.clause("home"),
            ]
    return []


def _joined(clauses: Sequence[Clause], speaker: Speaker, form: int) -> str:
    parts = [one.said(speaker, form) for one in clauses]
    return (" y " if speaker.language == "es" else " and ").join(parts)
