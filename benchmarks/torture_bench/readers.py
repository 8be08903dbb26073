"""Readers of all kinds on a live journal: every verb that looks at the past, HTTP, plain SQLite; and outsiders.

Those copy, vacuum and checkpoint it. One plain reader is a process of its own that opens, reads and closes the journal all
the time.
"""

import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from random import Random
from typing import Final

from .client import Client
from .engine import pythons

VERBS: Final = tuple(
    tuple(line.split("|"))
    for line in (
        "journal|stats", "journal|export|-o|{tmp}|--force", "replay|--text", "replay|--task|{task}|--text", "map|--all",
        "map|--all|--at|-2 min", "stats", "stats|--at|-1 min", "why|{task}", "why|{task}|--at|-1 min", "show|{task}|--at|-30 s",
        "show|{task}", "gantt|--all", "gantt|{task}|--at|-1 min", "log|export", "map|{task}",
    )
)  # fmt: skip
ROUTES: Final = (
    "/v1/past", "/v1/past?at=-1%20min", "/v1/past/timeline", "/v1/past/chart", "/v1/past/stats", "/v1/past/tasks/{task}",
    "/v1/tasks/{task}/why", "/v1/tasks/{task}", "/v1/stats", "/v1/now?over=true", "/v1/chart", "/v1/timeline",
    "/v1/tasks/{task}/picture", "/v1/health", "/v1/agents/lwd_1/why",
)  # fmt: skip
PLAIN: Final = """\
import sqlite3, sys, time
db = sqlite3.connect(sys.argv[1], timeout=0.2)
try:
    tables = [r[0] for r in db.execute("select name from sqlite_master where type = 'table'")]
    for name in tables:
        db.execute(f'select count(*) from "{name}"').fetchone()
    time.sleep(float(sys.argv[2]))
except sqlite3.Error as error:
    print("plain reader:", error)
db.close()
"""
LOOP: Final = """\
import random, select, sqlite3, sys, time
dice, done = random.Random(sys.argv[2]), 0
while not select.select([sys.stdin], [], [], dice.uniform(0.0, float(sys.argv[3])))[0]:
    try:
        db = sqlite3.connect(f"file:{sys.argv[1]}?mode=rw", uri=True, timeout=0.1)
        try:
            db.execute("select count(*) from sqlite_master").fetchone()
            done += 1
        finally:
            db.close()
    except sqlite3.Error:
        pass
print(done)
"""
VACUUM: Final = """\
import sqlite3, sys
db = sqlite3.connect(sys.argv[1], timeout=0.5)
try:
    db.execute(sys.argv[2])
except sqlite3.Error as error:
    print("outsider:", error)
db.close()
"""
TAKES_S: Final = 180.0


class Readers:
    """Reads in a thread of its own until it is closed.

    Args:
        client: of the engine.
        folder: the site's.
        seed: of what is read when.
        pause_s: between two.
        quick: more plain readers and HTTP, fewer commands: each of those costs a second of a core.
    """

    def __init__(self, client: Client, folder: Path, *, seed: int, pause_s: float = 0.3, quick: bool = False) -> None:
        self._client, self._folder, self._random = client, folder, Random(seed)
        self._pause_s, self._quick = pause_s, quick
        self._closing = threading.Event()
        self.done: Counter[str] = Counter()
        self.bugs: list[str] = []
        self._looping: subprocess.Popen[str] | None = None
        self._thread = threading.Thread(target=self._run, name="readers", daemon=True)

    def __enter__(self) -> "Readers":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End; may be called twice."""
        self._closing.set()
        self._thread.join(TAKES_S + 5)
        if self._looping is not None:
            said, _ = self._looping.communicate("")
            self._looping = None
            self.done["plain, in a loop"] += int(said.strip() or 0)

    @property
    def journal(self) -> Path:
        """Return the journal's file."""
        return next((self._folder / ".formiga").glob("*/journal.db"), self._folder / "none.db")

    def _run(self) -> None:
        while not self._closing.wait(self._random.uniform(0.2, 1.8) * self._pause_s):
            self.read()
            if self._looping is None and self.journal.exists():
                self._looping = subprocess.Popen(
                    [sys.executable, "-c", LOOP, str(self.journal), str(self._random.random()), "0.2"],
                    stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                )  # fmt: skip

    def read(self) -> None:
        """Read in one way."""
        dice = self._random.random()
        if dice < (0.8 if self._quick else 0.45):
            self.http(self._random.choice(ROUTES[:6] if self._quick else ROUTES))
        elif dice < (0.88 if self._quick else 0.6):
            self.plain()
        elif dice < (0.95 if self._quick else 0.7):
            self.outsider()
        else:
            self.verb(self._random.choice(VERBS))

    def _task(self) -> str:
        tasks = self._client.tasks()
        return self._random.choice(tasks) if tasks else "Look-1"

    def http(self, route: str) -> None:
        """Ask the engine for the past."""
        self._client.ask(route.replace("{task}", self._task()), within_s=10.0)
        self.done["http"] += 1

    def plain(self) -> None:
        """Read with SQLite, from a process of its own."""
        self._python("plain", PLAIN, f"{self._random.choice((0.0, 0.0, 0.05, 0.4))}")

    def outsider(self) -> None:
        """Copy, back up, vacuum or checkpoint the journal from outside."""
        what = self._random.choice(
            ("cp", "cp", "vacuum", "pragma wal_checkpoint(truncate)", "pragma wal_checkpoint(passive)")
        )
        if what == "cp":
            subprocess.run(
                ["cp", str(self.journal), str(self._folder / "copy.db")],
                capture_output=True,
                check=False,
                timeout=TAKES_S,
            )
            self.done["copy"] += 1
        else:
            self._python(what.split("(")[0], VACUUM, what)

    def _python(self, name: str, script: str, *words: str) -> None:
        if self.journal.exists():
            try:
                subprocess.run(
                    [sys.executable, "-c", script, str(self.journal), *words],
                    capture_output=True, check=False, timeout=TAKES_S,
                )  # fmt: skip
            except subprocess.TimeoutExpired:
                self.bugs.append(f"{name} of the journal did not end within {TAKES_S:g} s")
            self.done[name] += 1

    def verb(self, words: Sequence[str]) -> None:
        """Let a command look at the past; a traceback is a bug."""
        task = self._task()
        full = [word.replace("{task}", task).replace("{tmp}", str(self._folder / "export")) for word in words]
        began = time.monotonic()
        try:
            ran = subprocess.run(
                [sys.executable, "-m", "formiga_bt", *full],
                cwd=self._folder, env=pythons(), stdin=subprocess.DEVNULL,
                capture_output=True, text=True, check=False, timeout=TAKES_S,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            self.bugs.append(f"formiga {' '.join(full)} did not end within {TAKES_S:g} s")
            return
        self.done[f"formiga {words[0]}"] += 1
        if "Traceback (most recent call last)" in ran.stderr + ran.stdout or ran.returncode < 0:
            said = f"{ran.stdout[-300:]}{ran.stderr[-1200:]}"
            self.bugs.append(
                f"formiga {' '.join(full)} after {time.monotonic() - began:.1f} s, status {ran.returncode}: {said}"
            )
