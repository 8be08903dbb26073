"""News of a real engine to a real receiver: how soon they are there, and that none is lost while receiver and engine die.

Three processes: `formiga up`, this one (which makes news by lockdown, acknowledgement and release, and receives them), and
nothing between them. First each news' time from its cause to its arrival. Then news are made while nobody receives, the engine
is killed (-9) meanwhile; the receiver comes back, and while it receives the engine is killed again. At the end the ids that
came are compared with the outbox of the journal.

python benchmarks/bench_news.py [--news 10000] [--timed 500]
"""

import argparse
import json
import os
import signal
import socket
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from http.client import HTTPConnection, HTTPException
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from msgspec import Struct
from standardwebhooks import Webhook

from formiga_bt.base.site_folder import EngineAddress, find_engines
from formiga_bt.cli.author.starts import start as first_file
from formiga_bt.journal.store import Journal
from formiga_bt.services.news.message import id_of, name_of

SECRET = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw"
CHANNEL = "news:\n  room: {webhook: {url: {file: room.url}, secret: {file: room.secret}, private: true}}\n"
EACH = 3
"""News of one round: a lockdown is raised, acknowledged, cleared."""


class Came(Struct):
    """What one `webhook-id` brought."""

    bodies: set[bytes]
    times: int
    late_s: float
    """From its cause to its first arrival."""


class Receiver:
    """Receives at one port; may go and come back. What it got stays."""

    def __init__(self) -> None:
        self.got: dict[str, Came] = {}
        self.dead_after: int | None = None
        """It answers no more after so many."""
        self._lock = threading.Lock()
        self._server: ThreadingHTTPServer | None = None
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]

    def begin(self) -> None:
        """Listen."""
        take, signer = self._take, Webhook(SECRET)

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"
            disable_nagle_algorithm = True

            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["content-length"]))
                signer.verify(body, dict(self.headers.items()))
                take(self.headers["webhook-id"], body)
                self.wfile.write(b"HTTP/1.1 204 No Content\r\ncontent-length: 0\r\n\r\n")

            def log_message(self, *_: Any) -> None:
                pass

        class Server(ThreadingHTTPServer):
            daemon_threads = True

            def handle_error(self, *_: Any) -> None:
                pass  # the engine was killed

        self._server = Server(("127.0.0.1", self.port), Handler)
        threading.Thread(target=lambda: self._server and self._server.serve_forever(0.05), daemon=True).start()

    def end(self) -> None:
        """Be dead."""
        if self._server is not None:
            self._server.shutdown()
            self._server.server_close()
            self._server = None

    def _take(self, ident: str, body: bytes) -> None:
        now = time.time()
        with self._lock:
            known = self.got.get(ident)
            if known is None:
                self.got[ident] = Came({body}, 1, now - _seconds(json.loads(body)["timestamp"]))
            else:
                known.bodies.add(body)
                known.times += 1


class Engine:
    """`formiga up` of a folder, again and again."""

    def __init__(self, folder: Path, receiver: Receiver) -> None:
        self.folder = folder
        site = first_file("site").replace("@site", "meadow")
        (folder / "site.yaml").write_text(f"{site}\n{CHANNEL}", encoding="utf-8")
        for name, text in {"room.url": f"http://127.0.0.1:{receiver.port}/hook", "room.secret": SECRET}.items():
            (folder / name).write_text(text, encoding="utf-8")
            (folder / name).chmod(0o600)
        self._process: subprocess.Popen[bytes] | None = None
        self._http: HTTPConnection | None = None

    def begin(self) -> None:
        """Start it, and wait until it serves."""
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        with (self.folder / "engine.log").open("ab") as log:
            words = [
                sys.executable,
                "-m",
                "formiga_bt",
                "up",
                "--http",
                f"127.0.0.1:{port}",
                "--listen",
                "tcp/127.0.0.1:0",
            ]
            self._process = subprocess.Popen(words, cwd=self.folder, stdout=log, stderr=log)
        until = time.monotonic() + 60
        while not (found := self._address()) or found.pid != self._process.pid:
            if self._process.poll() is not None or time.monotonic() > until:
                raise RuntimeError((self.folder / "engine.log").read_text()[-3000:])
            time.sleep(0.05)
        self._hang_up()
        self._http = HTTPConnection("127.0.0.1", port, timeout=20)

    def _address(self) -> EngineAddress | None:
        return next(iter(find_engines(self.folder)), None)

    def call(self, path: str, body: dict[str, Any]) -> Any:
        """POST; return the answer's body."""
        assert self._http is not None
        self._http.request("POST", path, json.dumps(body), {"content-type": "application/json"})
        with self._http.getresponse() as answer:
            found = answer.read()
            if answer.status != 200:
                raise RuntimeError(f"{path}: {answer.status} {found.decode()}")
        return json.loads(found)

    def alarms(self) -> list[dict[str, Any]]:
        assert self._http is not None
        self._http.request("GET", "/v1/alarms")
        with self._http.getresponse() as answer:
            found: list[dict[str, Any]] = json.loads(answer.read())["alarms"]
        return found

    def make(self, rounds: int, pause_s: float = 0.0) -> int:
        """Make news; return how many rounds were answered in full."""
        for number in range(rounds):
            try:
                self.call("/v1/lockdown", {"how": "hold", "by": "bench"})
                (alarm,) = [one["id"] for one in self.alarms() if one["code"] == "lockdown"]
                self.call(f"/v1/alarms/{alarm}/ack", {"by": "bench"})
                self.call("/v1/lockdown", {"how": "release", "by": "bench"})
            except (OSError, HTTPException):
                return number
            time.sleep(pause_s)
        return rounds

    def _hang_up(self) -> None:
        if self._http is not None:
            self._http.close()

    def kill(self) -> None:
        """Kill it, as `kill -9` does."""
        assert self._process is not None
        os.kill(self._process.pid, signal.SIGKILL)
        self._process.wait()

    def end(self) -> None:
        """Let it end."""
        self._hang_up()
        if self._process is not None and self._process.poll() is None:
            self._process.terminate()
            self._process.wait(30)


