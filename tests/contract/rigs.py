"""The same test on two wires: a rig starts peers, sends, and waits for what the transport reports.

Waiting is never a fixed sleep: in memory time jumps from call to call, on Zenoh the rig polls until a deadline.
"""

import itertools
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import peer as scripted

from formiga_bt.base.authority import issue, make_authority
from formiga_bt.base.certificates import About
from formiga_bt.base.clock import SECOND, Micros, VirtualScheduler, micros
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.attachments import check_bytes
from formiga_bt.transport.base import AgentTransport, TellsSite
from formiga_bt.transport.memory import MemoryHub, MemoryLink
from formiga_bt.transport.messages import (
    AgentGone,
    AgentSeen,
    ClockBeat,
    GoalEvent,
    GoalReported,
    GoalRequest,
    QueryReplied,
    SendFailed,
    SiteBase,
    SiteMessage,
    SitePoint,
    StatusArrived,
    TransportEvent,
    UpdateAnswered,
    UpdateReply,
    UpdateRequest,
)
from formiga_bt.transport.zenoh import ZenohTransport
from formiga_bt.transport.zenoh_router import Router
from formiga_bt.transport.zenoh_session import free_endpoint

DEADLINE_S = 15.0
REPLY_TIMEOUT_S = 1.0
LEASE_MS = 2500

T = TypeVar("T")


class Rig(ABC):
    transport: AgentTransport

    def __init__(self) -> None:
        self.log: list[TransportEvent] = []
        self.sent: dict[str, GoalRequest] = {}
        self._told: tuple[int, Micros] | None = None
        """The newest beat that was told, and when."""
        self.epoch = 1
        self._names = itertools.count(1)
        self._goals = itertools.count(1)
        self._boots = itertools.count(1)
        self.shelf = Shelf()

    # Peers.

    @abstractmethod
    def start(self, agent: str, boot_id: str) -> None: ...

    @abstractmethod
    def kill(self, agent: str) -> None: ...

    @abstractmethod
    def freeze(self, agent: str) -> None: ...

    @abstractmethod
    def thaw(self, agent: str) -> None: ...

    @abstractmethod
    def wait(self, found: Callable[[], T | None], what: str) -> T: ...

    def new_peer(self) -> str:
        agent = f"p{next(self._names)}"
        self.restart(agent)
        return agent

    def restart(self, agent: str) -> str:
        boot_id = f"boot{next(self._boots)}"
        mark = len(self.log)
        self.start(agent, boot_id)
        seen = self.event(AgentSeen, lambda e: e.card.id == agent and e.card.boot_id == boot_id, since=mark)
        assert "Go" in seen.card.actions
        return boot_id

    @abstractmethod
    def now(self) -> Micros: ...

    @property
    def beat(self) -> int:
        """The beat by now: an engine counts the seconds in which it told none, too, and so do its agents."""
        if self._told is None:
            return 0
        beat, at = self._told
        return beat + (self.now() - at) // SECOND

    # Talking.

    def goal(self, agent: str, goal_id: str = "", **more: Any) -> str:
        fields = {name: more.pop(name) for name in list(more) if name not in GoalRequest.__struct_fields__}
        goal_id = goal_id or f"Test-1/0/steps/steps[0].for#{next(self._goals)}"
        more = {"epoch": self.epoch, "beat": self.beat, "action": "Go", **more}
        self.sent[goal_id] = GoalRequest(goal_id=goal_id, agent=agent, fields=fields, **more)
        self.transport.send_goal(self.sent[goal_id])
        return goal_id

    def tell_site(self, **more: Any) -> SiteMessage:
        message = SiteMessage(**{
            "site": "hill", "version": "v1", "epoch": self.epoch, "base": SiteBase(66.5, 25.7, 120.0),
            "fence": (SitePoint(0.0, 0.0), SitePoint(9.0, 0.0), SitePoint(9.0, 9.0)), "transit_m": (60.0,), **more,
        })  # fmt: skip
        assert isinstance(self.transport, TellsSite)
        self.transport.publish_site(message)
        return message

    def clock(self, *, beats: int = 1) -> None:
        told = self.beat + beats
        self._told = (told, self.now())
        self.transport.publish_clock(
            ClockBeat(wall_us=0, engine_us=told * SECOND, speed=1.0, epoch=self.epoch, beat=told)
        )

    def clock_until_heard(self, agent: str, *, beats: int = 1) -> None:
        self.clock(beats=beats)
        assert self._told is not None
        told, _ = self._told
        self.event(StatusArrived, lambda e: e.status.id == agent and e.status.beat >= told)

    # Hearing.

    def take(self) -> None:
        self.log.extend(self.transport.poll())

    def event(
        self, kind: type[T] | tuple[type[T], ...], fits: Callable[[T], bool] = lambda _: True, *, since: int = 0
    ) -> T:
        def find() -> T | None:
            return next((e for e in self.log[since:] if isinstance(e, kind) and fits(e)), None)

        return self.wait(find, f"{kind} since {since}")

    def _telling(self) -> Sequence[TransportEvent]:
        """Return the newest events but for statuses, of which there are many."""
        return [event for event in self.log if not isinstance(event, StatusArrived)][-8:]

    def states(self, goal: str) -> list[GoalEvent]:
        return [e.event for e in self.log if isinstance(e, GoalReported) and e.event.goal_id == goal]

    def reported(self, goal: str, state: str, *, since: int = 0) -> GoalEvent:
        """Wait for a report; a goal that went unanswered, as on a busy machine, is sent again, as an engine does."""
        failed = len([one for one in self.log if self._is_failure(one, goal)])

        def find() -> GoalReported | None:
            nonlocal failed
            count = len([one for one in self.log if self._is_failure(one, goal)])
            if count > failed and goal in self.sent and not self.states(goal):
                failed = count
                self.transport.send_goal(self.sent[goal])
            return next(
                (
                    e
                    for e in self.log[since:]
                    if isinstance(e, GoalReported) and e.event.goal_id == goal and e.event.state == state
                ),
                None,
            )

        return self.wait(find, f"{state} of {goal} since {since}").event

    @staticmethod
    def _is_failure(event: TransportEvent, goal: str) -> bool:
        return isinstance(event, SendFailed) and event.goal_id == goal and event.what == "goal"

    def failure(self, goal: str, what: str = "goal") -> SendFailed:
        return self.event(SendFailed, lambda e: e.goal_id == goal and e.what == what)

    def query(self, agent: str, *goals: str) -> QueryReplied:
        mark = len(self.log)
        self.transport.query_goals(agent, goals)
        return self.event(QueryReplied, lambda e: e.agent == agent, since=mark)

    def update(self, agent: str, goal: str, n: int, **more: Any) -> UpdateReply:
        """Send an update as an engine does: again, as long as it goes unanswered."""
        fields = {name: more.pop(name) for name in list(more) if name not in UpdateRequest.__struct_fields__}
        more = {"epoch": self.epoch, "beat": self.beat, "action": "Go", **more}
        asked = UpdateRequest(goal_id=goal, agent=agent, n=n, fields=fields, **more)
        mark = len(self.log)
        self.transport.send_update(asked)
        failed = 0

        def find() -> UpdateReply | None:
            nonlocal failed
            count = sum(isinstance(e, SendFailed) and e.what == "update" for e in self.log[mark:])
            if count > failed:
                failed = count
                self.transport.send_update(asked)
            replies = (e.reply for e in self.log[mark:] if isinstance(e, UpdateAnswered))
            return next((one for one in replies if (one.goal_id, one.n) == (goal, n)), None)

        return self.wait(find, f"an answer to update {n} of {goal}")

    def gone(self, agent: str, *, since: int = 0) -> None:
        self.event(AgentGone, lambda e: e.agent == agent, since=since)


