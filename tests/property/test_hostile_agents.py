"""No message of an agent ends an engine: what a wire lets pass, the engine takes and the journal keeps.

Each message begins as a good one; some of its values, at any depth, become hostile ones. It goes through the wires' checks as
its bytes would; what comes of it goes through the journal's codec and its way points.
"""

from collections.abc import Callable, Iterator
from random import Random
from typing import Any, Final

import msgspec
import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Position
from formiga_bt.engine.kernel.inputs import LockdownOrder, Operator
from formiga_bt.journal.codec import Codec
from formiga_bt.journal.thin import Thinner, pack
from formiga_bt.rehearsal.testing import Bench, ScriptedAgent, packaged_task, packaged_world
from formiga_bt.transport.codec import (
    GoalsReply,
    WireError,
    check_agent_event,
    check_card,
    check_event,
    check_status,
    decode,
    read_reply,
)
from formiga_bt.transport.messages import (
    AgentCard,
    AgentEvent,
    AgentGone,
    AgentSeen,
    AgentStatus,
    BadMessage,
    EventArrived,
    GoalEvent,
    GoalReported,
    SendFailed,
    StatusArrived,
    TransportEvent,
)

MESSAGES: Final = 40
"""Of one run."""
DIGITS: Final = "9" * 5000
NUMBERS: Final = (
    "0", "-1", "1e7", "-1e7", "1e8", "1e155", "-1e300", "1.7976931348623157e308", "5e-324", "1e999", "NaN", "-0.0", "60.5",
    "9223372036854775808", "-9223372036854775809", "18446744073709551616", "99999999999999999999999999", DIGITS,
)  # fmt: skip
TEXTS: Final = (
    '""', '"x"', '"nan"', '"inf"', '"٣"', '"~"', '"|"', '"a|b"', '"\\ud800"', f'"PickUp-{DIGITS}/1/x"',
    f'"safety/hwd_1/{DIGITS}"', f'"clear/hwd_1/{"9" * 30}~ann"', '"Try-1/1/x"', f'"{"a" * 5000}"',
)  # fmt: skip
SHAPES: Final = ("null", "true", "[]", "{}", "[" * 40 + "]" * 40, '{"east_m": 1}', '{"east_m": "nan", "north_m": 1}')
STATES: Final = (
    "accepted", "rejected", "running", "canceling", "succeeded", "failed", "canceled", "taken_over", "superseded", "unknown",
)  # fmt: skip
RESULTS: Final[tuple[dict[str, Any], ...]] = (
    {}, {"answer": "clear", "by": "watcher_1", "at": 1}, {"in_range": False, "go_to": {"east_m": 1.0, "north_m": 1.0}},
)  # fmt: skip
ORDERS: Final = (
    "hold", "return", "land", "cut", "continue", "clear", "handback_continue", "handback_return", "handback_end", "removed",
)  # fmt: skip


