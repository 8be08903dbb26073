"""Ways: what is thinned, and what is kept of a rest."""

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Position
from formiga_bt.show.history.tracks import AgentTrack


def test_a_rest_has_a_point_when_it_began_and_one_when_it_ended() -> None:
    """Ten seconds up, a minute there, ten seconds on: the height over time shows the minute."""
    way = AgentTrack("d", "lwd", mobility="air")
    for s in range(11):
        way.note(s * SECOND, Position(0, 0, s * 3.0), "A-1")
    for s in range(11, 71):
        way.stood(s * SECOND)
    for s in range(71, 81):
        way.note(s * SECOND, Position(0, 0, 30 + (s - 70) * 3.0), "A-1")

    (track,) = way.tracks()

    assert [(at // SECOND, point.up_m) for at, point in zip(track.times, track.points, strict=True)] == [
        (0, 0.0), (10, 30.0), (70, 30.0), (80, 60.0),
    ]  # fmt: skip


def test_sparse_fixes_are_no_rest() -> None:
    """A machine that tells its position each twenty seconds moves all the time, as far as is known."""
    way = AgentTrack("d", "lwd", mobility="air")
    for n in range(4):
        way.note(n * 20 * SECOND, Position(n * 15.0, 0, 60), "A-1")

    (track,) = way.tracks()

    assert [at // SECOND for at in track.times] == [0, 60]


def test_the_way_for_a_task_begins_when_it_gets_the_agent() -> None:
    """It begins where the agent stands, and not at the time at which it came there."""
    way = AgentTrack("d", "lwd", mobility="air")
    way.note(0, Position(0, 0, 0), "A-1")
    way.note(10 * SECOND, Position(50, 0, 0), "A-1")
    way.note(500 * SECOND, Position(50, 0, 0), "B-2")
    way.note(510 * SECOND, Position(90, 0, 0), "B-2")

    first, then = way.tracks()

    assert (first.task, [at // SECOND for at in first.times]) == ("A-1", [0, 10])
    assert (then.task, [at // SECOND for at in then.times]) == ("B-2", [500, 510])


def test_the_way_before_is_taken_and_the_way_goes_on() -> None:
    """Of one task, before an instant; what was there stays, in order, and what comes is added to its end."""
    former, way = AgentTrack("d", "lwd", mobility="air"), AgentTrack("d", "lwd", mobility="air")
    for s, task in ((0, "A-1"), (10, "A-1"), (20, "B-2"), (30, "B-2"), (40, "A-1"), (44, "A-1")):
        former.note(s * SECOND, Position(s * 5.0, 0, 0), task)
    way.note(45 * SECOND, Position(225, 0, 0), "A-1")

    way.adopt(former, "A-1", 45 * SECOND)
    way.note(60 * SECOND, Position(300, 50, 0), "A-1")

    assert [(one.task, [at // SECOND for at in one.times]) for one in way.tracks()] == [
        ("A-1", [0, 10]), ("A-1", [40, 44]), ("A-1", [45, 60]),
    ]  # fmt: skip
