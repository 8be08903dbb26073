"""What tasks are checked against: the catalogue of agent types and actions, and the site."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Literal

from msgspec import Struct, field

from formiga_bt.base.clock import Micros
from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place
from formiga_bt.base.machines import Mobility
from formiga_bt.base.routes import Routes
from formiga_bt.lang.model.expr import Expr
from formiga_bt.lang.model.news import Channel
from formiga_bt.lang.model.rules import Rule
from formiga_bt.lang.model.steps import Subtree
from formiga_bt.lang.types import Type


class FieldSpec(Struct, frozen=True):
    """A field of an action."""

    name: str
    type: Type
    optional: bool = False
    default: Expr | None = None
    """May read `agent.<field>`: the agent that gets the goal."""
    min: float | None = None
    max: float | None = None
    """In the type's SI unit."""
    help: str = ""


HEIGHTS: Final = ("altitude", "height")
"""What fields of actions are called that are heights over the ground."""


class ActionSpec(Struct, frozen=True):
    """An action of the catalogue."""

    name: str
    mark: Mark
    fields: Mapping[str, FieldSpec] = field(default_factory=dict)
    result: Mapping[str, Type] = field(default_factory=dict)
    result_min: Mapping[str, float] = field(default_factory=dict)
    """The least number of a field of the result, in the type's SI unit, where one is said."""
    requires: Literal["", "airborne", "grounded"] = ""
    effect: Literal["", "airborne", "grounded"] = ""
    moves_to: str = ""
    """The field that says where the agent will be (a place or position)."""
    starts_rotors: bool = False
    lands: bool = False
    repeatable: bool = False
    typical_us: Micros = 60_000_000
    accept_timeout_us: Micros = 5_000_000
    cancel_grace_us: Micros = 30_000_000
    concurrency: int = 1
    cuts: bool = False
    """It stops the motors at once, also in the air: only for a person's order `cut`, never for a tree."""
    help: str = ""

    @property
    def height(self) -> str:
        """Return the field that says how high over the ground it flies, or "": of what takes off its one distance, too."""
        lengths = self._of_type("distance")
        named = [name for name in lengths if name in HEIGHTS]
        return next(iter(named or (lengths if self.effect == "airborne" and len(lengths) == 1 else [])), "")

    @property
    def speed(self) -> str:
        """Return the field that says how fast it goes, or ""."""
        speeds = self._of_type("speed")
        return "speed" if "speed" in speeds else speeds[0] if len(speeds) == 1 else ""

    def _of_type(self, name: str) -> list[str]:
        return [field.name for field in self.fields.values() if field.type.name == name]


Rest = Literal["", "grounded_at_port", "parked", "docked", "anywhere"]
"""Where a machine belongs when idle."""


class AgentType(Struct, frozen=True):
    """An agent type of the catalogue, with what it extends already merged in."""

    name: str
    mark: Mark
    label: str = ""
    actions: tuple[str, ...] = ()
    extends: tuple[str, ...] = ()
    """All ancestors, nearest first."""
    mobility: Mobility = "air"
    """How it moves; what it extends says it, if it does not itself."""
    rest: Rest = ""
    """Where it belongs when idle: at a port (air); anywhere legal, or at a station (ground)."""
    recover: Subtree | None = None
    """A subtree with one agent param; None = this type needs or has no way home."""
    recover_ref: str = ""
    fetch: Subtree | None = None
    """A subtree with one agent param that brings it home from the ground elsewhere (order `return`)."""
    fetch_ref: str = ""
    land: Subtree | None = None
    """A subtree with an agent and a place param that lands it there (order `land`)."""
    land_ref: str = ""
    events: Mapping[str, Mapping[str, Type]] = field(default_factory=dict)
    """What it tells of itself, apart from any goal: event -> its fields."""
    fields: Mapping[str, Type] = field(default_factory=dict)
    """What its statuses say besides, by name: read as `door.open`."""
    shared: bool = False
    """Several tasks may address it at once, and none holds it: people, and what says so."""
    limits: Mapping[str, float] = field(default_factory=dict)
    """SI by name, envelope included: speed_m_s, climb_m_s, hover_drain_pct_s, reserve_pct, max_height_m, ..."""
    on_breach: Mapping[str, str] = field(default_factory=dict)
    """Limit of the envelope (reserve, max_height, keep_in, keep_out, ...) -> return or hold."""
    suspect_after_us: Micros = 3_000_000
    lost_after_us: Micros = 30_000_000

    @property
    def human(self) -> bool:
        """Return whether it is a person."""
        return self.mobility == "people"

    @property
    def flies(self) -> bool:
        """Return whether the rules of flight hold for it."""
        return self.mobility == "air"

    def way(self, name: Literal["recover", "fetch", "land"]) -> Subtree | None:
        """Return the subtree of a way home, if it has one; what drives is fetched by its recover."""
        match name:
            case "recover":
                return self.recover
            case "fetch":
                return self.fetch if self.flies else self.recover
            case "land":
                return self.land