class Shelf:
    """Keeps the bytes of attachments."""

    def __init__(self) -> None:
        self.kept: dict[str, bytes] = {}

    def put(self, digest: str, data: bytes) -> None:
        check_bytes(digest, data)
        self.kept[digest] = data

    def get(self, digest: str) -> bytes | None:
        return self.kept.get(digest)


class MemoryWire:
    def __init__(self, hub: MemoryHub, link: MemoryLink) -> None:
        self._hub, self._agent, self._link = hub, link.agent, link

    def cut(self, *, vanishes: bool) -> None:
        self._hub.cut(self._agent, vanishes=vanishes)

    def mend(self) -> None:
        self._hub.mend(self._agent)

    def send_file(self, digest: str, data: bytes, done: Callable[[str], None]) -> None:
        self._link.send_file(digest, data, done)


class MemoryRig(Rig):
    def __init__(self) -> None:
        super().__init__()
        self.time = VirtualScheduler()
        self.hub = MemoryHub(
            self.time, reply_timeout_us=micros(REPLY_TIMEOUT_S), lease_us=LEASE_MS * 1000, delay_us=5_000
        )
        self.transport = self.hub.transport
        self.hub.transport.keep_files(self.shelf)
        self.transport.open(lambda: None)

    def now(self) -> Micros:
        return self.time.now()

    def later(self, delay_s: float, call: Callable[[], None]) -> None:
        self.time.call_at(self.time.now() + micros(delay_s), call)

    def start(self, agent: str, boot_id: str) -> None:
        wire = self.hub.link(agent)
        link = scripted.LossyLink(wire)
        broken = MemoryWire(self.hub, wire)
        body = scripted.ScriptedBody(link, broken, self.later, lambda s: self.hub.set_delay(agent, micros(s)))
        card = scripted.card("drone", agent, boot_id)
        body.side = AgentSide(card, body, link, now=self.time.now, beat_us=SECOND)

        def status() -> None:
            if not wire.dead:
                body.watch_link()
                body.side.publish_status(battery=80.0)
                self.later(scripted.STATUS_S, status)

        wire.serve(body.side)
        self.later(scripted.STATUS_S, status)

    def kill(self, agent: str) -> None:
        self.hub.kill(agent)

    def freeze(self, agent: str) -> None:
        self.hub.freeze(agent)

    def thaw(self, agent: str) -> None:
        self.hub.thaw(agent)

    def wait(self, found: Callable[[], T | None], what: str) -> T:
        deadline = self.time.now() + micros(DEADLINE_S)
        while True:
            self.take()
            if (value := found()) is not None:
                return value
            assert self.time.now() <= deadline, f"waited in vain for {what}: {self._telling()}"
            assert self.time.run_next(), f"nothing more will happen; waited for {what}: {self.log[-5:]}"

    def close(self) -> None:
        self.transport.close()


