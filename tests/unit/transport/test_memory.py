from formiga_bt.base.clock import SECOND, VirtualScheduler
from formiga_bt.base.geo import Position
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.memory import Faults, MemoryHub
from formiga_bt.transport.messages import (
    AgentCard,
    AgentGone,
    AgentSeen,
    BadMessage,
    GoalReported,
    GoalRequest,
    SendFailed,
    StatusArrived,
    TransportEvent,
)


class Body:
    def __init__(self, time: VirtualScheduler) -> None:
        self.time = time
        self.side: AgentSide
        self.starts = 0

    def start(self, request: GoalRequest) -> str:
        self.starts += 1
        self.time.call_at(
            self.time.now() + SECOND, lambda: self.side.finish(request.goal_id, "succeeded", result={"ok": True})
        )
        return ""

    def cancel(self, goal_id: str) -> bool:
        return False


class World:
    def __init__(self, **options: object) -> None:
        self.time = VirtualScheduler()
        self.hub = MemoryHub(self.time, **options)
        self.wakes = 0
        self.hub.transport.open(self.wake)
        self.body = Body(self.time)

    def wake(self) -> None:
        self.wakes += 1

    def join(self, agent: str = "a", boot_id: str = "b1") -> None:
        link = self.hub.link(agent)
        card = AgentCard(id=agent, type="drone", boot_id=boot_id, actions=("Go",))
        self.body.side = AgentSide(card, self.body, link, now=self.time.now)
        link.serve(self.body.side)

    def goal(self, goal_id: str, agent: str = "a", **fields: object) -> None:
        self.hub.transport.send_goal(GoalRequest(goal_id=goal_id, agent=agent, action="Go", fields=dict(fields)))

    def run(self) -> list[tuple[int, TransportEvent]]:
        log = []
        while self.time.run_next():
            log += [(self.time.now(), event) for event in self.hub.transport.poll()]
        return log


def test_every_message_takes_the_delay() -> None:
    world = World(delay_us=20_000)
    world.join()
    log = world.run()
    assert [(at, type(event)) for at, event in log] == [(20_000, AgentSeen), (20_000, StatusArrived)]
    assert world.wakes == 2
    world.goal("g1")
    log = world.run()
    assert [(at, event.event.state) for at, event in log if isinstance(event, GoalReported)] == [
        (60_000, "accepted"),
        (1_060_000, "succeeded"),
    ]


def test_messages_pass_by_value() -> None:
    world = World()
    world.join()
    fields = {"to": Position(1, 2, 3)}
    heard: list[GoalRequest] = []
    world.body.start = lambda request: heard.append(request) or ""  # type: ignore[method-assign]
    world.goal("g1", **fields)
    world.run()
    assert heard[0].fields["to"] == {"is": "position", "east_m": 1, "north_m": 2, "up_m": 3}


def test_equal_seeds_give_equal_deliveries() -> None:
    def run(seed: int) -> list[tuple[int, TransportEvent]]:
        faults = Faults(drop=0.2, duplicate=0.3, reorder=0.3, jitter_us=5_000)
        world = World(seed=seed, faults=faults)
        world.join()
        for i in range(30):
            world.goal(f"g{i}")
        return world.run()

    assert run(1) == run(1)
    assert run(1) != run(2)


def test_a_repeated_goal_message_starts_it_once_and_is_answered_once() -> None:
    world = World(faults=Faults(duplicate=1.0))
    world.join()
    world.goal("g1")
    accepted = [e for _, e in world.run() if isinstance(e, GoalReported) and e.event.state == "accepted"]
    assert (world.body.starts, len(accepted)) == (1, 1)


def test_a_dropped_goal_leaves_the_outcome_unknown() -> None:
    world = World(reply_timeout_us=2 * SECOND)
    world.join()
    world.run()
    world.hub.set_faults("a", Faults(drop=1.0))
    world.goal("g1")
    ((at, failure),) = world.run()
    assert isinstance(failure, SendFailed)
    assert (at, failure.outcome) == (2_020_000, "unknown")


def test_without_reordering_jitter_keeps_the_order() -> None:
    world = World(faults=Faults(jitter_us=100_000))
    world.join()
    for i in range(20):
        world.body.side.publish_status(battery=float(i))
    batteries = [event.status.battery for _, event in world.run() if isinstance(event, StatusArrived)]
    assert batteries == [100.0, *range(20)]


def test_a_restart_kills_the_earlier_process() -> None:
    world = World()
    world.join(boot_id="b1")
    world.goal("g1")
    world.run()
    old = world.body.side
    world.join(boot_id="b2")
    old.publish_status()
    kinds = [type(event) for _, event in world.run()]
    assert kinds == [AgentGone, AgentSeen, StatusArrived]


def test_a_number_that_is_no_number_is_a_bad_message() -> None:
    world = World()
    world.join()
    world.run()
    world.body.side.publish_status(battery=float("nan"))
    ((_, event),) = world.run()
    assert isinstance(event, BadMessage)


def test_a_closed_transport_hears_nothing() -> None:
    world = World()
    world.join()
    world.hub.transport.close()
    assert world.run() == []
