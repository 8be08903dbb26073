"""The envelope: limits that no flight may break, as a type, a site and a task write them, and what follows a breach.

One table of limits with the direction in which each is stricter. A site and a task only tighten: the strictest of the
three counts, whatever is written. Called by the readers of catalogues, sites and task files.
"""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Final, Literal

from msgspec import Struct

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.units import format_quantity
from formiga_bt.lang.keyed import read_keys
from formiga_bt.lang.kinds import ENVELOPE, Option
from formiga_bt.lang.model import AgentType
from formiga_bt.lang.text.document import Node
from formiga_bt.lang.text.reading import (
    Problems,
    fix_word,
    quoted_list,
    read_flag,
    read_mapping,
    read_quantity,
    read_word,
)
from formiga_bt.lang.text.synonyms import nearest, surely

STRICTER: Final[Mapping[str, Literal["more", "less"]]] = MappingProxyType(
    {
        "reserve": "more",
        "max_height": "less",
        "terrain_clearance": "more",
        "people_clearance": "more",
        "link_silence": "less",
        "wind_max": "less",
        "daylight_only": "more",
        "max_speed": "less",
    }
)
"""Whether more or less of a limit is stricter."""

BREACHES: Final = ("reserve", "max_height", "terrain_clearance", "keep_in", "keep_out", "wind_max", "daylight_only")
"""Limits whose breach in flight has a reaction."""

REACTIONS: Final = ("return", "hold")

ABOVE_ZERO: Final = ("max_height", "wind_max", "link_silence", "max_speed")
"""Limits that are never 0."""

MOST_RESERVE: Final = 90.0
"""Percent; with a larger reserve no flight would begin."""

_SUFFIX: Final[Mapping[str, str]] = MappingProxyType(
    {"reserve": "pct", "wind_max": "m_s", "max_speed": "m_s", "link_silence": "s", "daylight_only": ""}
)
_KINDS: Final = MappingProxyType({option.name: option.type for option in ENVELOPE})


class Limit(Struct, frozen=True):
    """One limit as it is written: its name, its value (SI, percent 0..100, a flag 0 or 1) and the place of the value."""

    name: str
    value: float
    mark: Mark

    @property
    def key(self) -> str:
        """Return its name in `AgentType.limits`: `max_height_m`."""
        return key_of(self.name)

    @property
    def shown(self) -> str:
        """Return the value as authors write it."""
        return show(self.name, self.value)

    def looser_than(self, other: float) -> bool:
        """Return whether the value allows more than `other` does."""
        return self.value < other if STRICTER[self.name] == "more" else self.value > other


def key_of(name: str) -> str:
    """Return the name of a limit in `AgentType.limits`, which has its unit in it."""
    suffix = _SUFFIX.get(name, "m")
    return f"{name}_{suffix}" if suffix else name


def show(name: str, value: float) -> str:
    """Write the value of a limit as authors do: `25 %`, `120 m`, `true`."""
    kind = _KINDS[name]
    return format_quantity(kind, value) if kind else ("true" if value else "false")


def strictest(name: str, values: Iterable[float]) -> float | None:
    """Return the strictest of several values of one limit; None of none."""
    known = list(values)
    if not known:
        return None
    return max(known) if STRICTER[name] == "more" else min(known)


def read_envelope(node: Node, problems: Problems) -> dict[str, Limit]:
    """Read an `envelope:`; its words (`keep_in: fence`) are the same for all and only checked.

    Returns:
        The limits by name, without those that are wrong (reported).
    """
    mapping = read_mapping(node, problems, "envelope")
    given = read_keys(mapping, ENVELOPE, problems, "an envelope") if mapping is not None else {}
    found: dict[str, Limit] = {}
    for option in ENVELOPE:
        at = given[option.name].value if option.name in given else None
        if at is None:
            continue
        value: float | None = None
        if option.form == "word":
            read_word(at, problems, option.name, option.values)
        elif option.form == "flag":
            value = float(read_flag(at, problems, option.name))
        else:
            value = _in_range(option, at, problems)
        if value is not None:
            found[option.name] = Limit(option.name, value, at.mark)
    _check_room(found, problems)
    return found