class Survived(Struct, frozen=True):
    """What came of news that were made while everybody died."""

    answered: int
    """News whose orders were answered."""
    in_outbox: int
    came: int
    """Ids that came at least once."""
    doubles: int
    """Messages that came again."""
    lost: int
    """Ids of the outbox that never came."""
    changed: int
    """Ids that came with two bodies."""
    took_s: float


def timed(engine: Engine, receiver: Receiver, news: int) -> list[float]:
    """Return how late each news arrived, in seconds."""
    receiver.begin()
    engine.begin()
    engine.make(news // EACH, pause_s=0.02)
    wait(lambda: len(receiver.got) >= news // EACH * EACH)
    engine.end()
    receiver.end()
    found = [one.late_s for one in receiver.got.values()]
    receiver.got.clear()
    return found


def survive(engine: Engine, receiver: Receiver, news: int) -> Survived:
    """Make news while nobody receives, kill the engine while they are made and while they are told; return what came of it."""
    began = time.monotonic()
    rounds, answered = -(-news // EACH), 0
    engine.begin()
    threading.Timer(0.5 + rounds * 0.004, engine.kill).start()
    answered += engine.make(rounds)
    engine.end()
    engine.begin()
    for one in engine.alarms():  # what was under way when it was killed
        if one["code"] == "lockdown":
            engine.call("/v1/lockdown", {"how": "release"})
    answered += engine.make(rounds - answered)
    receiver.begin()
    wait(lambda: len(receiver.got) >= news // 3, 120)
    engine.kill()
    engine.begin()
    expected = outbox(engine.folder)
    wait(lambda: set(expected) <= set(receiver.got), 300)
    time.sleep(2)
    engine.end()
    receiver.end()
    lost = set(expected) - set(receiver.got)
    return Survived(
        answered=answered * EACH, in_outbox=len(expected), came=len(receiver.got),
        doubles=sum(one.times - 1 for one in receiver.got.values()), lost=len(lost),
        changed=sum(len(one.bodies) > 1 for one in receiver.got.values()), took_s=time.monotonic() - began,
    )  # fmt: skip


def outbox(folder: Path) -> list[str]:
    """Return the ids of all news that the journal of a site holds, without those of the engine that this is."""
    from formiga_bt.base.site_folder import SiteFolder

    engine = name_of(SiteFolder(folder, "meadow").engine_id())
    found = []
    with Journal(folder / ".formiga" / "meadow" / "journal.db", "meadow", read_only=True) as journal:
        for urgent in (True, False):
            after = 0
            while items := journal.news(after, urgent=urgent, most=1000):
                found += [id_of(one, engine) for one in items]
                after = items[-1].seq
    return found


def wait(met: Callable[[], bool], within_s: float = 60.0) -> None:
    """Wait until something is so; whoever counts sees it if it never is."""
    until = time.monotonic() + within_s
    while not met() and time.monotonic() < until:
        time.sleep(0.05)


def _seconds(text: str) -> float:
    from datetime import datetime

    return datetime.fromisoformat(text).timestamp()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--news", type=int, default=10_000)
    parser.add_argument("--timed", type=int, default=500)
    given = parser.parse_args()
    for name, act in (("timed", timed), ("survive", survive)):
        with TemporaryDirectory() as folder:
            receiver = Receiver()
            engine = Engine(Path(folder), receiver)
            found = act(engine, receiver, getattr(given, "timed" if name == "timed" else "news"))
        if isinstance(found, Survived):
            print(f"{found.answered} news whose orders were answered, {found.in_outbox} in the outbox")
            print(
                f"{found.came} came, {found.lost} lost, {found.doubles} doubles of the same id, {found.changed} changed"
            )
            print(f"in {found.took_s:.0f} s")
        else:
            late = statistics.quantiles((one * 1000 for one in found), n=100)
            print(f"{len(found)} news: p50 {late[49]:.1f} ms, p99 {late[98]:.1f} ms, most {max(found) * 1000:.1f} ms")


if __name__ == "__main__":
    main()
