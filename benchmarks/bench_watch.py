"""What `formiga watch` costs with 1,000 active tasks: percent of a core, of the watch and of the engine that answers it.

The watch runs on a pseudo terminal of 200 x 60, as at a person's desk. Twice: against a real engine with so many active tasks,
each of which wakes every 10 s, and against a scripted site with as many machines, in which every row changes at every look.
Processor time is that of the processes, from /proc. The engine's share is with the watch less without it.

    python benchmarks/bench_watch.py [--tasks N] [--seconds S] [--json FILE]
"""

import argparse
import fcntl
import json
import os
import pty
import struct
import subprocess
import sys
import tempfile
import termios
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import msgspec

from formiga_bt.base.site_folder import find_engines
from formiga_bt.client import Client, connect
from formiga_bt.show.facts import AgentFact, LineFact, Now, TaskFact, Top

TASK = """\
formiga: 1
task: Tick
steps:
  - repeat: 100000
    steps:
      - wait: 10 s
timeout: 10 h
"""
S = 1_000_000
TICKS = os.sysconf("SC_CLK_TCK")
FORMIGA = (sys.executable, "-m", "formiga_bt")


def spent_s(pid: int) -> float:
    """Return the processor time that a process has used."""
    words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / TICKS


@contextmanager
def watch(folder: Path, *words: str) -> Iterator[tuple[int, list[int]]]:
    """Run the watch on a terminal; yields its process, and how many bytes it has written."""
    leader, follower = pty.openpty()
    fcntl.ioctl(follower, termios.TIOCSWINSZ, struct.pack("HHHH", 60, 200, 0, 0))
    process = subprocess.Popen(
        [*FORMIGA, "watch", *words], cwd=folder, stdin=follower, stdout=follower, stderr=follower,
        env={**os.environ, "TERM": "xterm-256color"}, start_new_session=True,
    )  # fmt: skip
    os.close(follower)
    written = [0]

    def read() -> None:
        try:
            while part := os.read(leader, 65536):
                written[0] += len(part)
        except OSError:
            return

    threading.Thread(target=read, daemon=True).start()
    try:
        yield process.pid, written
    finally:
        os.write(leader, b"q")
        try:
            process.wait(10)
        finally:
            process.kill()
            process.wait()
            os.close(leader)


def share(pid: int, seconds: float) -> float:
    """Return the percent of a core that a process uses in the next seconds."""
    before, start = spent_s(pid), time.monotonic()
    time.sleep(seconds)
    return 100 * (spent_s(pid) - before) / (time.monotonic() - start)


def against_an_engine(tasks: int, seconds: float) -> dict[str, float]:
    """Measure with a real engine."""
    with tempfile.TemporaryDirectory() as name:
        subprocess.run([*FORMIGA, "init", "meadow"], cwd=name, check=True, capture_output=True)
        folder = Path(name) / "meadow"
        site = folder / "site.yaml"
        site.write_text(site.read_text(encoding="utf-8").replace(":7447", ":0"), encoding="utf-8")
        (folder / "trees" / "tick.yaml").write_text(TASK, encoding="utf-8")
        engine = subprocess.Popen(
            [*FORMIGA, "up", "--http", "127.0.0.1:0"], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        try:
            until = time.monotonic() + 60
            while not find_engines(folder) and time.monotonic() < until:
                time.sleep(0.1)
            client: Client = connect(site)
            for _ in range(tasks):
                client.request("Tick")
            while client.now(count=1).counts.get("ACTIVE", 0) < tasks:
                time.sleep(0.2)
            time.sleep(2)
            alone = share(engine.pid, seconds)
            with watch(folder) as (pid, written):
                time.sleep(5)
                first, start, used = spent_s(pid), time.monotonic(), spent_s(engine.pid)
                bytes_ = written[0]
                time.sleep(seconds)
                took = time.monotonic() - start
                return {
                    "watch_percent": 100 * (spent_s(pid) - first) / took,
                    "engine_percent": 100 * (spent_s(engine.pid) - used) / took - alone,
                    "bytes_a_second": (written[0] - bytes_) / took,
                }
        finally:
            engine.terminate()
            engine.wait(30)


def scripted(turn: int, tasks: int, first: int, count: int) -> Now:
    """Return a site in which every row changes at every look."""
    at = 10_000 * S + turn * S
    page = range(first, min(tasks, first + count))
    return Now(
        site="meadow", at=at, top=Top(airborne=tasks, alarms=turn % 3), counts={"ACTIVE": tasks}, total=tasks, questions=(),
        tasks=tuple(
            TaskFact(
                id=f"PickUp-{n}", name="PickUp", status="ACTIVE", agents=(f"hwd_{n}",), doing=f"hwd_{n} GoTo {turn % 100} %",
                urgent_at=at + (n + 60) * S, urgent="timeout",
            )
            for n in page
        ),
        agents=tuple(
            AgentFact(
                id=f"hwd_{n}", type="hwd", pool="ASSIGNED", liveness="ALIVE", control="engine", landed="airborne",
                task=f"PickUp-{n}", action="GoTo", battery=float((n + turn) % 100),
            )
            for n in range(tasks)
        ),
        lines=tuple(LineFact(at=at - n * S, text=f"PickUp-{n} ACTIVE", task=f"PickUp-{n}") for n in range(50)),
    )  # fmt: skip


def against_a_script(tasks: int, seconds: float) -> dict[str, float]:
    """Measure with a site that changes everywhere, all the time."""
    turns = iter(range(1_000_000_000))

    class Answers(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            query = {name: values[0] for name, values in parse_qs(urlsplit(self.path).query).items()}
            text = msgspec.json.encode(
                scripted(next(turns), tasks, int(query.get("first", 0)), int(query.get("count", 100)))
            )
            self.send_response(200)
            self.send_header("Content-Length", str(len(text)))
            self.end_headers()
            self.wfile.write(text)

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Answers)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        with watch(Path("/"), "--url", f"http://127.0.0.1:{server.server_port}", "--read-only") as (pid, written):
            time.sleep(5)
            bytes_, start = written[0], time.monotonic()
            asked = next(turns)
            percent = share(pid, seconds)
            return {
                "watch_percent": percent,
                "looks": next(turns) - asked - 1,
                "bytes_a_second": (written[0] - bytes_) / (time.monotonic() - start),
            }
    finally:
        server.shutdown()
        server.server_close()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    found = {
        "tasks": given.tasks,
        "engine": against_an_engine(given.tasks, given.seconds),
        "every_row_changes": against_a_script(given.tasks, given.seconds),
    }
    for name in ("engine", "every_row_changes"):
        one = found[name]
        more = f", the engine {one['engine_percent']:.1f} % for its answers" if "engine_percent" in one else ""
        words = "a real engine" if name == "engine" else f"{given.tasks:,} machines, every row changes"
        print(
            f"{given.tasks:,} active tasks, {words}: watch {one['watch_percent']:.1f} % of a core{more},"
            f" {one['bytes_a_second'] / 1000:.1f} kB/s to the terminal"
        )
    if given.json:
        given.json.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