class ZenohRig(Rig):
    script = Path(scripted.__file__)
    """What its peers run."""

    def __init__(self) -> None:
        super().__init__()
        self.woken = threading.Event()
        self.site = f"{type(self).__name__}{os.getpid()}"
        self.zenoh = self.make_wire()
        self.transport = self.zenoh
        self.zenoh.keep_files(self.shelf)
        self.transport.open(self.woken.set)
        self.running: dict[str, subprocess.Popen[bytes]] = {}

    def make_wire(self) -> ZenohTransport:
        return ZenohTransport(self.site, listen="tcp/127.0.0.1:0", reply_timeout_s=REPLY_TIMEOUT_S, lease_ms=LEASE_MS)

    def more(self, agent: str) -> list[str]:
        """What else a peer is told."""
        return []

    def now(self) -> Micros:
        return time.monotonic_ns() // 1000

    def start(self, agent: str, boot_id: str) -> None:
        arguments = [self.site, self.zenoh.endpoint, "drone", agent, boot_id, str(LEASE_MS), *self.more(agent)]
        self.running[agent] = subprocess.Popen([sys.executable, str(self.script), *arguments])

    def kill(self, agent: str) -> None:
        process = self.running.pop(agent)
        process.kill()
        process.wait(5)

    def freeze(self, agent: str) -> None:
        self.running[agent].send_signal(signal.SIGSTOP)

    def thaw(self, agent: str) -> None:
        self.running[agent].send_signal(signal.SIGCONT)

    def wait(self, found: Callable[[], T | None], what: str) -> T:
        deadline = time.monotonic() + DEADLINE_S
        while True:
            self.woken.clear()
            self.take()
            if (value := found()) is not None:
                return value
            assert time.monotonic() < deadline, f"waited in vain for {what}: {self._telling()}"
            self.woken.wait(0.1)

    def close(self) -> None:
        for agent in tuple(self.running):
            self.kill(agent)
        self.transport.close()


class SecuredZenohRig(ZenohRig):
    """Engine and peers connect by TLS to a router with the site's rules."""

    PEERS = 60

    def make_wire(self) -> ZenohTransport:
        self.folder = tempfile.TemporaryDirectory(prefix="formiga-keys-")
        keys = Path(self.folder.name) / "keys"
        make_authority(keys, self.site, (), time.time())
        for number in range(1, self.PEERS + 1):
            issue(keys, f"p{number}", About(), time.time())
        endpoint = free_endpoint("tls/127.0.0.1:0")
        self.router = Router(self.site, keys, endpoint, simulation=False, tell=lambda _: None)
        self.router.open()
        return ZenohTransport(self.site, listen=endpoint, reply_timeout_s=REPLY_TIMEOUT_S, lease_ms=LEASE_MS, keys=keys)

    def more(self, agent: str) -> list[str]:
        return [str(Path(self.folder.name) / "keys" / agent)]

    def close(self) -> None:
        super().close()
        self.router.close()
        self.folder.cleanup()


class PlainZenohRig(ZenohRig):
    """Its peers are written from docs/wire.md alone."""

    script = Path(scripted.__file__).with_name("plain_peer.py")
