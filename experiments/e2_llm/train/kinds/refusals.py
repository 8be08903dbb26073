"""Requests that get a reason or a question instead of a tree."""

from typing import Any

from experiments.e2_llm.train.kinds.clauses import Draw
from experiments.e2_llm.train.kinds.formations import plural
from experiments.e2_llm.train.kinds.missions import Mission, machine
from experiments.e2_llm.train.kinds.refusing import IMPOSSIBLE, NOWHERE, SKILLS, STRANGERS, UNCLEAR, UNITS, Row
from experiments.e2_llm.train.kinds.refusing_dangers import DANGEROUS
from experiments.e2_llm.train.phrases import Both
from experiments.e2_llm.train.phrases.wide.refusals import MORE_DANGEROUS, MORE_IMPOSSIBLE, MORE_UNCLEAR
from experiments.e2_llm.train.sites import PLACES
from experiments.e2_llm.train.speaker import Metres, Speaker

LIMIT_M = 120
SAFE_M = 40


def impossible(draw: Draw) -> Mission:
    """Return something that cannot be done here."""
    kind = draw.rng.choice(("skill", "skill", "many", "high", "far", "nobody", "stranger", "no_unit"))
    return _refusal(draw, "impossible", IMPOSSIBLE[kind], MORE_IMPOSSIBLE[kind], _values(draw, kind))


def dangerous(draw: Draw) -> Mission:
    """Return something that must not be done."""
    kind = draw.rng.choice(list(DANGEROUS))
    return _refusal(draw, "dangerous", DANGEROUS[kind], MORE_DANGEROUS[kind], {})


def unclear(draw: Draw) -> Mission:
    """Return something of which it is not said what or where."""
    kind = draw.rng.choice(list(UNCLEAR))
    values: dict[str, Any] = {}
    if kind == "unknown":
        elsewhere = [said for name, said in PLACES.items() if name not in draw.at.shown.site.places]
        values["z"] = draw.rng.choice(elsewhere if draw.rng.random() < 0.5 else NOWHERE)
    values |= {"r": Metres(draw.rng.choice((10, 15, 20, 25, 40))), "n": draw.rng.choice((3, 4, 5, 6, 8))}
    return _refusal(draw, "question", UNCLEAR[kind], MORE_UNCLEAR[kind], values)


def _values(draw: Draw, kind: str) -> dict[str, Any]:
    of = draw.rng.choice(("lwd", "hwd"))
    name, label, spanish = draw.at.kinds[of]
    have = len(draw.at.ids[of])
    match kind:
        case "skill":
            english, spanish_k, told = draw.rng.choice(SKILLS)
            return {"k": (english, spanish_k), "k_told": told}
        case "many":
            return {"n": have + draw.rng.randint(1, 30), "ms": plural(label, spanish), "m": have}
        case "high":
            return {"h": Metres(draw.rng.choice((130, 150, 180, 200, 250, 300, 400, 800)))}
        case "far":
            return {"d": (f"{(n := draw.rng.choice((2, 3, 5, 8, 12, 40)))} km", f"{n} km")}
        case "stranger":
            return {"z": draw.rng.choice(STRANGERS)}
        case "no_unit":
            return {"z": (draw.rng.choice(UNITS),) * 2}
        case _:
            return {"z": (f"{name}_{have + draw.rng.randint(1, 6)}",) * 2}


def _refusal(draw: Draw, kind: str, row: Row, wide: Both, more: dict[str, Any]) -> Mission:
    wordings, why, instead = row
    of = draw.rng.choice(("lwd", "hwd", "drone"))
    who = machine(draw, "drone", of, by_id=of != "drone" and draw.rng.random() < 0.2)
    spot = draw.spot(plain=True)
    values = {"p": spot, "h": draw.height(), "t": draw.time(), "l": Metres(SAFE_M)} | more
    length = values["h"]
    told = {
        "a": who.en[0],
        "A": who.en[0][:1].upper() + who.en[0][1:],
        "p": spot.value,
        "h": length.value,
        "l": f"{SAFE_M} m",
        "k": more.get("k_told", ""),
        "m": more.get("m", ""),
        "d": more.get("d", ("",))[0],
        "z": more.get("z", ("",))[0],
        "w": _listed(list(draw.at.shown.site.places)),
        "v": _listed([*draw.at.ids["lwd"], *draw.at.ids["hwd"]]),
        "o": _listed([*draw.at.ids["watcher"], *draw.at.ids["picker"]]),
    }
    reason, other = why.format_map(told), instead.format_map(told)
    other = other.replace("All 1 of them", "The one there is")
    reason = reason.replace("only 1 of them", "only one of them")
    answer = {"question": reason} if kind == "question" else {"impossible": reason, "instead": other}
    plan = {"question": "It is not said clearly what or where.", "dangerous": "That is not safe."}.get(
        kind, "That cannot be done here."
    )
    both: Both = (*wordings, *wide)

    def say(speaker: Speaker) -> str:
        return speaker.filled(speaker.pick(both), values | {"a": who.said(speaker)})

    return Mission(kind, answer, plan, say, spot.names)


def _listed(names: list[str]) -> str:
    return ", ".join(names[:-1]) + " and " + names[-1] if len(names) > 1 else names[0]
