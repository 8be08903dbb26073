"""A picker follows the drone that guides them: in sight, after a moment, to below it, and nobody once in range."""

from agents_sim.following import FORGOTTEN_AFTER_US, Follower
from agents_sim.limits import PersonLimits
from agents_sim.world import AgentSpec
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position
from tests.unit.agents_sim.conftest import World, point

LOST = Place(300.0, 0.0)
QUICK = {"reaction_s": 0.0, "walk_m_s": 2.0, "fix_error_m": 0.0, "fix_takes_s": 0.0}


def hover(world: World, east_m: float, north_m: float = 0.0, name: str = "d") -> None:
    world.fleet.add(AgentSpec(id=name, type="hwd", at=Position(east_m, north_m, 60.0)))


def picker(world: World, at: Place = LOST, walk: tuple[Place, ...] = (), **limits: float) -> None:
    world.fleet.add(AgentSpec(id="p", type="picker", at=at, walk=walk, limits={**QUICK, **limits}))


def here(world: World) -> tuple[float, float]:
    at = world.fleet["p"].person.position()
    return at.east_m, at.north_m


def find(world: World) -> dict[str, object]:
    goal = world.order("p", "MiniFinder", base=point(0, 0))
    return world.end(goal)[1].result


def test_nobody_follows_a_drone_that_no_tracker_speaks_of(world: World) -> None:
    hover(world, 280.0)
    picker(world)
    world.run(60.0)
    assert here(world) == (300.0, 0.0)


def test_they_walk_to_the_drone_and_wait_below_it(world: World) -> None:
    hover(world, 260.0)
    picker(world)
    assert find(world) == {"in_range": False, "go_to": {"east_m": 260.0, "north_m": 0.0}}
    world.run(10.0)
    assert here(world) == (280.0, 0.0)
    world.run(100.0)
    assert here(world) == (262.0, 0.0)


def test_they_walk_only_after_a_moment(world: World) -> None:
    hover(world, 260.0)
    picker(world, reaction_s=5.0)
    find(world)
    world.run(5.0)
    assert here(world) == (300.0, 0.0)
    world.run(5.0)
    assert here(world) == (290.0, 0.0)


def test_what_is_out_of_sight_is_not_followed(world: World) -> None:
    hover(world, 219.0)
    picker(world)
    find(world)
    world.run(30.0)
    assert here(world) == (300.0, 0.0)


def test_a_drone_that_flies_out_of_sight_leaves_them_where_they_are(world: World) -> None:
    hover(world, 260.0)
    picker(world)
    find(world)
    world.run(5.0)
    world.order("d", "GoTo", to=point(-400, 0, 60))
    world.run(60.0)
    east_m, _ = here(world)
    world.run(20.0)
    assert here(world) == (east_m, 0.0)
    assert east_m > 270.0


def test_of_two_drones_they_follow_the_one_nearest_to_where_the_tracker_points(world: World) -> None:
    hover(world, 262.0)
    hover(world, 300.0, 20.0, name="other")
    picker(world)
    find(world)
    world.run(10.0)
    assert here(world) == (280.0, 0.0)


def test_once_in_range_they_follow_nobody(world: World) -> None:
    hover(world, 0.0)
    picker(world, at=Place(30.0, 0.0))
    find(world)
    world.run(8.0)
    assert find(world)["in_range"] is True
    world.order("d", "GoTo", to=point(60, 0, 60))
    world.run(60.0)
    assert here(world) == (14.0, 0.0)


def test_a_way_of_their_own_ends_when_they_see_the_drone_not_before(world: World) -> None:
    picker(world, walk=(Place(300.0, 500.0),))
    find(world)
    world.run(10.0)
    assert here(world) == (300.0, 20.0)
    hover(world, 260.0, 20.0)
    world.run(10.0)
    assert here(world) == (280.0, 20.0)


def test_nobody_is_guided_for_ever() -> None:
    follower = Follower(PersonLimits(), lambda: {"d": Position(10.0, 0.0, 60.0)})
    follower.guide(Place(10.0, 0.0), 0)
    at = Place(0.0, 0.0)
    assert follower.look(at, 10 * SECOND) is None
    assert follower.look(at, 14 * SECOND) == Place(10.0, 0.0)
    assert follower.is_guided(FORGOTTEN_AFTER_US)
    assert not follower.is_guided(FORGOTTEN_AFTER_US + 1)
    assert follower.look(at, FORGOTTEN_AFTER_US + SECOND) is None
    assert not follower.sees


def test_a_jump_of_engine_time_changes_nothing() -> None:
    follower = Follower(PersonLimits(), lambda: {"d": Position(10.0, 0.0, 60.0)})
    follower.guide(Place(10.0, 0.0), 0)
    follower.look(Place(0.0, 0.0), 0)
    follower.shift(3600 * SECOND)
    assert follower.look(Place(0.0, 0.0), 3602 * SECOND) is None
    assert follower.look(Place(0.0, 0.0), 3604 * SECOND) == Place(10.0, 0.0)
