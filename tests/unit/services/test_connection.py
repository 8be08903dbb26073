"""Connections that say nothing, a byte a second, or read nothing are closed; and the local door."""

import asyncio
import contextlib
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from http.client import HTTPConnection
from inspect import iscoroutinefunction
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.engine.drivers.waiting import CALLER
from formiga_bt.services.http import server
from formiga_bt.services.http.connection import Connection, PhaseLimits
from formiga_bt.services.http.crowd import Crowd, DoorLimits
from formiga_bt.services.http.door import Door
from formiga_bt.services.http.local import LONGEST, close_local, open_local
from formiga_bt.services.http.urgent import is_urgent
from tests.e2e.rig import wait_until

pytestmark = pytest.mark.network
SHORT = PhaseLimits(head_s=0.1, body_s=0.1, idle_s=0.1, deaf_s=0.1)
GET = b"GET / HTTP/1.1\r\nHost: x\r\n\r\n"


class App:
    """An ASGI app that answers so many bytes, once `go` is set."""

    def __init__(self, size: int = 2) -> None:
        self.size = size
        self.go = threading.Event()
        self.go.set()
        self.bodies: list[bytes] = []

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        message, body = {"more_body": True}, b""
        while message.get("more_body"):
            message = await receive()
            if message["type"] == "http.disconnect":
                return
            body += message["body"]
        self.bodies.append(body)
        while not self.go.is_set():
            await asyncio.sleep(0.005)
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b"x" * self.size})


@contextlib.contextmanager
def serving(
    app: Any, *, places: DoorLimits | None = None, times: PhaseLimits = SHORT, sock: socket.socket | None = None
) -> Iterator[tuple[socket.socket, Crowd[Connection]]]:
    crowd: Crowd[Connection] = Crowd(places or DoorLimits(8, 6, 2))
    sock = sock if sock is not None else server.listen("127.0.0.1:0")
    served = server.HttpServer(app, sock, crowd, times)
    served.start()
    try:
        yield sock, crowd
    finally:
        served.stop()


def connected(sock: socket.socket, says: bytes = b"") -> socket.socket:
    made = socket.socket(sock.family)
    made.settimeout(10)
    made.connect(sock.getsockname())
    with contextlib.suppress(BrokenPipeError):  # it may be closed already by who does not let us in
        made.sendall(says)
    return made


def answer(made: socket.socket) -> bytes:
    """Return what comes until the other end closes."""
    found = b""
    with contextlib.suppress(ConnectionResetError):
        while part := made.recv(65536):
            found += part
    made.close()
    return found


