"""`Agent`: the class that one's own agents extend. It says what the agent is; `session.py` keeps the rules."""

import asyncio
import inspect
import mimetypes
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal, Protocol, get_args

from formiga_bt.agent.declared import Declared, actions_of, events_of
from formiga_bt.agent.types import UnfitError, fields_of, write_values
from formiga_bt.base.geo import Place, Position
from formiga_bt.base.machines import MACHINES, Mobility
from formiga_bt.transport.agent_side import STATUS_FIELDS
from formiga_bt.transport.attachments import Attachment, attachment_of
from formiga_bt.transport.cards import AgentCard, Fields
from formiga_bt.transport.messages import Control, GoalRequest, SiteMessage

OnLinkLoss = Literal["return", "land", "hold"]


class Running(Protocol):
    """What carries an agent: its session."""

    def note_status(self, fields: Mapping[str, Any]) -> None:
        """Take fields of the status."""
        ...

    def note_feedback(self, progress: float | None, eta_s: float | None, phase: str) -> None:
        """Take news of the goal that runs."""
        ...

    def note_event(self, name: str, fields: Mapping[str, Any], files: Sequence[Attachment] = ()) -> None:
        """Take an event."""
        ...

    def note_file(self, file: Attachment, data: bytes) -> None:
        """Take a file."""
        ...

    @property
    def site(self) -> SiteMessage | None:
        """Return what the engine told of the site."""
        ...

    def note_control(self, control: Control) -> None:
        """Take who is in command."""
        ...

    def engine_now(self) -> int:
        """Return engine time, microseconds."""
        ...

    async def sleep(self, seconds: float) -> None:
        """Wait in engine time."""
        ...

    def live(self, name: str) -> Any:
        """Return a field of the goal that the present action carries out, as it is now."""
        ...


