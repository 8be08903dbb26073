"""What missions are made of: parts in a row; who takes part, and how it is called."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from msgspec import Struct

from experiments.e2_llm.train.kinds.clauses import Clause, Draw, Steps, steps_of
from experiments.e2_llm.train.phrases.parts import JOINS
from experiments.e2_llm.train.phrases.wide.talk import MORE_JOINS
from experiments.e2_llm.train.speaker import Speaker


class Mission(Struct, frozen=True):
    """What is asked for, its answer, and how it is said."""

    kind: str
    answer: dict[str, Any]
    """With the names of the flown world."""
    plan: str
    say: Callable[[Speaker], str]
    names: tuple[str, ...] = ()
    """Names in which nobody slips."""


class Machine(Struct, frozen=True):
    """A role of a machine, and how it is called."""

    role: str
    type: str
    en: tuple[str, ...]
    es: tuple[str, ...]
    id: str = ""

    @property
    def entry(self) -> dict[str, Any]:
        """Return it as it stands under agents."""
        return {"name": self.role, "type": self.type, **({"id": self.id} if self.id else {})}

    def said(self, speaker: Speaker) -> str:
        """Return it in words."""
        return str(speaker.of(self.es if speaker.language == "es" else self.en))


def machine(
    draw: Draw, role: str, of: str, *, by_id: bool = False, other: bool = False, plain: bool = False
) -> Machine:
    """Return a machine of a shipped type, `drone` = any; `plain`: its number is not said."""
    if of == "drone":
        return Machine(role, "drone", ("a drone", "any drone", "some drone"), ("un dron", "cualquier dron"))
    name, label, spanish = draw.at.kinds[of]
    if by_id:
        one = draw.rng.choice(draw.at.ids[of])
        return Machine(role, name, (one,), (one,), one)
    if other:
        return Machine(
            role, name, (f"another {label}", f"a second {label}", "the other one"), (f"otro {spanish}", "el otro")
        )
    short = name.upper() if len(name) == 3 else name
    a = "an" if label[0] in "aeiou" else "a"
    en = (
        f"{a} {label}",
        f"{a} {label}",
        f"{a} {label}" if plain else f"one {label}",
        f"{'an' if short[0] in 'LHaeiou' and len(name) == 3 else 'a'} {short}",
    )
    return Machine(role, name, en, (f"un {spanish}", f"un {spanish}", f"un {short}"))


class Person(Struct, frozen=True):
    """A role of a person."""

    role: str
    type: str
    said: tuple[str, str]
    id: str = ""

    @property
    def entry(self) -> dict[str, Any]:
        """Return it as it stands under agents."""
        return {"name": self.role, "type": self.type, **({"id": self.id} if self.id else {})}


def person(draw: Draw, of: str = "") -> Person:
    """Return a person of a shipped type, sometimes by id."""
    of = of or draw.rng.choice(("watcher", "watcher", "picker"))
    name, label, spanish = draw.at.kinds[of]
    if draw.rng.random() < 0.25:
        one = draw.rng.choice(draw.at.ids[of])
        return Person(name, name, (one, one), one)
    return Person(name, name, (f"the {label}", f"el {spanish}"))


def ask_clause(draw: Draw, who: Person) -> Clause:
    """Return the part in which a person must say yes."""
    question, en, es = draw.fact()
    return Clause("ask", {"question": question, "who": who.role, "u": who.said, "x": (en, es)})


def tree(task: str, agents: Sequence[Machine | Person], steps: Steps) -> dict[str, Any]:
    """Return an answer with a tree."""
    return {"tree": {"task": task, "agents": [one.entry for one in agents], "steps": steps}}


def chain(clauses: Sequence[Clause], role: str) -> Steps:
    """Return the steps of parts in a row."""
    found: Steps = []
    last = None
    for one in clauses:
        found += steps_of(one, role, last)
        if "p" in one.values:
            last = one
    return found


def joined(
    clauses: Sequence[Clause], speaker: Speaker, form: int, joins: Mapping[str, Sequence[tuple[str, str]]] | None = None
) -> str:
    """Return parts in a row in words.

    Args:
        clauses: the parts.
        speaker: who says them.
        form: of the verbs.
        joins: what stands between them; None = any.
    """
    parts = [one.said(speaker, form) for one in clauses]
    language = speaker.language
    between, final = speaker.of(joins[language]) if joins else speaker.of(JOINS[language], MORE_JOINS[language])
    return between.join(parts[:-1]) + final + parts[-1] if len(parts) > 1 else parts[0]


def told(clauses: Sequence[Clause], who: str) -> str:
    """Return parts in a row as a plan."""
    return f"{who} " + ", ".join(one.plan for one in clauses)


def names_of(clauses: Sequence[Clause]) -> tuple[str, ...]:
    """Return the names of the site in parts."""
    return tuple(name for one in clauses for name in one.names)


TASKS: Final = {
    "over": "LookAt",
    "over_plain": "LookAt",
    "watch": "WatchPlace",
    "land": "LandThere",
    "stop": "StopThere",
    "ring": "CirclePlace",
    "rings": "CirclePlace",
    "zigzag": "ZigzagSweep",
    "line": "FlyLine",
    "corners": "FlyTriangle",
    "explore": "ExploreRegion",
    "tour": "TourPlaces",
    "pass": "FlyPast",
    "shuttle": "BackAndForth",
    "guard": "GuardRound",
    "watch_plain": "WatchPlace",
    "ring_plain": "CirclePlace",
    "zigzag_plain": "ZigzagSweep",
    "line_plain": "FlyLine",
    "corners_plain": "FlyTriangle",
    "explore_plain": "ExploreRegion",
    "tour_plain": "TourPlaces",
    "pass_plain": "FlyPast",
    "aside_land": "LandBeside",
}
MAIN: Final = (
    "over",
    "over",
    "over_plain",
    "watch",
    "watch",
    "stop",
    "land",
    "ring",
    "rings",
    "zigzag",
    "line",
    "corners",
    "explore",
    "tour",
    "pass",
    "shuttle",
    "guard",
    "watch_plain",
    "ring_plain",
    "ring_plain",
    "zigzag_plain",
    "line_plain",
    "corners_plain",
    "explore_plain",
    "tour_plain",
    "pass_plain",
)
RINGS: Final = ("ring", "rings", "ring_plain")
ENDS: Final = ("zigzag", "line", "zigzag_plain", "line_plain")
"""They end somewhere else than they begin."""
SIDES: Final = (("north", "norte"), ("south", "sur"), ("east", "este"), ("west", "oeste"))


def parts(draw: Draw, machine_type: str, most: int, *, kinds: Sequence[str] = MAIN) -> list[Clause]:
    """Return flights of one machine without an end; what only some can do is left to those."""
    able = [kind for kind in kinds if not kind.startswith("explore") or machine_type == "lwd"]
    found = [draw.clause(draw.rng.choice(able)) for _ in range(draw.rng.randint(1, most))]
    if len(found) > 1:
        found = [
            one if one.kind != "guard" or i == len(found) - 1 else draw.clause("over") for i, one in enumerate(found)
        ]
    at = next((i for i, one in enumerate(found) if one.kind in RINGS), -1)
    if at >= 0 and len(kinds) > 8 and draw.rng.random() < 0.6:
        ring = found[at].values
        found.insert(at + 1, Clause("recentre", {"p": ring["p"], "h": ring["h"]}))
    return found


def ended(draw: Draw, clauses: list[Clause]) -> list[Clause]:
    """Return flights with an end: home, or on the ground where they end."""
    last = clauses[-1]
    dice = draw.rng.random()
    if last.kind == "land":  # to take off again at once would be for nothing
        return clauses
    if last.kind in ENDS and dice < 0.45:
        return [*clauses, Clause("land_end", {"p": last.values["q"]})]
    if last.kind in RINGS and dice < 0.3 and "(" not in last.values["p"].value:
        values = {"p": last.values["p"], "side": draw.rng.choice(SIDES), "g": last.values["r"]}
        return [*clauses, Clause("aside_land", values)]
    if dice < 0.2 and last.kind in ("over", "over_plain", "watch", "watch_plain", "recentre"):
        return [*clauses, draw.clause("stay")]
    return [*clauses, draw.clause("home")]


def third(speaker: Speaker, who: Machine, clauses: Sequence[Clause]) -> str:
    """Return what a machine does, in words: `a light drone flies ...`."""
    return f"{who.said(speaker)} {joined(clauses, speaker, 1 if speaker.language == 'en' else 0)}"