@pytest.mark.parametrize(
    "says",
    [b"", b"GE", b"GET / HTTP/1.1\r\nHost: x\r\n", b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\n1"],
)
def test_who_does_not_come_to_the_end_of_a_request_is_closed(says: bytes) -> None:
    with serving(App()) as (sock, crowd):
        assert answer(connected(sock, says)) == b""
        wait_until(lambda: len(crowd) == 0)


def test_an_idle_connection_is_closed_after_its_answers() -> None:
    with serving(App()) as (sock, crowd):
        assert answer(connected(sock, GET + GET)).count(b"200 OK") == 2
        wait_until(lambda: len(crowd) == 0)


def test_a_request_that_is_worked_on_may_take_its_time() -> None:
    app = App()
    app.go.clear()
    with serving(app) as (sock, _):
        made = connected(sock, GET)
        wait_until(lambda: app.bodies)
        time.sleep(3 * SHORT.head_s)
        app.go.set()
        assert b"200 OK" in answer(made)


def test_a_reader_that_reads_nothing_is_closed() -> None:
    app = App(50_000_000)
    with serving(app) as (sock, crowd):
        made = connected(sock, GET)
        wait_until(lambda: app.bodies)
        wait_until(lambda: len(crowd) == 0)
        assert len(answer(made)) < app.size


def test_a_new_caller_is_served_however_many_hold_connections() -> None:
    with serving(App(), times=PhaseLimits()) as (sock, crowd):
        silent = [connected(sock) for _ in range(30)]
        for _ in range(5):
            connection = HTTPConnection(*sock.getsockname(), timeout=10)
            connection.request("GET", "/")
            assert connection.getresponse().status == 200
            connection.close()
        assert len(crowd) <= crowd.places.connections
        for one in silent:
            one.close()


def test_a_full_door_says_so() -> None:
    app = App()
    app.go.clear()
    with serving(app, places=DoorLimits(2, 1, 1), times=PhaseLimits()) as (sock, _):
        busy = [connected(sock, GET) for _ in range(2)]
        wait_until(lambda: len(app.bodies) == 2)
        assert b'"code":"crowded"' in answer(connected(sock))
        app.go.set()
        for one in busy:
            assert one.recv(100).startswith(b"HTTP/1.1 200")
            one.close()


def test_a_head_that_is_too_large_is_refused() -> None:
    app = App()
    with serving(app) as (sock, _):
        made = connected(sock)
        with contextlib.suppress(ConnectionError):
            for _ in range(100):
                made.sendall(b"GET / HTTP/1.1\r\nX: " + b"x" * 10_000)
        answer(made)
    assert not app.bodies


def test_a_body_that_breaks_off_is_no_body() -> None:
    """With what came of it, a press of lockdown or an abort would be taken for one without a body."""
    inside = App()
    door = Door(inside, token="t", needs_token=False, refusal=lambda *_: inside)
    with serving(door) as (sock, crowd):
        head = b"POST /v1/lockdown HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 50\r\n\r\n"
        connected(sock, head + b"{").close()
        wait_until(lambda: len(crowd) == 0)
        assert answer(connected(sock, head)) == b""
    assert inside.bodies == []


@pytest.mark.parametrize("when", ["at once", "while it waits"])
def test_who_orders_is_watched_until_the_answer(when: str) -> None:
    gone, begun = threading.Event(), threading.Event()

    async def app(scope: Any, receive: Any, send: Any) -> None:
        caller = CALLER.get()
        assert caller is not None
        caller.when_gone(gone.set)
        begun.set()
        await asyncio.to_thread(gone.wait, 10.0)

    door = Door(app, token="t", needs_token=False, refusal=lambda *_: app)
    with serving(door) as (sock, _):
        made = connected(sock, b"POST /v1/tasks HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 2\r\n\r\n{}")
        if when == "while it waits":
            assert begun.wait(10.0)
            assert not gone.is_set()
        made.close()
        assert begun.wait(10.0)
        assert gone.wait(5.0)


def test_the_local_door_is_of_this_user_alone(tmp_path: Path) -> None:
    sock, path = open_local(tmp_path)
    assert sock is not None
    assert Path(path) == tmp_path / "door"
    assert Path(path).stat().st_mode & 0o777 == 0o600
    with serving(App(), sock=sock):
        assert b"200 OK" in answer(connected(sock, GET))
    close_local(sock, path)
    assert not Path(path).exists()


def test_another_user_is_not_let_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sock, path = open_local(tmp_path)
    assert sock is not None
    app = App()
    with serving(app, sock=sock):
        monkeypatch.setattr(os, "geteuid", lambda: 12345)
        monkeypatch.setattr("formiga_bt.services.http.connection.peer_uid", lambda _: 54321)
        assert answer(connected(sock, GET)) == b""
    assert not app.bodies
    close_local(sock, path)


def test_a_long_path_goes_elsewhere(tmp_path: Path) -> None:
    runtime = tmp_path / ("long" * 30)
    runtime.mkdir()
    own = tmp_path / "r"
    own.mkdir()
    sock, path = open_local(runtime, {"XDG_RUNTIME_DIR": str(own)})
    assert sock is not None
    assert Path(path).parent == own / "formiga"
    assert len(os.fsencode(path)) < LONGEST
    assert Path(path).parent.stat().st_mode & 0o777 == 0o700
    close_local(sock, path)


def test_what_lies_in_the_way_does_not_keep_the_door_shut(tmp_path: Path) -> None:
    (tmp_path / "door").mkdir()
    sock, path = open_local(tmp_path, {"XDG_RUNTIME_DIR": ""})
    assert sock is not None
    assert Path(path).parent != tmp_path
    close_local(sock, path)


def test_a_folder_of_somebody_else_is_not_used(tmp_path: Path) -> None:
    runtime = tmp_path / ("long" * 30)
    runtime.mkdir()
    (tmp_path / "formiga").symlink_to(tmp_path)
    sock, path = open_local(runtime, {"XDG_RUNTIME_DIR": str(tmp_path)})
    assert sock is not None
    assert not path.startswith(str(tmp_path / "formiga"))
    close_local(sock, path)


@pytest.mark.parametrize(
    ("method", "path", "urgent"),
    [
        ("POST", "/v1/orders", True),
        ("POST", "/v1/agents/hwd_1/orders", True),
        ("POST", "/v1/tasks/PickUp-3/abort", True),
        ("DELETE", "/v1/tasks/PickUp-3", True),
        ("POST", "/v1/lockdown", True),
        ("POST", "/v1/agents/picker_1/events", True),
        ("GET", "/v1/lockdown", False),
        ("POST", "/v1/tasks", False),
        ("POST", "/v1/agents/hwd_1/orders/x", False),
        ("POST", "/v1/agents/hwd_1/handback", False),
    ],
)
def test_what_is_urgent(method: str, path: str, urgent: bool) -> None:
    assert is_urgent(method, path) is urgent


def test_each_route_that_is_urgent_runs_in_the_lane(start: Callable[..., Any]) -> None:
    from formiga_bt.services.http import api

    with start() as service:
        app = api.application(service.host)
    lane = {
        (method, route.path)
        for route in app.routes
        for method in getattr(route, "methods", ())
        if iscoroutinefunction(route.endpoint) and route.path.startswith("/v1/")
    }
    urgent = {
        (method, route.path)
        for route in app.routes
        for method in getattr(route, "methods", ())
        if is_urgent(method, route.path)
    }
    assert lane == urgent
    assert len(lane) == 9
