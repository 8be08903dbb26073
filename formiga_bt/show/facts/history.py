"""Facts of time and space: what a Gantt chart, a map and the statistics show."""

from typing import Any, Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.base.machines import Mobility
from formiga_bt.show.facts.site import ActionFact, Point, TaskFact


class Waiting(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A span of a task without an action: it waits for agents, for a person, at the gate; or it is held."""

    task: str
    kind: Literal["pending", "question", "gate", "held"]
    start: Micros
    end: Micros | None = None
    agent: str = ""
    text: str = ""


class Timeline(Struct, frozen=True, kw_only=True):
    """What a Gantt chart shows."""

    at: Micros
    """Until here it is known."""
    tasks: tuple[TaskFact, ...]
    actions: tuple[ActionFact, ...]
    waits: tuple[Waiting, ...] = ()


class Track(Struct, frozen=True, kw_only=True):
    """The way an agent went, thinned: nobody was further than about 1 m from the line through its points."""

    agent: str
    type: str
    task: str = ""
    mobility: Mobility = "air"
    times: tuple[Micros, ...] = ()
    points: tuple[Point, ...] = ()

    @property
    def human(self) -> bool:
        """Return whether it is a person."""
        return self.mobility == "people"


class MapMark(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A named point of the site, or where something happened."""

    name: str
    kind: Literal["base", "port", "station", "park", "place", "landing", "event", "find"]
    at: Point


class MapShape(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """An area of the site."""

    name: str
    kind: Literal["fence", "zone", "region", "searched"]
    """`searched`: a region that was looked at; its name says how much of it was seen."""
    corners: tuple[Point, ...]
    forbidden: bool = False


class MapLane(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """An edge of the site's routes."""

    name: str
    start: Point
    end: Point
    one_way: bool = False
    """It is driven from `start` to `end` only."""


class Chart(Struct, frozen=True, kw_only=True):
    """What a map shows."""

    site: str
    at: Micros
    marks: tuple[MapMark, ...]
    shapes: tuple[MapShape, ...]
    tracks: tuple[Track, ...]
    lanes: tuple[MapLane, ...] = ()
    origin_lat: float = 0.0
    origin_lng: float = 0.0


class Spread(Struct, frozen=True, kw_only=True):
    """How long something took: `n` times that ended well; seconds."""

    name: str
    group: str = ""
    """Agent type of an action."""
    n: int
    failed: int = 0
    least_s: float = 0.0
    q1_s: float = 0.0
    median_s: float = 0.0
    q3_s: float = 0.0
    most_s: float = 0.0


class Stats(Struct, frozen=True, kw_only=True):
    """Durations of actions, gaps between them, tasks, and answers of people."""

    since: Micros
    at: Micros
    tasks: tuple[Spread, ...] = ()
    waits: tuple[Spread, ...] = ()
    """From request to the first step, by task."""
    actions: tuple[Spread, ...] = ()
    gaps: tuple[Spread, ...] = ()
    """From the end of one action of a task to the start of its next, by task."""
    answers: tuple[Spread, ...] = ()


class BlackboardFact(Struct, frozen=True):
    """Keys of the blackboard with their values, in the order of their first writing."""

    at: Micros
    keys: dict[str, Any]
    """`/fleet/TYPE/ID/FIELD`, `/members/TYPE`, `/tasks/ID/status`, `/allocation/requests/ID`, `/allocation/grants/ID`."""

    def show_in_py_trees(self) -> None:
        """Put the keys into py_trees' own blackboard, for its display tools; nothing of it goes back to the engine."""
        from py_trees.blackboard import Blackboard

        for key, value in self.keys.items():
            Blackboard.set(key, value)
