"""A small flight and its site, made by hand: what charts and maps are tested with."""

from formiga_bt.base.clock import SECOND
from formiga_bt.rehearsal.testing import packaged_world
from formiga_bt.show.facts import ActionFact, Chart, MapMark, MapShape, Point, TaskFact, Timeline, Track, Waiting
from formiga_bt.show.history.rows import deed_of

_, CATALOGUE = packaged_world()
ZERO = 1_000_000 * SECOND


def at(seconds: float) -> int:
    return ZERO + round(seconds * SECOND)


def task(name: str = "PickUp-1", status: str = "SUCCEEDED", end: float | None = 100.0, **more: object) -> TaskFact:
    return TaskFact(
        id=name, name=name.split("-")[0], status=status, submitted_at=ZERO, ended_at=None if end is None else at(end),
        **more,
    )  # fmt: skip


def action(
    agent: str,
    name: str,
    start: float,
    end: float | None,
    state: str = "succeeded",
    code: str = "",
    of: str = "PickUp-1",
) -> ActionFact:
    return ActionFact(
        task=of,
        agent=agent,
        action=name,
        start=at(start),
        end=None if end is None else at(end),
        state=state,
        code=code,
        does=deed_of(name, CATALOGUE.actions.get(name)),
    )


PICKUP = Timeline(
    at=at(100),
    tasks=(task(),),
    actions=(
        action("hwd_1", "TakeOff", 5, 25),
        action("hwd_1", "GoTo", 25, 26),
        action("hwd_1", "GoTo", 26, 50),
        action("picker_1", "Confirm", 50, 58, "answered", "clear"),
        action("watcher_1", "Confirm", 50, 58, "withdrawn"),
        action("hwd_1", "LandIn", 60, 80),
        action("hwd_1", "Weigh", 80, 80, "failed", "no_scale"),
    ),
    waits=(
        Waiting(task="PickUp-1", kind="pending", start=at(0), end=at(5)),
        Waiting(task="PickUp-1", kind="question", start=at(50), end=at(58), agent="picker_1, watcher_1", text="Q1"),
        Waiting(task="PickUp-1", kind="gate", start=at(50), end=at(60), agent="hwd_1", text="clearance"),
        Waiting(task="PickUp-1", kind="held", start=at(85), end=at(95)),
    ),
)
"""A task that waits for its agents, flies, asks, lands, fails to weigh, is held, and ends."""

SITE = Chart(
    site="camp",
    at=at(100),
    marks=(
        MapMark(name="base", kind="base", at=Point(0, 0)),
        MapMark(name="p1", kind="port", at=Point(-40, 10)),
        MapMark(name="p2", kind="port", at=Point(-10, 10)),
        MapMark(name="field", kind="place", at=Point(60, 80)),
        MapMark(name="far", kind="place", at=Point(900, 0)),
        MapMark(name="hwd_1 landed", kind="landing", at=Point(60, 80)),
    ),
    shapes=(
        MapShape(name="fence", kind="fence", corners=(Point(-70, -30), Point(90, -30), Point(90, 110), Point(-70, 110))),
        MapShape(name="bog", kind="region", corners=(Point(20, 20), Point(50, 20), Point(50, 40), Point(20, 40))),
        MapShape(
            name="no_fly_1", kind="zone", forbidden=True,
            corners=(Point(-60, 60), Point(-20, 60), Point(-20, 95), Point(-60, 95)),
        ),
    ),
    tracks=(
        Track(
            agent="hwd_1", type="hwd", task="PickUp-1", times=(at(5), at(25), at(50), at(80)),
            points=(Point(-40, 10), Point(-40, 10, 60), Point(60, 80, 60), Point(60, 80)),
        ),
        Track(agent="picker_1", type="picker", mobility="people", times=(at(0),), points=(Point(62, 70),)),
    ),
)  # fmt: skip
"""A drone that flies from a port to a field where a person stands."""