class Agent:
    """An agent of one's own: a machine, a device, a service.

    Extend it with the keywords `type` (the agent's type in the catalogue), `mobility` (`ground`, `fixed`, `none`, `air`),
    `fields` (what its status says besides: name -> annotation), `on_link_loss`, `datum`, `limits`, `avoids`,
    `software`; and with methods marked `@action` and `@event`.

    Of a class with `mobility="air"` the method `link_lost` must say what it does without its link.
    """

    kind: ClassVar[str] = ""
    """Its type in the catalogue."""
    mobility: ClassVar[Mobility] = "ground"
    actions: ClassVar[Mapping[str, Declared]] = {}
    events: ClassVar[Mapping[str, Fields]] = {}
    own_fields: ClassVar[Fields] = {}
    announced: ClassVar[Mapping[str, Any]] = {}
    """Other fields of the card."""

    id: str = ""
    """Set before it runs."""
    _running: Running | None = None

    def __init_subclass__(
        cls,
        *,
        type: str = "",
        mobility: Mobility | None = None,
        fields: Mapping[str, Any] | None = None,
        on_link_loss: OnLinkLoss | None = None,
        datum: Literal["local", "ellipsoid", "msl"] | None = None,
        limits: Mapping[str, float] | None = None,
        avoids: bool | None = None,
        software: str | None = None,
    ) -> None:
        super().__init_subclass__()
        cls.kind = type or cls.kind
        cls.mobility = mobility or cls.mobility
        if cls.mobility not in MACHINES:
            raise TypeError(f"{cls.__name__}: mobility is {', '.join(MACHINES)}, got {mobility!r}")
        said = {
            "on_link_loss": on_link_loss, "datum": datum, "limits": dict(limits) if limits is not None else None,
            "avoids": avoids, "software": software,
        }  # fmt: skip
        cls.announced = {**cls.announced, **{name: value for name, value in said.items() if value is not None}}
        try:
            cls.actions, cls.events = actions_of(cls), events_of(cls)
            cls.own_fields = {**cls.own_fields, **fields_of(fields or {})}
        except TypeError as error:
            raise TypeError(f"{cls.__name__}: {error}") from error
        clash = sorted((cls.own_fields.keys() | cls.events.keys()) & (STATUS_FIELDS | {"pose"}))
        if clash:
            raise TypeError(f"{cls.__name__}: {clash[0]!r} is a name of every status; choose another")
        if cls.mobility == "air" and cls.link_lost is Agent.link_lost:
            raise TypeError(f"{cls.__name__} flies: its method link_lost must say what it does without its link")

    def __getattribute__(self, name: str) -> Any:
        value = super().__getattribute__(name)
        if hasattr(value, "__formiga_event__") and inspect.ismethod(value):
            return lambda **fields: self._tell(name, fields)
        return value

    # What one's own class may have.

    async def main(self) -> None:
        """Run beside the actions, as long as the agent's process: reads sensors, reports statuses and events."""
        await asyncio.Event().wait()

    def accepts(self, request: GoalRequest) -> str:  # noqa: ARG002
        """Return "" to begin a goal, or why not, as a snake_case word; its fields fit their types already."""
        return ""

    async def link_lost(self) -> None:
        """Act without the engine, when nothing was heard of it for too long; goals that ran have ended `taken_over`.

        The engine commands again when it is heard and this has returned. Default: nothing, and goals go on.
        """

    # What it says.

    def status(self, **fields: Any) -> None:
        """Say how the agent is; it is published soon, and twice a second at least.

        Args:
            **fields: `pose` (a Place or Position), `battery`, `landed`, `heading_deg`, `speed_m_s`, `altitude_m`,
            `floor`,
                `charging`, `errors`, `link`, `payload_kg`, `checks`, ...: fields of a status; and those that the
                class names under `fields`.

        Raises:
            TypeError: a name is none of them, or a value has another type.
        """
        own = {name: fields.pop(name) for name in list(fields) if name in self.own_fields}
        if "pose" in fields:
            fields["position"] = fields.pop("pose")
        point = fields.get("position")
        if isinstance(point, Place):
            fields["position"] = Position(point.east_m, point.north_m, 0.0)
        unknown = sorted(fields.keys() - STATUS_FIELDS)
        if unknown:
            known = ", ".join([*sorted(STATUS_FIELDS - {"fields", "position"}), "pose", *self.own_fields])
            raise TypeError(f"a status of {type(self).__name__} has no {unknown[0]!r}; it has: {known}")
        if own:
            told: Fields = {name: self.own_fields[name] for name in own}
            try:
                fields["fields"] = write_values(told, own, "the status")
            except UnfitError as error:
                raise TypeError(str(error)) from error
        self._carrier().note_status(fields)

    def feedback(self, *, progress: float | None = None, eta_s: float | None = None, phase: str = "") -> None:
        """Say how far the goal is that this action carries out: 0..1, seconds left, a word for the present part."""
        self._carrier().note_feedback(progress, eta_s, phase)

    def attach(self, name: str, data: bytes | Path, media_type: str = "", uri: str = "") -> Attachment:
        """Send a file, a photo or a log; said within an action, its result names it.

        Args:
            name: for people, such as roof.jpg; no path.
            data: the bytes, or where they are.
            media_type: such as image/jpeg; empty: as the name says.
            uri: where else it is to be had (http, https).

        Returns:
            What names it, for events: `self.alarm(level=3, attachments=[...])`.

        Raises:
            FileError: the name cannot be used, or the bytes are more than 16 MiB.
            OSError: the file cannot be read.
        """
        given = data.read_bytes() if isinstance(data, Path) else data
        kind = media_type or mimetypes.guess_type(name)[0] or "application/octet-stream"
        file = attachment_of(name, given, kind, uri)
        self._carrier().note_file(file, given)
        return file

    @property
    def site(self) -> SiteMessage | None:
        """Return what the engine told of the site: base, fence, heights, stations; None before it did."""
        return self._carrier().site

    def live(self, name: str) -> Any:
        """Return a parameter of the present action as it is now: one that `@action(live=[...])` names may have changed.

        Raises:
            KeyError: the action has no such parameter.
            RuntimeError: it is not asked within an action.
        """
        return self._carrier().live(name)

    def take_control(self, control: Control) -> None:
        """Say who is in command: `pilot`, `failsafe`, or `engine` again. Goals that run end when it is not the engine."""
        if control not in get_args(Control):
            raise TypeError(f"control is one of {', '.join(get_args(Control))}, got {control!r}")
        self._carrier().note_control(control)

    async def sleep(self, seconds: float) -> None:
        """Wait so many seconds of engine time."""
        await self._carrier().sleep(seconds)

    def now(self) -> int:
        """Return engine time, microseconds."""
        return self._carrier().engine_now()

    # Inside.

    def _tell(self, name: str, fields: dict[str, Any]) -> None:
        files = tuple(fields.pop("attachments", ())) if "attachments" not in self.events[name] else ()
        try:
            made = write_values(self.events[name], fields, f"event {name}")
        except UnfitError as error:
            raise TypeError(str(error)) from error
        self._carrier().note_event(name, made, files)

    def _carrier(self) -> Running:
        if self._running is None:
            raise RuntimeError(
                f"{type(self).__name__} does not run yet: say it in main() or in an action; `run(...)` starts it"
            )
        return self._running


def card_of(agent: Agent, boot_id: str) -> AgentCard:
    """Return what an agent announces."""
    return AgentCard(
        id=agent.id,
        type=agent.kind,
        boot_id=boot_id,
        actions=tuple(one.card for one in agent.actions.values()),
        mobility=agent.mobility,
        events={name: dict(fields) for name, fields in agent.events.items()},
        fields=dict(agent.own_fields),
        **{"on_link_loss": "hold" if agent.mobility != "air" else "return", **agent.announced},
    )


def check_agent(agent: type[Agent], agent_id: str) -> None:
    """Check what can be checked before an agent starts.

    Raises:
        ValueError: it has no type, no id, or no action and no event.
    """
    if not agent.kind:
        raise ValueError(f"{agent.__name__} has no type; such as: class {agent.__name__}(Agent, type='rover')")
    if not agent_id:
        raise ValueError(
            f"{agent.__name__} needs an id; such as: run({agent.__name__}, id='{agent.kind}_1', site='my-site')"
        )
    if not agent.actions and not agent.events and not agent.own_fields:
        raise ValueError(f"{agent.__name__} has no @action, no @event and no fields: nobody could do anything with it")
