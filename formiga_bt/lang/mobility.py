"""What a type of an agent may say, by how it moves: one table of rests, and what belongs to flight alone (E103).

Called by the reader of catalogues for each type, with its own keys and what it takes over already merged in.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from formiga_bt.base.machines import MACHINES, Mobility
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.model import ActionSpec, AgentType
from formiga_bt.lang.model.world import Rest
from formiga_bt.lang.text.document import Entry, Listing, Mapping_, Scalar
from formiga_bt.lang.text.reading import Problems, quoted_list

RESTS: Final[Mapping[Mobility, tuple[Rest, ...]]] = MappingProxyType(
    {
        "air": ("grounded_at_port",),
        "ground": ("parked", "docked", "anywhere"),
        "fixed": (),
        "none": (),
        "people": (),
    }
)
"""Where an agent may belong when idle."""

EVERY_REST: Final = tuple(dict.fromkeys(rest for rests in RESTS.values() for rest in rests))

_FLIGHT: Final = ("max_height", "terrain_clearance", "people_clearance", "wind_max", "daylight_only")
"""Limits that only what flies can break."""

_OUT: Final[Mapping[Mobility, str]] = MappingProxyType({"air": "no_fly", "ground": "no_go"})
"""What `keep_out` says."""

_WAYS: Final[Mapping[Mobility, tuple[str, ...]]] = MappingProxyType(
    {"air": ("recover", "fetch", "land"), "ground": ("recover",)}
)
"""Which subtrees of a type have a meaning."""


def check_mobility(
    one: AgentType, keys: Keys, said: str, actions: Mapping[str, ActionSpec], name: Entry, problems: Problems
) -> None:
    """Report what a type says that its mobility has no meaning for.

    Args:
        one: the type, with what it extends merged in.
        keys: its own.
        said: the mobility that what it extends says; "" = nothing does.
        actions: of the catalogue.
        name: where the type begins.
        problems: where to report.
    """
    if "mobility" not in keys and "human" not in keys and not said:
        if "extends" in keys:
            return  # what it extends is reported
        help_ = f"add mobility: with one of {', '.join(MACHINES)}; of a person say human: true"
        problems.add("E008", name.key.mark, f"type '{one.name}' does not say how it moves", help_)
        return
    if one.human and "mobility" in keys:
        problems.add(
            "E103", keys.mark("mobility"), f"'{one.name}' is a person, who moves without orders", "take it out"
        )
        return
    if said and one.mobility != said:
        at = keys.mark("mobility" if "mobility" in keys else "human")
        what = f"'{one.name}' is of mobility {one.mobility}, what it extends of {said}"
        problems.add("E103", at, what, "a type moves as the one that it extends; take extends out")
        return
    moves = f"mobility is {one.mobility}"
    if "rest" in keys and one.rest and one.rest not in RESTS[one.mobility]:
        known = RESTS[one.mobility]
        help_ = f"one of {quoted_list(known)}" if known else "take it out: it has no place to go to"
        problems.add("E103", keys.mark("rest"), f"'{one.name}' cannot rest {one.rest}: its {moves}", help_)
    if one.rest == "docked" and not one.recover_ref:
        help_ = "add recover: such as lib/driving.yaml#Park"
        problems.add(
            "E008",
            keys.mark("rest") if "rest" in keys else name.key.mark,
            f"'{one.name}' is docked, and nothing brings it there",
            help_,
        )
    for key in ("recover", "fetch", "land"):
        if key in keys and key not in _WAYS.get(one.mobility, ()):
            problems.add("E103", keys.mark(key), f"'{one.name}' has no use for {key}: its {moves}", "take it out")
    _check_envelope(one, keys, moves, problems)
    _check_actions(one, keys, actions, moves, problems)


def _check_envelope(one: AgentType, keys: Keys, moves: str, problems: Problems) -> None:
    node = keys["envelope"].value if "envelope" in keys else None
    for entry in node.entries if isinstance(node, Mapping_) else ():
        limit, value = entry.key.text, entry.value
        if limit in _FLIGHT and one.mobility != "air":
            what = f"'{limit}' is a limit of flight; '{one.name}' never flies: its {moves}"
            problems.add("E103", entry.key.mark, what, "take it out")
        if limit == "max_speed" and one.mobility != "ground":
            what = f"'{limit}' is a limit of driving; '{one.name}' does not drive: its {moves}"
            problems.add("E103", entry.key.mark, what, "take it out")
        out = _OUT.get(one.mobility, "")
        if limit == "keep_out" and isinstance(value, Scalar) and value.text in _OUT.values() and value.text != out:
            help_ = f"keep_out: {out}" if out else "take it out"
            problems.add("E103", value.mark, f"{value.text} does not bind '{one.name}': its {moves}", help_)


def _check_actions(
    one: AgentType, keys: Keys, actions: Mapping[str, ActionSpec], moves: str, problems: Problems
) -> None:
    if one.mobility == "air":
        return
    node = keys["actions"].value if "actions" in keys else None
    for at in node.items if isinstance(node, Listing) else ():
        spec = actions.get(at.text) if isinstance(at, Scalar) else None
        if spec is not None and (spec.requires or spec.effect or spec.starts_rotors or spec.lands or spec.cuts):
            what = f"{spec.name} is an action of flight; '{one.name}' never flies: its {moves}"
            problems.add(
                "E103", at.mark, what, "requires, effect airborne, starts_rotors, lands and cuts are of what flies"
            )
