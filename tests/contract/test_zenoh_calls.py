"""Programs that call services, on real Zenoh: keys, wildcards, sizes, a crowd, who is stuck, and the end of the engine."""

import json
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from formiga_bt.transport.calls import Call, CallError
from formiga_bt.transport.codec import FRAME_LIMIT
from formiga_bt.transport.zenoh import ZenohTransport
from formiga_bt.transport.zenoh_calls import THREADS, WAITING
from formiga_bt.transport.zenoh_session import close_session, open_session

pytestmark = pytest.mark.network

SITE = "callsite"


class Desk:
    """Answers with what was called; `hold` keeps it from answering."""

    services = ("shop/buy", "shop/stop")
    urgent = ("shop/stop",)

    def __init__(self) -> None:
        self.calls: list[Call] = []
        self.hold = threading.Event()
        self.hold.set()

    def answer(self, call: Call) -> bytes | CallError:
        self.calls.append(call)
        if call.service not in self.urgent:
            self.hold.wait(20.0)
        if call.payload == b"no":
            return CallError("no", "it is refused", "say yes", ("yes",))
        if call.payload == b"bug":
            raise ValueError("a bug")
        return json.dumps([call.principal, call.service, call.payload.decode()]).encode()


class Wire:
    """A transport with a desk, and a program that calls it."""

    def __init__(self, *, bare: bool) -> None:
        self.desk = Desk()
        self.transport = ZenohTransport(SITE, listen="tcp/127.0.0.1:0")
        self.transport.serve_calls(self.desk, bare=bare)
        self.transport.open(lambda: None)
        self.session = open_session("client", SITE, connect=[self.transport.endpoint])

    def call(self, key: str, payload: bytes = b"", timeout_s: float = 5.0) -> list[Any]:
        found = []
        for reply in self.session.get(key, payload=payload, timeout=timeout_s):
            if reply.ok is not None:
                assert str(reply.ok.key_expr) == key
            text = (reply.ok or reply.err).payload.to_bytes()
            found.append(json.loads(text) if text.startswith((b"[", b"{")) else text.decode())
        return found

    def close(self) -> None:
        self.desk.hold.set()
        close_session(self.session)
        self.transport.close()


@pytest.fixture
def wire() -> Iterator[Wire]:
    found = Wire(bare=True)
    yield found
    found.close()


def test_the_key_says_who_and_what(wire: Wire) -> None:
    assert wire.call("svc/ann/shop/buy", b"x") == [["ann", "shop/buy", "x"]]
    assert wire.call("shop/buy", b"x") == [["", "shop/buy", "x"]]
    assert wire.call("shop/buy") == [["", "shop/buy", ""]]
    assert wire.call("svc/ann/shop/sell") == []
    assert wire.call("shop/buy", b"no") == [
        {"code": "no", "text": "it is refused", "help": "say yes", "near": ["yes"], "problems": []}
    ]


def test_bare_names_are_not_there_where_they_are_not_open() -> None:
    wire = Wire(bare=False)
    try:
        assert wire.call("shop/buy", b"x", 1.0) == []
        assert wire.call("svc/ann/shop/buy", b"x") == [["ann", "shop/buy", "x"]]
    finally:
        wire.close()


@pytest.mark.parametrize("key", ["svc/*/shop/buy", "svc/ann/**", "**", "svc/ann/shop/*", "*/buy", "shop/b$*"])
def test_a_look_at_many_keys_orders_nothing(wire: Wire, key: str) -> None:
    found = wire.call(key, b"x")
    assert {one["code"] for one in found if isinstance(one, dict)} == {"bad_key"}
    assert wire.desk.calls == []


def test_what_is_too_large_and_a_bug_are_told_and_harm_nobody_else(wire: Wire) -> None:
    assert wire.call("shop/buy", b"x" * (FRAME_LIMIT + 1))[0]["code"] == "too_large"
    for _ in range(THREADS + 1):
        assert wire.call("shop/buy", b"bug")[0]["code"] == "bug"
    assert wire.call("shop/buy", b"x") == [["", "shop/buy", "x"]]


def test_a_crowd_is_sent_away_and_what_stops_something_gets_through(wire: Wire) -> None:
    wire.desk.hold.clear()
    codes: list[Any] = []
    crowd = 2 * (WAITING + THREADS)
    for number in range(crowd):
        wire.session.get(
            "svc/eve/shop/buy", lambda reply: codes.append(reply), payload=str(number).encode(), timeout=20.0
        )
    end = time.monotonic() + 10.0
    while len(codes) < crowd - WAITING - THREADS and time.monotonic() < end:
        time.sleep(0.01)
    assert len(codes) >= crowd - WAITING - THREADS
    assert {json.loads(one.err.payload.to_bytes())["code"] for one in codes} == {"crowded"}
    assert wire.call("svc/ann/shop/stop", b"now") == [["ann", "shop/stop", "now"]]
    wire.desk.hold.set()
    while len(codes) < crowd and time.monotonic() < end + 10.0:
        time.sleep(0.01)
    assert sum(one.ok is not None for one in codes) >= WAITING, "who waited was answered"


def test_an_engine_that_ends_leaves_nobody_waiting_for_long(wire: Wire) -> None:
    wire.desk.hold.clear()
    got: list[Any] = []
    done = threading.Event()
    for _ in range(THREADS + 10):
        wire.session.get("shop/buy", got.append, payload=b"x", timeout=8.0)
    while len(wire.desk.calls) < THREADS:
        time.sleep(0.01)
    began = time.monotonic()
    threading.Thread(target=lambda: (wire.transport.close(), done.set()), daemon=True).start()
    wire.desk.hold.set()
    assert done.wait(10.0)
    assert time.monotonic() - began < 6.0
