"""Stops get through: an engine with few descriptors, callers that take every place and say nothing, and stops beside them."""

import contextlib
import http.client
import json
import resource
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from formiga_bt.base.site_folder import EngineAddress
from tests.e2e.rig import wait_until
from tests.e2e.test_service import UP, Shell, new_site

pytestmark = pytest.mark.network
DESCRIPTORS = 256
CROWD = 600
HEAD = b"POST /v1/orders HTTP/1.1\r\nHost: 127.0.0.1\r\n"


class Narrow(Shell):
    """A terminal whose engine may have few descriptors."""

    def start(self, *words: str) -> "subprocess.Popen[str]":
        if words[: len(UP)] != UP:
            return super().start(*words)
        return subprocess.Popen(
            [sys.executable, *self.program, *words], cwd=self.folder, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, preexec_fn=few_descriptors,
        )  # fmt: skip


def few_descriptors() -> None:
    resource.setrlimit(resource.RLIMIT_NOFILE, (DESCRIPTORS, DESCRIPTORS))


@pytest.fixture
def narrow(tmp_path: Path) -> Iterator[Narrow]:
    folder = new_site(tmp_path).folder
    made = Narrow(folder)
    yield made
    made.close()


def callers(address: EngineAddress, count: int, *, says: bytes = b"", local: bool = False) -> list[socket.socket]:
    """Connect so many callers; each says this, and then nothing."""
    parts = urlsplit(address.url)
    made = []
    for _ in range(count):
        one = socket.socket(socket.AF_UNIX if local else socket.AF_INET)
        made.append(one)
        one.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            one.connect(address.socket if local else (parts.hostname, parts.port))
    for one in made:
        with contextlib.suppress(OSError):  # it is not let in yet, or was sent away
            one.send(says)
    return made


def close(crowd: list[socket.socket]) -> None:
    for one in crowd:
        one.close()


def land_all(narrow: Shell) -> float:
    """Give the order by the command line; return the seconds from its call to the acknowledgement."""
    began = time.monotonic()
    said = narrow.run("land", "--all")
    assert "there is nothing to do" in said or "land is ordered" in said, said
    return time.monotonic() - began


def land_all_over_http(address: EngineAddress) -> float:
    began = time.monotonic()
    parts = urlsplit(address.url)
    connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=30)
    connection.request("POST", "/v1/orders", json.dumps({"order": "land"}), {"Content-Type": "application/json"})
    answer = connection.getresponse()
    assert answer.status == 200, answer.read()
    connection.close()
    return time.monotonic() - began


def descriptors_of(engine: "subprocess.Popen[str]") -> int:
    return len(list(Path(f"/proc/{engine.pid}/fd").iterdir()))


def test_a_stop_gets_through_beside_600_half_open_connections(narrow: Narrow) -> None:
    address = narrow.up()
    crowd = callers(address, CROWD, says=HEAD)
    try:
        assert min(land_all(narrow) for _ in range(3)) < 2.0
        assert min(land_all_over_http(address) for _ in range(3)) < 2.0
        assert descriptors_of(narrow.engines[-1]) < DESCRIPTORS - 40
    finally:
        close(crowd)
    assert "the engine ends" in narrow.run("down", "--yes")


@pytest.mark.parametrize("says", [b"", HEAD, HEAD + b"Content-Length: 1000\r\n\r\n{"])
def test_a_stop_gets_through_a_crowd_at_the_local_door(narrow: Narrow, says: bytes) -> None:
    address = narrow.up()
    crowd = callers(address, CROWD, says=says, local=True)
    try:
        assert min(land_all(narrow) for _ in range(3)) < 2.0
    finally:
        close(crowd)


def test_a_stop_gets_through_beside_deaf_slow_and_large_callers(narrow: Narrow) -> None:
    address = narrow.up()
    deaf = callers(address, 200, says=b"GET /v1/events HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
    greedy = callers(address, 30, says=b"GET /v1/openapi.json HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 20)
    large = callers(address, 20, says=HEAD + b"X-Large: " + b"x" * 2_000_000)
    slow = callers(address, 50, says=HEAD + b"Content-Length: 100000000\r\n\r\n")
    done, calmer = threading.Event(), threading.Event()

    def drip() -> None:
        while not done.wait(1.0):
            for one in slow:
                with contextlib.suppress(OSError):
                    one.send(b"x")

    def hurry() -> None:
        while not done.is_set():
            close(callers(address, 20, says=b"GET /v1/health HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"))
            time.sleep(0.2 if calmer.is_set() else 0.01)

    threads = [threading.Thread(target=what) for what in (drip, hurry)]
    for thread in threads:
        thread.start()
    try:
        assert min(land_all(narrow) for _ in range(3)) < 2.0
        calmer.set()  # thousands of connections a second are more than one thread can answer: only the local door holds then
        land_all_over_http(address)
        assert descriptors_of(narrow.engines[-1]) < DESCRIPTORS - 40
    finally:
        done.set()
        for thread in threads:
            thread.join()
        close(deaf + greedy + large + slow)
    wait_until(lambda: descriptors_of(narrow.engines[-1]) < 120, what="descriptors are given back")