class Catalogue(Struct, frozen=True):
    """Agent types and actions that trees may use, and where the libraries are that they may import."""

    types: Mapping[str, AgentType] = field(default_factory=dict)
    actions: Mapping[str, ActionSpec] = field(default_factory=dict)
    digest: str = ""
    """SHA-256 (hex) over the files."""
    libraries: tuple[Path, ...] = ()
    """Folders of the site with subtrees of its own: imports are looked up there before what ships."""
    records: Mapping[str, Type] = field(default_factory=dict)
    """Records that its files declare: types like any other, in tasks too."""


RESUME_HOLD_AFTER_US: Final = 30_000_000
"""`resume_hold_after` of a site that does not say it."""
MOST_RESUME_HOLD_AFTER_US: Final = 600_000_000
"""The longest that a site may say."""
MIN_SPACING_M: Final = 3.0
"""`min_spacing` of a site that does not say it."""


class Port(Struct, frozen=True):
    """A landing port: its place and where to wait when it is taken."""

    name: str
    at: Any
    waiting: Any = None


class Station(Struct, frozen=True):
    """A place where ground machines stand, and may charge."""

    name: str
    at: Place
    heading_deg: float | None = None
    """True, clockwise from north: how a machine stands there."""
    charges: bool = False
    kinds: tuple[str, ...] = ()
    """Types of machines that may use it; empty: all."""


class Resource(Struct, frozen=True):
    """What only so many tasks use at a time: a lift, a bridge, the bays of a dock. Tasks claim units of it by name."""

    name: str
    capacity: int = 1
    """Units, from 1 on."""
    region: Any = None
    """Where it is: a machine inside takes up a unit of it (`base.geo.Region`); None = it is nowhere in particular."""


class SiteAgent(Struct, frozen=True):
    """An agent that the site lists: its type, its own port or station, and what its actions would hurt a machine in."""

    id: str
    type: str
    home: str = ""
    at: Place | None = None
    """Where it stands: of what never moves; of a ground machine where it begins."""
    guards: Mapping[str, str] = field(default_factory=dict)
    """Action -> the resource with a region that must be empty when it begins (`Close: doorway`)."""


class Site(Struct, frozen=True):
    """A checked site file (`formiga_site: 1`)."""

    name: str
    lat: float
    lng: float
    ground_msl_m: float = 0.0
    timezone: str = "UTC"
    """IANA name: what `06:30` and the day of `today('06:30')` are reckoned in."""
    ports: Mapping[str, Port] = field(default_factory=dict)
    places: Mapping[str, Any] = field(default_factory=dict)
    regions: Mapping[str, Any] = field(default_factory=dict)
    resources: Mapping[str, Resource] = field(default_factory=dict)
    """What tasks claim with `with_resource`, by name."""
    fence: Any = None
    no_fly: tuple[Any, ...] = ()
    no_go: tuple[Any, ...] = ()
    """Regions that no ground machine enters."""
    stations: Mapping[str, Station] = field(default_factory=dict)
    routes: Routes = Routes()
    """On which ground machines drive; without nodes they drive straight ways."""
    relief_m: float = 0.0
    """How much flat ground may rise above the base's ground, metres; with a height file, what that file may be wrong by."""
    heights: Any = None
    """The ground as a `heights.HeightGrid` (None = flat), read from `terrain: {file: ...}`."""
    layers_m: tuple[float, ...] = (60.0, 75.0, 90.0)
    separation_m: float = 15.0
    min_spacing_m: float = MIN_SPACING_M
    """No two machines use ground spots closer than this."""
    envelope: Mapping[str, float] = field(default_factory=dict)
    """What the site tightens of every machine's envelope, named as in `AgentType.limits`."""
    on_breach: Mapping[str, str] = field(default_factory=dict)
    """Like `AgentType.on_breach`; the site's word ranks above the type's."""
    resume_hold_after_us: int = RESUME_HOLD_AFTER_US
    """After a longer outage of the engine its tasks come back HELD: a person must say that they may go on."""
    policy: Literal["closest", "optimal"] = "closest"
    """How agents are chosen for tasks that wait."""
    preflight: bool = False
    """Whether a machine is granted only when its preflight checks are all ok."""
    pilots: Mapping[str, int] = field(default_factory=dict)
    """Pilots and how many machines each may have in the air at once (`mode: real`)."""
    people: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Site roles (watchers, ...) and the ids of those who have them."""
    agents: Mapping[str, SiteAgent] = field(default_factory=dict)
    transports: Mapping[str, Mapping[str, str | bool]] = field(default_factory=dict)
    """The wires that agents are reached by, and the options of each; none: the one that ships (`base.wires`)."""
    accept_missing: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Wire -> guarantees of mode real that the site does without."""
    rules: Mapping[str, Rule] = field(default_factory=dict)
    """Its standing rules, of the site file and of `rules/` beside it."""
    news: Mapping[str, Channel] = field(default_factory=dict)
    """Channels of its news, by name."""
    rules_digest: str = ""
    """SHA-256 (hex) over what the rules say; "" = there are none."""
    mode: Literal["simulation", "real"] = "simulation"
    file: str = ""
    digest: str = ""
    """SHA-256 (hex) of the file, and of the heights that it names."""
    covered: str = ""
    """SHA-256 (hex) of what a person's approval of a task covers (`lang.covered`)."""
