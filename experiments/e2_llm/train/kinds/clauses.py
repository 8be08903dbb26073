"""Parts of a mission that one machine does: what is drawn for each, and the steps it stands for."""

import random
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from msgspec import Struct

from experiments.e2_llm.train.phrases.cases import FACTS, TOLD
from experiments.e2_llm.train.phrases.parts import CLAUSES, PLANS
from experiments.e2_llm.train.phrases.plain import PLAIN, PLAIN_PLANS
from experiments.e2_llm.train.phrases.ways import ENDING_PLANS, ENDINGS
from experiments.e2_llm.train.phrases.wide.ends import MORE_ENDINGS, MORE_PLAIN
from experiments.e2_llm.train.phrases.wide.ways import MORE_CLAUSES
from experiments.e2_llm.train.sites import Practice
from experiments.e2_llm.train.speaker import Metres, Speaker, Spot, Time, Times, widened

Steps = list[dict[str, Any]]
HEIGHTS: Final = (15, 20, 25, 30, 35, 40, 45, 50, 60, 70, 80, 90)
SECONDS: Final = (10, 15, 20, 25, 30, 40, 45, 50, 90, 60, 60, 120, 180, 240, 300)
GOES: Final = ("over", "over_plain", "watch", "land", "stop", "shuttle", "leave")
"""Their place may be given in degrees; helpers of the language take names."""
ALL: Final = widened({**CLAUSES, **PLAIN, **ENDINGS}, {**MORE_CLAUSES, **MORE_PLAIN, **MORE_ENDINGS})
ALL_PLANS: Final = {**PLANS, **PLAIN_PLANS, **ENDING_PLANS}
ASSUMED_M: Final = 30
"""A height that nobody gives."""


class Clause(Struct, frozen=True):
    """One part: its kind and the values of its blanks."""

    kind: str
    values: dict[str, Any]

    def said(self, speaker: Speaker, form: int) -> str:
        """Return it in words."""
        return speaker.filled(speaker.pick(ALL[self.kind]), self.values, form)

    @property
    def plan(self) -> str:
        """Return it as a plan has it."""
        told = {key: _told(value) for key, value in self.values.items()}
        return ALL_PLANS[self.kind].format_map(told)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the site in it."""
        found: list[str] = []
        for value in self.values.values():
            for one in value if isinstance(value, tuple) else (value,):
                found += one.names if isinstance(one, Spot) else ()
        return tuple(found)


def _told(value: Any) -> str:
    match value:
        case Spot():
            return value.value
        case Metres() | Time():
            return value.value
        case Times():
            return f"{value.n} times"
        case tuple() if isinstance(value[0], str):
            return str(value[0])
        case tuple():
            return ", ".join(_told(one) for one in value)
    return str(value)


class Draw:
    """Draws values of a practice."""

    def __init__(self, rng: random.Random, at: Practice) -> None:
        self.rng, self.at = rng, at
        self._places = list(at.shown.site.places)
        rng.shuffle(self._places)

    def spot(self, *, plain: bool = False, degrees: bool = True) -> Spot:
        """Return a place not drawn yet, sometimes by degrees or beside a place."""
        name = self._places.pop(0)
        self._places.append(name)
        dice = self.rng.random()
        if plain or dice < 0.76:
            return self.at.spot(name)
        if dice < 0.88 or not degrees:
            return self.at.beside(
                name, self.rng.choice(("north", "south", "east", "west")), self.rng.choice((5, 10, 15, 20, 25, 40))
            )
        east, north = self.rng.randint(-450, 450), self.rng.choice((-1, 1)) * self.rng.randint(150, 450)
        return self.at.degrees(east, north, self.rng.randrange(3))

    def spots(self, count: int) -> tuple[Spot, ...]:
        """Return different places by name."""
        return tuple(self.spot(plain=True) for _ in range(count))

    def base(self) -> Spot:
        """Return the base, which is no machine's port."""
        return Spot("base", "the base", "la base", ("base",))

    def height(self) -> Metres:
        """Return a height."""
        return Metres(self.rng.choice(HEIGHTS))

    def time(self) -> Time:
        """Return a duration."""
        return Time(self.rng.choice(SECONDS))

    def fact(self) -> tuple[str, str, str]:
        """Return a question and how a request speaks of it."""
        return self.rng.choice(FACTS)

    def told(self) -> tuple[str, str]:
        """Return a message, in both languages."""
        return self.rng.choice(TOLD)

    def clause(self, kind: str) -> Clause:
        """Return a part of a kind."""
        rng = self.rng
        p, h, t = self.spot(degrees=kind in GOES), self.height(), self.time()
        q = self.spot(plain=True)
        if kind.endswith("_plain") and kind != "over_plain":
            plain = self.clause(kind.removesuffix("_plain"))
            return Clause(kind, plain.values | {"h": Metres(ASSUMED_M)})
        match kind:
            case "over":
                values: dict[str, Any] = {"p": p, "h": h}
            case "over_plain" | "land" | "leave":
                values = {"p": p}
            case "watch":
                values = {"p": p, "h": h, "t": t}
            case "stop":
                values = {"p": p, "t": t}
            case "ring":
                values = {"p": p, "r": Metres(rng.choice((6, 10, 14, 18, 25, 35, 40, 45, 60))), "h": h}
            case "rings":
                values = {
                    "p": p,
                    "r": Metres(rng.choice((10, 15, 25, 35, 45))),
                    "h": h,
                    "n": Times(rng.choice((2, 2, 3, 4))),
                }
            case "zigzag":
                values = {
                    "p": p,
                    "q": q,
                    "w": Metres(rng.choice((6, 12, 20, 25, 30, 40))),
                    "n": rng.choice((4, 5, 7, 9, 12)),
                    "h": h,
                }
            case "line":
                values = {"p": p, "q": q, "n": rng.choice((3, 4, 5, 6, 8)), "h": h}
            case "corners":
                values = {"p": p, "r": Metres(rng.choice((12, 25, 35, 40, 50))), "h": h}
            case "explore":
                values = {"k": self.at.spot(rng.choice(list(self.at.flown.site.regions))), "h": h}
            case "tour":
                values = {"ps": self.spots(rng.choice((2, 3, 3, 4))), "h": h, "t": t}
            case "pass":
                values = {"ps": self.spots(rng.choice((3, 3, 4))), "h": h}
            case "shuttle":
                values = {"p": p, "q": q, "n": Times(rng.choice((2, 3, 4))), "h": h}
            case "guard":
                values = {"ps": self.spots(rng.choice((2, 3))), "h": h, "t": Time(rng.choice((600, 900, 1200)))}
            case "wait":
                values = {"t": t}
            case "tell":
                values = {"x": self.told()}
            case "home" if rng.random() < 0.2:
                return Clause("home_own", {})
            case _:
                values = {}
        return Clause(kind, values)