def spoilt(value: Any, random: Random, share: float) -> str:
    """Return a message as JSON, some of its values hostile."""
    if random.random() < share / 3:
        return random.choice(random.choice((NUMBERS, TEXTS, SHAPES)))
    if isinstance(value, dict):
        return "{" + ", ".join(f'"{key}": {spoilt(item, random, share)}' for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(spoilt(item, random, share) for item in value) + "]"
    if random.random() < share:
        return random.choice(NUMBERS if isinstance(value, int | float) else TEXTS)
    return msgspec.json.encode(value).decode()


class Hostile:
    """A fleet at work, one of which says what it likes."""

    def __init__(self, seed: int) -> None:
        site, catalogue = packaged_world()
        self.random = Random(seed)
        self.bench = Bench(site, catalogue, [packaged_task("pick_up"), packaged_task("watch_dog_request")])
        names = {"hwd_1": "hwd", "lwd_1": "lwd", "picker_1": "picker", "watcher_1": "watcher"}
        self.agents = [self.bench.agent(name, kind) for name, kind in names.items()]
        self.bench.run_for(1)
        self.bench.submit("PickUp", {"target": site.places["camp"], "user": "picker_1"})
        if self.random.random() < 0.5:
            watch = {"alarmtype": "sos", "target": site.places["camp"], "username": "picker_1"}
            self.bench.submit("WatchDogRequest", watch)
        self.codec, self.thinner = Codec({}, 0), Thinner(self.bench.engine.state)
        self.kept = len(self.bench.steps)

    def goal_id(self) -> str:
        return self.random.choice([*self.bench.engine.state.goals, "x"])

    def message(self, agent: ScriptedAgent) -> TransportEvent:
        """Return what comes of a message on a wire."""
        random, status = self.random, msgspec.to_builtins(agent.side.status)
        status["seq"] += 1
        event = {
            "goal_id": self.goal_id(), "agent": agent.id, "state": random.choice(STATES), "n": random.choice((0, 1, 2, 5)),
            "code": "x", "progress": 0.5, "eta_s": 3.0, "phase": "descending", "result": random.choice(RESULTS),
            "status": random.choice((None, status)),
        }  # fmt: skip

        share = random.choice((0.0, 0.03, 0.08))  # of more nearly all are refused at the wire

        def read(what: dict[str, Any], kind: type, check: Callable[[str, Any], Any]) -> Any:
            return check(agent.id, decode(spoilt(what, random, share).encode(), kind))

        match random.randrange(7):
            case 0 | 1:
                if random.random() < 0.3:
                    status["pose"] = msgspec.to_builtins(Position(1.0, 2.0, 60.0))
                return StatusArrived(read(status, AgentStatus, check_status))
            case 2 | 3:
                return GoalReported(read(event, GoalEvent, check_event))
            case 4:
                card = msgspec.to_builtins(agent.side.card)
                card["limits"] = dict.fromkeys(("speed_m_s", "climb_m_s", "hover_drain_pct_s", "landing_s"), 1.0)
                card["datum"] = random.choice(("local", "local", "msl"))
                return AgentSeen(read(card, AgentCard, check_card))
            case 5:
                told = {
                    "agent": agent.id,
                    "event": "sos",
                    "boot_id": "b",
                    "n": 1,
                    "stamp": 1,
                    "fields": {"at": {"east_m": 1}},
                }
                return EventArrived(read(told, AgentEvent, check_agent_event))
            case _:
                reply = spoilt({"boot_id": agent.side.card.boot_id, "goals": [event, event]}, random, share)
                decode(reply.encode(), GoalsReply)
                return read_reply(agent.id, "query", "", reply.encode())

    def happen(self) -> None:
        """Let one thing happen."""
        random, agent = self.random, self.random.choice(self.agents)
        kind = random.randrange(10)
        if kind < 6:
            try:
                event = self.message(agent)
            except WireError as error:
                event = BadMessage(agent.id, str(error))
            self.bench.hub.transport.arrived(event)
        elif kind == 6:
            what: Any = random.choice(("goal", "cancel", "query"))
            outcome: Any = random.choice(("unreachable", "unknown"))
            failed = SendFailed(agent.id, what, self.goal_id(), outcome, "t")
            self.bench.hub.transport.arrived(random.choice((AgentGone(agent.id), failed)))
        elif kind == 7:
            how: Any = random.choice(("hold", "return", "land", "release"))
            order: Any = random.choice(ORDERS)
            try:
                self.bench.ask(random.choice((Operator(order, agent.id, "eve"), LockdownOrder(how, "eve"))))
            except TaskError:
                return
        elif agent.side.active:
            agent.succeed(random.choice(RESULTS))

    def keep(self) -> None:
        """Put what was done since into a journal."""
        for step in self.bench.steps[self.kept :]:
            if self.thinner.keeps(step):
                self.codec.decode(self.codec.encode(step))
        self.kept = len(self.bench.steps)
        for block in self.thinner.blocks(self.bench.now, all_=True):
            pack(block.points)

    def run(self) -> Iterator[None]:
        for _ in range(MESSAGES):
            self.happen()
            self.bench.run_for(self.random.choice((0.05, 0.5, 3.0, 40.0)))
            self.keep()
            yield


@pytest.mark.parametrize("seed", [*range(12), 49])
def test_no_message_of_an_agent_ends_an_engine(seed: int) -> None:
    hostile = Hostile(seed)
    assert sum(1 for _ in hostile.run()) == MESSAGES
    hostile.codec.decode_state(hostile.codec.encode_state(hostile.bench.engine.state))
