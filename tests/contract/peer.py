"""A scripted agent for the conformance suite; what it does with a goal is told by the goal's fields.

    do          succeed | fail | reject | hold (until canceled) | takeover
    feedback    a list of progress values, one each `step_s`
    step_s      pace of the script (0.01)
    block_s     how long accepting takes
    cancel      "refuse": cancels are refused
    lose        true: the message with the result is lost
    result      the result of a success
    deaf_s      so long the wire carries nothing, either way, from a moment after the goal was taken on
    vanishes    true: its presence goes with the wire
    attach      a text: the bytes of a file `note.txt` that the result names; `bad_hash`: true names other bytes than are sent
    updates     true: the field `to` may be changed while it runs; the result of a success tells it as `to`

Run as a process it is an agent on the Zenoh wire: peer.py SITE ENDPOINT TYPE ID BOOT_ID LEASE_MS [KEYS]
"""

import heapq
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from formiga_bt.base.certificates import read_keys
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Position
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.attachments import Attachment, attachment_of
from formiga_bt.transport.base import AgentLink, SendsFiles
from formiga_bt.transport.messages import TERMINAL, AgentCard, AgentEvent, AgentStatus, GoalEvent, GoalRequest

STATUS_S = 0.1


class LossyLink:
    """Passes everything on but one result, when told so."""

    def __init__(self, link: AgentLink) -> None:
        self._link = link
        self.lose_result = False

    def publish_status(self, status: AgentStatus) -> None:
        self._link.publish_status(status)

    def publish_agent_event(self, event: AgentEvent) -> None:
        self._link.publish_agent_event(event)

    def publish_card(self, card: AgentCard) -> None:
        self._link.publish_card(card)

    def publish_event(self, event: GoalEvent) -> None:
        if self.lose_result and event.state in TERMINAL:
            self.lose_result = False
        else:
            self._link.publish_event(event)


class Wire(Protocol):
    """What a peer may break."""

    def cut(self, *, vanishes: bool) -> None: ...

    def mend(self) -> None: ...


class ScriptedBody:
    """Counts how often each goal was begun (told in `result.starts`), and follows the fields."""

    def __init__(
        self,
        link: LossyLink,
        wire: Wire,
        later: Callable[[float, Callable[[], None]], None],
        pause: Callable[[float], None],
    ):
        self.side: AgentSide
        self.wire = wire
        self.link = link
        self.later = later
        self.pause = pause
        self.starts: dict[str, int] = {}
        self.fields: dict[str, dict[str, Any]] = {}
        self.count: dict[str, int] = {}

    def start(self, request: GoalRequest) -> str:
        fields = request.fields
        if fields.get("block_s"):
            self.pause(fields["block_s"])
        if fields.get("do") == "reject":
            return "battery_low"
        goal = request.goal_id
        self.starts[goal] = self.starts.get(goal, 0) + 1
        self.fields[goal] = fields
        if fields.get("deaf_s"):
            self.later(0.1, lambda: self.wire.cut(vanishes=bool(fields.get("vanishes"))))
            self.later(0.1 + fields["deaf_s"], self.wire.mend)
        for level in fields.get("tell", ()):
            self.side.report_event("alarm", level=level)
        step = fields.get("step_s", 0.01)
        at = step
        for progress in fields.get("feedback", ()):
            self.later(at, lambda progress=progress: self.side.feedback(goal, progress=progress, phase="moving"))
            at += step
        self.later(at, lambda: self.end(goal))
        return ""

    def end(self, goal: str) -> None:
        fields = self.fields[goal]
        self.link.lose_result = bool(fields.get("lose"))
        match fields.get("do", "succeed"):
            case "succeed":
                self.side.set_status(position=Position(1.0, 2.0, 3.0), landed="airborne")
                told = {"to": fields["to"], "updates": self.count.get(goal, 0)} if fields.get("updates") else {}
                result = {**fields.get("result", {}), **told, "starts": self.starts[goal]}
                self.side.finish(goal, "succeeded", result=result, attachments=self.files(fields))
            case "fail":
                self.side.finish(goal, "failed", code="motor", text="the motor is hot")
            case "takeover":
                self.side.take_control("pilot")
                self.later(0.5, lambda: self.side.take_control("engine"))

    def update(self, goal: str, fields: dict[str, Any]) -> str:
        if not self.fields[goal].get("updates"):
            return "no_update"
        if list(fields) != ["to"]:
            return "bad_field"
        self.fields[goal] = {**self.fields[goal], **fields}
        self.count[goal] = self.count.get(goal, 0) + 1
        return ""

    def files(self, fields: dict[str, Any]) -> list[Attachment]:
        if "attach" not in fields:
            return []
        data = fields["attach"].encode()
        named = attachment_of("note.txt", data, "text/plain")
        sent = b"other" if fields.get("bad_hash") else data
        assert isinstance(self.wire, SendsFiles)
        self.wire.send_file(named.sha256, sent, lambda why: self.side.report_event("sent", why=why.partition(":")[0]))
        return [named]

    def watch_link(self) -> None:
        """Act by itself in the silence (it hovers), and yield when it is over."""
        if self.side.is_cut_off:
            self.side.take_control("failsafe")
        elif self.side.control == "failsafe":
            self.side.take_control("engine")

    def cancel(self, goal: str) -> bool:
        if self.fields[goal].get("cancel") == "refuse":
            return False
        self.later(0.02, lambda: self.side.finish(goal, "canceled"))
        return True


def card(agent_type: str, agent: str, boot_id: str) -> AgentCard:
    return AgentCard(id=agent, type=agent_type, boot_id=boot_id, actions=("Go", "Look"), limits={"speed_m_s": 10.0})


def main() -> None:
    from formiga_bt.transport.zenoh_agent import ZenohAgentLink

    site, endpoint, agent_type, agent, boot_id, lease_ms, *keys = sys.argv[1:]
    own = read_keys(Path(keys[0]), time.time(), agent) if keys else None
    parent = os.getppid()
    calls: list[tuple[float, int, Callable[[], None]]] = []

    def later(delay_s: float, call: Callable[[], None]) -> None:
        heapq.heappush(calls, (time.monotonic() + delay_s, len(calls), call))

    wire = ZenohAgentLink(site, connect=endpoint, lease_ms=int(lease_ms), keys=own)
    link = LossyLink(wire)
    body = ScriptedBody(link, wire, later, time.sleep)
    clock = lambda: time.monotonic_ns() // 1000  # noqa: E731
    body.side = AgentSide(card(agent_type, agent, boot_id), body, link, now=clock, beat_us=SECOND)

    def status() -> None:
        body.watch_link()
        body.side.publish_status(battery=80.0)
        later(STATUS_S, status)

    try:
        wire.serve(body.side)
        later(STATUS_S, status)
        while os.getppid() == parent:
            wire.pump(max(0.0, min(0.1, calls[0][0] - time.monotonic())) if calls else 0.1)
            while calls and calls[0][0] <= time.monotonic():
                heapq.heappop(calls)[2]()
    finally:
        wire.close()


if __name__ == "__main__":
    main()
