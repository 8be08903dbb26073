"""Which class simulates an agent: one that is registered under a name of its type's line, else the one of its mobility.

A package registers its own under the entry point `formiga_bt.bodies`, by the name of a type of the catalogue:

    [project.entry-points."formiga_bt.bodies"]
    crane = "my_yard.bodies:Crane"          # a class that extends agents_sim.body.Body

It then serves that type and those that extend it, in every rehearsal and in `formiga sim`.
"""

import math
from collections.abc import Callable, Iterable
from importlib.metadata import EntryPoint, entry_points
from typing import Final, assert_never, get_args

from agents_sim.body import Body, Setup
from agents_sim.drone import Drone
from agents_sim.finder import Sight, sees_nothing
from agents_sim.limits import DroneLimits, MachineLimits, PersonLimits
from agents_sim.machine import Machine
from agents_sim.motion import BodyState, NoRecorder, PersonState, Recorder
from agents_sim.person import Person, read_rules
from agents_sim.planning import OnLinkLoss
from agents_sim.spec import AgentSpec, kind_of
from formiga_bt.base.clock import Scheduler
from formiga_bt.base.errors import FormigaError
from formiga_bt.base.machines import Mobility
from formiga_bt.transport.messages import AgentCard

GROUP: Final = "formiga_bt.bodies"


def registered(names: Iterable[str]) -> str:
    """Return the first of these names under which a body is registered, or ""."""
    known = entry_points(group=GROUP).names
    return next((name for name in names if name in known), "")


def check_spec(spec: AgentSpec) -> None:
    """Check what can be checked before anything starts.

    Raises:
        ValueError: the spec is wrong (type, limits, script, charge).
    """
    kind = kind_of(spec)
    match kind.mobility:
        case "people":
            PersonLimits().replaced(spec.limits)
            read_rules(spec.script)
            return
        case "air":
            DroneLimits().replaced(spec.limits)
        case "ground" | "fixed" | "none":
            MachineLimits().replaced(spec.limits)
        case never:
            assert_never(never)
    if not 0.0 <= spec.battery <= 100.0:
        raise ValueError(f"battery of {spec.id} must be 0..100, got {spec.battery!r}")
    if not 0.0 <= spec.payload_kg < math.inf:
        raise ValueError(f"payload_kg of {spec.id} must be 0 or more, got {spec.payload_kg!r}")
    if not all(math.isfinite(part) for part in spec.wind):
        raise ValueError(f"wind of {spec.id} must be two finite numbers in m/s, got {spec.wind!r}")
    if spec.on_link_loss not in get_args(OnLinkLoss):
        raise ValueError(f"on_link_loss of {spec.id} must be return, land or hold, got {spec.on_link_loss!r}")


def build_body(
    spec: AgentSpec,
    scheduler: Scheduler,
    *,
    recorder: Recorder | None = None,
    state: BodyState | PersonState | None = None,
    sight: Sight = sees_nothing,
) -> Body:
    """Return the body of an agent; `state` is how it was found, else it begins as the spec says.

    `sight` is where drones fly: what a person may see.

    Raises:
        ValueError: the spec is wrong (type, limits, script, charge).
        FormigaError: the body that is registered for its type cannot be used.
    """
    check_spec(spec)
    kind = kind_of(spec)
    told = recorder or NoRecorder()
    return build(Setup(spec=spec, kind=kind, scheduler=scheduler, recorder=told, state=state, sight=sight))


def build_card(spec: AgentSpec, body: Body, boot_id: str) -> AgentCard:
    """Return what the agent announces."""
    about = body.on_card()
    return AgentCard(
        id=spec.id, type=spec.type, boot_id=boot_id, actions=body.actions, mobility=body.kind.mobility, **about
    )


def build(setup: Setup) -> Body:
    """Return the body of an agent.

    Raises:
        FormigaError: the body that is registered for it cannot be used.
        ValueError: its spec is wrong.
    """
    name = setup.kind.body
    if not name:
        return _of_mobility(setup.kind.mobility)(setup)
    found = list(entry_points(group=GROUP, name=name))
    if not found:
        raise FormigaError(
            f"{setup.spec.id}: no body is registered under {GROUP} as '{name}'",
            help="install the package that has it into this environment",
        )
    return _made(found[0], setup)


def _of_mobility(mobility: Mobility) -> Callable[[Setup], Body]:
    match mobility:
        case "air":
            return Drone
        case "people":
            return Person
        case "ground" | "fixed" | "none":
            return Machine
        case never:
            assert_never(never)


def _made(entry: EntryPoint, setup: Setup) -> Body:
    what = f"{setup.spec.id}: the body '{entry.name}' ({entry.value})"
    try:
        maker = entry.load()
    except Exception as error:  # whatever somebody's module does while it is imported
        raise FormigaError(
            f"{what} cannot be loaded: {error!r}",
            help=f"correct the entry point {GROUP} of its package, or uninstall it",
        ) from error
    if not isinstance(maker, type) or not issubclass(maker, Body):
        raise FormigaError(f"{what} is no class that extends agents_sim.body.Body", help="register such a class")
    try:
        return maker(setup)
    except ValueError:
        raise
    except Exception as error:
        raise FormigaError(
            f"{what} cannot be made: {error!r}", help="its __init__ takes a Setup and nothing else"
        ) from error


def hover_drain_percent_s(spec: AgentSpec) -> float:
    """Return what hovering costs an agent, points of charge a second; 0 if it does not fly."""
    kind = kind_of(spec)
    return DroneLimits().of_type(kind.limits).replaced(spec.limits).hover_drain_pct_s if kind.mobility == "air" else 0.0
