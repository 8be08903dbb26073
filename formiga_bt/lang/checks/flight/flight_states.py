"""What may be in the air: sets of states per machine, how they meet, and what a condition says about them.

The data of `flight`, which moves them through a task's steps.
"""

import re
from collections.abc import Iterable, Mapping
from pathlib import PurePath
from typing import Final, Literal

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model import Expr, Role
from formiga_bt.lang.types import ANY

Air = Literal["grounded", "airborne", "unknown"]


class Why(Struct, frozen=True):
    """How a state came about: the path in words, the step that led to it, and the step that failed, if one did."""

    path: str
    mark: Mark
    failed: Mark | None = None


States = Mapping[Air, Why]
Sky = Mapping[str, States]
"""By machine: a role, `drones[0]` of a role with a count, `drones[*]` of a long list or one of unknown length. None in place
of a sky = no path leads here."""


class Outcomes(Struct, frozen=True):
    """What a step leaves behind when it succeeds, fails, or is skipped."""

    success: Sky | None
    failure: Sky | None
    skipped: Sky | None = None
    midway: Sky | None = None
    """Of a loop: where it may be stopped between two rounds."""


class InterpreterPlace(Struct, frozen=True):
    """Where the interpreter is: how to report, and what local names are called outside."""

    file: str
    silent: bool = False
    lenient: bool = False
    """Unknown is fine; only sure contradictions are reported."""
    sure: bool = False
    """Only what is so on every path that leads here is reported."""
    call: Mark | None = None
    """The outermost call that led here."""
    called: str = ""
    first: Mark | None = None
    """The first order of what was called there."""
    both: str = ""
    """Two names that are one machine here, in words."""
    outer: Mapping[str, str] | None = None

    def __hash__(self) -> int:
        """Return a hash that leaves out the names outside."""
        return hash((self.file, self.silent, self.lenient, self.sure, self.call, self.called, self.first, self.both))


class ReachedStates(Struct, frozen=True):
    """Where steps have led to, when conditions turned out so."""

    assumed: Mapping[int, bool]
    at: Sky | None
    idle: Sky | None
    """If none of them did anything."""


_MOST_APART: Final = 8
"""A longer list is followed as a whole."""


def keys_of(role: Role) -> tuple[str, ...]:
    """Return the keys of a role's machines in a sky."""
    if not role.is_list:
        return (role.name,)
    if role.count is None or role.count > _MOST_APART:
        return (f"{role.name}[*]",)
    return tuple(f"{role.name}[{index}]" for index in range(role.count))


def start(role: Role) -> States:
    """Return the states of a role's machine before the first step."""
    if not role.away:
        return {"grounded": Why("", role.mark)}
    why = Why(f"as role '{role.name}' says away: true", role.mark)
    return {"grounded": why, "airborne": why}


def line_of(mark: Mark, here: InterpreterPlace) -> str:
    """Return the line of a mark in words, with its file if that is another one."""
    return f"{mark.said}" if mark.file == here.file else f"{mark.said} of {PurePath(mark.file).name}"


def failing(sky: Sky | None, mark: Mark, here: InterpreterPlace, how: str = "failed") -> Sky | None:
    """Return the sky after a step failed (or what else it did, in words), with that as the reason of every state."""
    if sky is None:
        return None
    path = f"when {line_of(mark, here)} {how}"
    return {
        role: {state: Why(path, why.mark, here.call or mark) for state, why in states.items()}
        for role, states in sky.items()
    }


def because(sky: Sky | None, path: str) -> Sky | None:
    """Return a sky in which the states that have no reason have this one."""
    if sky is None:
        return None
    return {
        name: {state: why if why.path else replace(why, path=path) for state, why in states.items()}
        for name, states in sky.items()
    }


def without(sky: Sky | None, own: Sky) -> Sky | None:
    """Return a sky without the machines of a block that has ended."""
    return None if sky is None else {key: states for key, states in sky.items() if key not in own}


def merge(these: Iterable[States]) -> States:
    """Return the states of any of several machines."""
    merged: dict[Air, Why] = {}
    for states in these:
        for state, why in states.items():
            merged.setdefault(state, why)
    return merged


def same(one: Sky, other: Sky) -> bool:
    """Return whether two skies have the same states, whatever their reasons."""
    return all(states.keys() == other[name].keys() for name, states in one.items())


def signature(sky: Sky) -> tuple[object, ...]:
    """Return the states of a sky without their reasons, as a key."""
    return tuple((name, *states) for name, states in sky.items())


def join(left: Sky | None, right: Sky | None, only_left: str = "", only_right: str = "") -> Sky | None:
    """Return the states of either path; `only_left` and `only_right` name the path of a state that only one side has."""
    if left is None or right is None:
        return left if right is None else right
    joined: dict[str, States] = {}
    for role in left:
        merged: dict[Air, Why] = {}
        for state, why in left[role].items():
            merged[state] = replace(why, path=only_left) if only_left and state not in right[role] else why
        for state, why in right[role].items():
            if state not in merged:
                merged[state] = replace(why, path=only_right) if only_right else why
        joined[role] = merged
    return joined


# --- conditions --------------------------------------------------------------------------------------------------

_AIRBORNE: Final = re.compile(r"(?:(not)\s+)?\(?\s*([A-Za-z]\w*)\.airborne\s*\)?")


def narrow(sky: Sky, cond: Expr, holds: bool) -> Sky | None:
    """Return the sky where a condition holds (or does not); None if it never does.

    Understood: `x.airborne`, `not x.airborne`, joined by `and` (when it holds) or by `or` (when it does not).
    """
    if cond.type == ANY:  # refused already: taken to hold, so that nothing else complains
        return sky if holds else None
    if cond.is_const:
        return sky if bool(cond.const) == holds else None
    narrowed = dict(sky)
    for role, airborne in _facts(cond.source, holds):
        if role not in narrowed:
            continue
        want: Air = "airborne" if airborne else "grounded"
        states = {state: why for state, why in narrowed[role].items() if state == want}
        unknown = narrowed[role].get("unknown")
        if not states and unknown is not None:
            states = {want: replace(unknown, path="")}
        if not states:
            return None
        narrowed[role] = states
    return narrowed


def _facts(source: str, holds: bool) -> list[tuple[str, bool]]:
    """Return (role, airborne) for each part of a condition that must hold, or must fail, for the whole to do so."""
    joint = "and" if holds else "or"
    parts = re.split(rf"\b{joint}\b", source)
    other = "or" if holds else "and"
    if re.search(rf"\b({other}|if|else)\b", source):
        return []
    found = []
    for part in parts:
        match = _AIRBORNE.fullmatch(part.strip())
        if match is not None:
            found.append((match[2], (match[1] is None) == holds))
    return found