def over(role: str, spot: Spot, height: Metres | None) -> dict[str, Any]:
    """Return the step that flies over a place."""
    return {"do": "FlyTo", "agent": role, "to": spot.value, "height": (height or Metres(ASSUMED_M)).value}


def beside(spot: Spot, side: tuple[str, str], gap: Metres) -> str:
    """Return a spot so far to one side of a place."""
    return f"offset({spot.value}, {side[0]}={gap.m} m)"


def along(role: str, way: str, height: Metres) -> dict[str, Any]:
    """Return the step that flies along a way."""
    return {"do": "FlyAlong", "agent": role, "way": way, "height": height.value}


_MAKERS: Final[Mapping[str, Callable[[str, Mapping[str, Any]], Steps]]] = {
    "over": lambda r, v: [over(r, v["p"], v["h"])],
    "over_plain": lambda r, v: [over(r, v["p"], None)],
    "watch": lambda r, v: [over(r, v["p"], v["h"]), {"wait": v["t"].value}],
    "land": lambda r, v: [{"do": "FlyAndLand", "agent": r, "at": v["p"].value}],
    "stop": lambda r, v: [{"do": "FlyAndLand", "agent": r, "at": v["p"].value}, {"wait": v["t"].value}],
    "ring": lambda r, v: [along(r, f"circle({v['p'].value}, {v['r'].value})", v["h"])],
    "rings": lambda r, v: [
        {"repeat": v["n"].value, "steps": [along(r, f"circle({v['p'].value}, {v['r'].value})", v["h"])]}
    ],
    "zigzag": lambda r, v: [along(r, f"zigzag({v['p'].value}, {v['q'].value}, {v['w'].value}, {v['n']})", v["h"])],
    "line": lambda r, v: [along(r, f"line({v['p'].value}, {v['q'].value}, {v['n']})", v["h"])],
    "corners": lambda r, v: [along(r, f"triangle({v['p'].value}, {v['r'].value})", v["h"])],
    "explore": lambda r, v: [
        {"do": "FlyTo", "agent": r, "to": f"centroid({v['k'].value})", "height": v["h"].value},
        {"do": "Explore", "agent": r, "region": v["k"].value, "altitude": v["h"].value},
    ],
    "tour": lambda r, v: _tour(r, v["ps"], v["h"], v["t"]),
    "pass": lambda r, v: [along(r, _listed(v["ps"]), v["h"])],
    "shuttle": lambda r, v: [{"repeat": v["n"].value, "steps": [over(r, v["p"], v["h"]), over(r, v["q"], v["h"])]}],
    "guard": lambda r, v: [{"repeat": v["t"].value, "steps": [over(r, one, v["h"]) for one in v["ps"]]}],
    "recentre": lambda r, v: [over(r, v["p"], v["h"])],
    "land_end": lambda r, v: [{"do": "FlyAndLand", "agent": r, "at": v["p"].value}],
    "aside_land": lambda r, v: [{"do": "FlyAndLand", "agent": r, "at": beside(v["p"], v["side"], v["g"])}],
    "leave": lambda r, v: [{"do": "FlyAndLand", "agent": r, "at": v["p"].value}],
    "leave_aside": lambda r, v: [{"do": "FlyAndLand", "agent": r, "at": beside(v["p"], v["side"], v["g"])}],
    "wait": lambda _, v: [{"wait": v["t"].value}],
    "tell": lambda _, v: [{"notify": v["x"][0]}],
    "ask": lambda _, v: [{"ask": v["question"], "of": [v["who"]]}],
}


def _listed(spots: Sequence[Spot]) -> str:
    return "[" + ", ".join(one.value for one in spots) + "]"


def _tour(role: str, spots: Sequence[Spot], height: Metres, time: Time) -> Steps:
    return [step for one in spots for step in (over(role, one, height), {"wait": time.value})]


def steps_of(clause: Clause, role: str, last: Clause | None) -> Steps:
    """Return the steps of a part.

    Args:
        clause: the part.
        role: who does it.
        last: the last part that flew to a place; `stay` lands there.
    """
    if clause.kind in ("home", "home_own"):
        return [{"do": "ReturnHome", "agent": role}]
    if clause.kind == "stay":
        assert last is not None
        return [{"do": "FlyAndLand", "agent": role, "at": last.values["p"].value}]
    return _MAKERS[clause.kind.removesuffix("_plain") if clause.kind != "over_plain" else clause.kind](
        role, clause.values
    )
