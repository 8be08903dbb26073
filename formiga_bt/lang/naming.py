"""Names of a catalogue for hints: what a site's own types and actions are called, so that a hint can be written as it stands.

Called where a message would else need an example: it names no type and no action by itself.
"""

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from formiga_bt.base.asking import CONFIRM
from formiga_bt.lang.model import ActionSpec, Catalogue

if TYPE_CHECKING:
    from formiga_bt.lang.body import Body


def a_type(catalogue: Catalogue) -> str:
    """Return a type that a role may be of: a machine that no other type extends, else the first one there is."""
    extended = {name for one in catalogue.types.values() for name in one.extends}
    machines = [one.name for one in catalogue.types.values() if not one.human and one.name not in extended]
    return next(iter([*machines, *catalogue.types]), "TYPE")


def an_order(body: "Body") -> str:
    """Return a step that orders an action of the first role of a body, or of a role such as there is none yet."""
    catalogue = body.world.catalogue
    roles = {name: types for name, types in body.agents.items() if name in body.names}
    for role, types in [*roles.items(), ("role", ())]:
        action = action_that(lambda spec: spec.name != CONFIRM, types or (a_type(catalogue),), catalogue)
        if action:
            return f"do: {role}.{action}"
    return "do: role.Action"


def actions_of(types: Iterable[str], catalogue: Catalogue) -> Iterable[ActionSpec]:
    """Return the actions of types, in their order."""
    known = [catalogue.types[name] for name in types if name in catalogue.types]
    names = dict.fromkeys(action for one in known for action in one.actions)
    return [catalogue.actions[name] for name in names if name in catalogue.actions]


def action_that(does: Callable[[ActionSpec], bool], types: Iterable[str], catalogue: Catalogue) -> str:
    """Return the first action of types that does something, or ""; a person's action never."""
    return next((spec.name for spec in actions_of(types, catalogue) if does(spec) and not spec.cuts), "")


def takes_off(spec: ActionSpec) -> bool:
    """Return whether an action brings a machine into the air."""
    return spec.effect == "airborne"


def comes_down(spec: ActionSpec) -> bool:
    """Return whether an action brings a machine to the ground."""
    return spec.effect == "grounded"
