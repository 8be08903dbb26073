"""One HTTP connection: uvicorn's, with the time-outs that it lacks, and a place in the door's crowd.

uvicorn waits for ever for the head and the body of a request, and for readers that read nothing. Here each phase has its time:
who sends a byte a second, or nothing, is closed; so is a reader whose answer has not moved for `deaf_s`.
"""

import asyncio
import os
import socket
import struct
from typing import Any, Final

from msgspec import Struct
from uvicorn.protocols.http.h11_impl import H11Protocol

from formiga_bt.services.http.crowd import Crowd

HEAD_LIMIT: Final = 65_536
"""Bytes of a request's head: its line and its headers."""
_PEER: Final = struct.Struct("3i")
_FULL: Final = (
    b"HTTP/1.1 503 Service Unavailable\r\ncontent-type: application/problem+json\r\nretry-after: 2\r\nconnection: close\r\n\r\n"
    b'{"type":"about:blank","title":"Service Unavailable","status":503,"code":"crowded",'
    b'"text":"this door of the engine is full","help":"try again in some seconds","problems":[]}'
)


class PhaseLimits(Struct, frozen=True):
    """How long each phase of a connection may take, in seconds of wall time."""

    head_s: float = 5.0
    body_s: float = 20.0
    idle_s: float = 10.0
    """Between an answer and the next request."""
    deaf_s: float = 20.0
    """A reader that takes nothing meanwhile is closed."""


class Connection(H11Protocol):
    """A connection that keeps its times. `crowd` and `times` are set by `connection_class`."""

    crowd: Crowd["Connection"]
    times: PhaseLimits
    own_only: bool
    """Only processes of this user, and root's, may connect: the socket is a local one."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._phase = ""
        self._timer: asyncio.TimerHandle | None = None
        self._deaf: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a place, or have another connection give way."""
        super().connection_made(transport)
        sock = transport.get_extra_info("socket")
        if self.own_only and peer_uid(sock) not in (os.geteuid(), 0):
            self.cut()
            return
        if sock is not None and sock.family in (socket.AF_INET, socket.AF_INET6):
            milliseconds = int(self.times.deaf_s * 1000)
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, milliseconds)  # a peer that vanished
        gives_way = self.crowd.come(self)
        if gives_way is self:
            transport.write(_FULL)
            transport.close()
        elif gives_way is not None:
            gives_way.cut()
        self._enter("head")

    def connection_lost(self, exc: Exception | None) -> None:
        """Give the place back."""
        self._end_timers()
        self.crowd.leave(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take a part of a request."""
        if self._phase == "idle":
            self._enter("head")
        super().data_received(data)
        self._look()

    def on_response_complete(self) -> None:
        """Wait for the next request."""
        super().on_response_complete()
        self._look()

    def pause_writing(self) -> None:
        """The reader is slow: it has some time to go on."""
        super().pause_writing()
        self.crowd.stuck(self, is_stuck=True)
        if self._deaf is None:
            self._deaf = self.loop.call_later(self.times.deaf_s, self.cut)

    def resume_writing(self) -> None:
        """The reader goes on."""
        super().resume_writing()
        self.crowd.stuck(self, is_stuck=False)
        if self._deaf is not None:
            self._deaf.cancel()
            self._deaf = None

    def cut(self) -> None:
        """Close at once, whatever is under way."""
        self._end_timers()
        self.crowd.leave(self)
        self.transport.abort()

    def _look(self) -> None:
        """Enter the phase that the request is in, as h11 tells."""
        theirs = str(self.conn.their_state)
        if theirs == "SEND_BODY":
            self._enter("body")
        elif theirs != "IDLE":
            self._enter("busy")
        elif self._phase != "head":
            self._enter("idle")

    def _enter(self, phase: str) -> None:
        if phase == self._phase or self.transport.is_closing():
            return
        self._phase = phase
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if phase == "busy":
            self.crowd.busy(self)
            return
        self.crowd.wait(self)
        seconds = {"head": self.times.head_s, "body": self.times.body_s, "idle": self.times.idle_s}[phase]
        self._timer = self.loop.call_later(seconds, self.cut)

    def _end_timers(self) -> None:
        for timer in (self._timer, self._deaf):
            if timer is not None:
                timer.cancel()
        self._timer = self._deaf = None


def connection_class(crowd_: Crowd[Connection], times_: PhaseLimits, *, own_only_: bool) -> type[Connection]:
    """Return the class of the connections of one door."""

    class Mine(Connection):
        crowd = crowd_
        times = times_
        own_only = own_only_

    return Mine


def peer_uid(sock: Any) -> int:
    """Return the user of the process at the other end of a Unix socket; -1: it cannot be told."""
    try:
        told = sock.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _PEER.size)
    except (AttributeError, OSError):
        return -1
    return int(_PEER.unpack(told)[1])