def _in_range(option: Option, at: Node, problems: Problems) -> float | None:
    value = read_quantity(at, problems, option.name, option.type)
    if value is None:
        return None
    if option.name == "reserve" and not 0 <= value < MOST_RESERVE:
        help_ = "percent is 0 to 100; a quarter of the charge is usual: 25 %"
        problems.add("E062", at.mark, f"'reserve' must lie between 0 % and {MOST_RESERVE:g} %", help_)
        return None
    if value < 0 or (value == 0 and option.name in ABOVE_ZERO):
        least = "above" if option.name in ABOVE_ZERO else "at least"
        problems.add("E062", at.mark, f"'{option.name}' must be {least} {format_quantity(option.type, 0.0)}")
        return None
    return value


def _check_room(found: Mapping[str, Limit], problems: Problems) -> None:
    """Report E061 where no height is left between the ground's clearance and the greatest height."""
    top, bottom = found.get("max_height"), found.get("terrain_clearance")
    if top is not None and bottom is not None and top.value <= bottom.value:
        what = f"max_height {top.shown} is not above terrain_clearance {bottom.shown}: no height is left to fly at"
        problems.add("E061", top.mark, what, "raise max_height, or lower terrain_clearance")


def read_on_breach(node: Node, problems: Problems) -> dict[str, str]:
    """Read an `on_breach:`, limits and what a machine does that breaks one: `return` or `hold`."""
    mapping = read_mapping(node, problems, "on_breach")
    found: dict[str, str] = {}
    for entry in mapping.entries if mapping is not None else ():
        name = entry.key.text
        if name not in BREACHES:
            meant = nearest(name, BREACHES)
            guess = f"; did you mean '{meant}'?" if meant else ""
            what = f"'{name}' is no limit whose breach has a reaction{guess}"
            problems.add(
                "E004",
                entry.key.mark,
                what,
                f"limits: {quoted_list(BREACHES)}",
                fix_word(entry.key, surely(name, BREACHES)),
            )
            continue
        word = read_word(entry.value, problems, name, REACTIONS)
        if word:
            found[name] = word
    return found


def check_site(limits: Mapping[str, Limit], types: Iterable[AgentType], problems: Problems) -> None:
    """Report W081 for a limit of a site that allows more than all its machines' types do: it changes nothing."""
    known = list(types)
    for limit in limits.values():
        theirs = {one.name: one.limits[limit.key] for one in known if limit.key in one.limits}
        if theirs and len(theirs) == len(known) and all(limit.looser_than(other) for other in theirs.values()):
            what = f"{limit.name} {limit.shown} allows more than {_whose(limit, theirs)}"
            help_ = "the stricter one is kept; tighten it here, or leave it out"
            problems.add("W081", limit.mark, what, help_)


def check_task(
    limits: Mapping[str, Limit], types: Iterable[AgentType], site: Mapping[str, float], problems: Problems
) -> None:
    """Report E080 for a limit of a task that allows more than the types of its machines, or the site, do."""
    known = list(types)
    for limit in limits.values():
        ours = site.get(limit.key)
        theirs = {one.name: one.limits[limit.key] for one in known if limit.key in one.limits}
        help_ = "a task may only tighten; leave it out, or make it stricter"
        if ours is not None and limit.looser_than(ours):
            what = f"{limit.name} {limit.shown} allows more than {_said(limit.name, ours)} of the site"
            problems.add("E080", limit.mark, what, help_)
        elif theirs and len(theirs) == len(known) and all(limit.looser_than(other) for other in theirs.values()):
            what = f"{limit.name} {limit.shown} allows more than {_whose(limit, theirs)}"
            problems.add("E080", limit.mark, what, help_)


def _whose(limit: Limit, theirs: Mapping[str, float]) -> str:
    """Return the loosest of the types' limits with its owners: `the 120 m of hwd and lwd`."""
    loosest = min(theirs.values()) if STRICTER[limit.name] == "more" else max(theirs.values())
    owners = sorted(name for name, value in theirs.items() if value == loosest)
    most = ", ".join(owners[:-1])
    return f"{_said(limit.name, loosest)} of {f'{most} and ' if most else ''}{owners[-1]}"


def _said(name: str, value: float) -> str:
    return f"the {show(name, value)}" if _KINDS[name] else f"'{show(name, value)}'"


def ceiling(
    name: str, agent_type: AgentType, site: Mapping[str, float], task: Mapping[str, float]
) -> tuple[float, str]:
    """Return the strictest value of a limit for a type, and whose it is: `lwd`, `this site`, `this task`; inf = none."""
    key = key_of(name)
    owners = ((agent_type.limits, agent_type.name), (site, "this site"), (task, "this task"))
    known = [(limits[key], owner) for limits, owner in owners if key in limits]
    return min(known, key=lambda one: one[0]) if known else (float("inf"), "")
