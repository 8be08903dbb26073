"""Which wires there are, what may be said of each under `transports:` of a site file, and what each guarantees.

A package brings a wire of its own under the entry point `formiga_bt.wires`, by the name that site files call it:

    [project.entry-points."formiga_bt.wires"]
    mqtt = "my_mqtt.wire:KIND"              # a WireKind

Called by the checker of site files, which opens nothing, and by the host of an engine, which makes the wires.
"""

from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from importlib.metadata import entry_points
from types import MappingProxyType
from typing import Any, Final, Literal, get_args

from msgspec import Struct

from formiga_bt.base.endpoints import open_to_others
from formiga_bt.base.errors import FormigaError

GROUP: Final = "formiga_bt.wires"

Guarantee = Literal["goal_memory", "epoch", "expiry", "clearance", "link_silence", "cancel_confirmed", "update"]
"""What an agent on a wire does, and the engine may rely on."""

GUARANTEES: Final[tuple[Guarantee, ...]] = get_args(Guarantee)
MEANINGS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "goal_memory": "a goal that is sent again is not begun again, and its end can be asked for",
        "epoch": "goals of an engine that was replaced are refused",
        "expiry": "a goal that comes too late is refused",
        "clearance": "a goal carries who said that people stand clear, and when",
        "link_silence": "a machine in the air acts by itself when it hears no engine",
        "cancel_confirmed": "a cancel is answered, and so is its end",
        "update": "the fields of a goal that runs can be changed",
    }
)


class WireOption(Struct, frozen=True):
    """An option of a wire in a site file."""

    name: str
    help: str
    form: Literal["text", "flag"] = "text"


class WireSetup(Struct, frozen=True):
    """What a wire is made of."""

    site: str
    """The site's name."""
    options: Mapping[str, str | bool]
    """What the site file says of it, as far as it does; `--listen` counts as `listen`, `--keys` as `keys`, an absolute path."""


class WireKind(Struct, frozen=True):
    """A wire that site files can name."""

    name: str
    summary: str
    guarantees: tuple[Guarantee, ...]
    make: str
    """`module:function`: it takes a `WireSetup` and returns an `AgentTransport` that is not open yet."""
    options: tuple[WireOption, ...] = ()
    check: Callable[[Mapping[str, str | bool], str], Iterable[tuple[str, str, str]]] | None = None
    """Takes the options and the site's mode; returns (option, what is wrong, what helps) for each mistake."""

    @property
    def lacks(self) -> tuple[Guarantee, ...]:
        """Return what it does not guarantee."""
        return missing(self.guarantees)


def missing(given: Iterable[str]) -> tuple[Guarantee, ...]:
    """Return the guarantees that are not among these."""
    known = frozenset(given)
    return tuple(one for one in GUARANTEES if one not in known)


def unaccepted(lacks: Iterable[str], accepted: Iterable[str]) -> tuple[str, ...]:
    """Return what a wire lacks that a site has not accepted by name."""
    known = frozenset(accepted)
    return tuple(one for one in lacks if one not in known)


def _check_zenoh(options: Mapping[str, str | bool], mode: str) -> Iterable[tuple[str, str, str]]:
    insecure = options.get("insecure") is True
    if insecure and mode == "real":
        what = "'insecure' is for simulations: whoever reaches the wire can command every machine"
        yield "insecure", what, "remove it, and listen at tcp/127.0.0.1:PORT, or by TLS with keys"
    if insecure and "keys" in options:
        yield "insecure", "'insecure' says nothing of a wire with keys", "remove it"
    if "listen" in options:
        why, help_ = open_to_others(str(options["listen"]), mode, insecure=insecure, keys="keys" in options)
        if why:
            yield "listen", why, help_


ZENOH: Final = WireKind(
    name="zenoh",
    summary="Agents in processes of their own: {listen, keys}.",
    guarantees=GUARANTEES,
    make="formiga_bt.transport.zenoh:make",
    options=(
        WireOption("listen", "Where agents connect, such as tcp/127.0.0.1:7447."),
        WireOption("keys", "The site's folder of keys, such as .formiga/NAME/keys: TLS, by formiga router."),
        WireOption("insecure", "In a simulation: others reach it without TLS.", "flag"),
    ),
    check=_check_zenoh,
)
"""The wire that ships; the one of a site that names none."""


def wire_names() -> tuple[str, ...]:
    """Return the names of all wires that are installed; those of packages are not loaded for it."""
    return tuple(dict.fromkeys((ZENOH.name, *sorted(entry_points(group=GROUP).names))))


def wire_kind(name: str) -> WireKind:
    """Return a wire by its name.

    Raises:
        FormigaError: none is installed under it, or its package cannot be used.
    """
    if name == ZENOH.name:
        return ZENOH
    found = list(entry_points(group=GROUP, name=name))
    if not found:
        raise FormigaError(
            f"no wire is called '{name}'", help=f"wires: {', '.join(wire_names())}; or install the package that has it"
        )
    what, help_ = f"the wire '{name}' ({found[0].value})", f"correct the entry point {GROUP} of its package"
    try:
        kind = found[0].load()
    except Exception as error:  # whatever somebody's module does while it is imported
        raise FormigaError(f"{what} cannot be loaded: {error!r}", help=help_) from error
    if not isinstance(kind, WireKind):
        raise FormigaError(f"{what} is no formiga_bt.base.wires.WireKind", help=help_)
    if kind.name != name:
        raise FormigaError(f"{what} calls itself '{kind.name}'", help=help_)
    if unknown := [one for one in kind.guarantees if one not in GUARANTEES]:
        raise FormigaError(f"{what} declares '{unknown[0]}'", help=f"guarantees: {', '.join(GUARANTEES)}")
    return kind


def make_wire(kind: WireKind, setup: WireSetup) -> Any:
    """Return the transport of a wire (an `AgentTransport`), not open yet.

    Raises:
        FormigaError: it cannot be made, or is another wire than its kind says.
    """
    module, _, function = kind.make.partition(":")
    try:
        made = getattr(import_module(module), function)(setup)
    except FormigaError:
        raise
    except Exception as error:
        what = f"the wire '{kind.name}' ({kind.make}) cannot be made: {error!r}"
        raise FormigaError(what, help="its function takes a WireSetup and nothing else") from error
    given = getattr(made, "guarantees", None)
    if getattr(made, "name", None) != kind.name or given is None or missing(given) != kind.lacks:
        raise FormigaError(
            f"the wire '{kind.name}' ({kind.make}) is another than its kind says: name and guarantees must be equal",
            help=f"correct the entry point {GROUP} of its package",
        )
    return made
