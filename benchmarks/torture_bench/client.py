"""A client of one engine: requests, stops, aborts, and a journal of its own of all that was acknowledged to it.

That journal (`acknowledged.jsonl` in the site's folder) is what the judge believes; what the engine says of itself is not.
"""

import json
import threading
import time
from collections.abc import Mapping, Sequence
from http.client import HTTPException
from pathlib import Path
from random import Random
from typing import Any, Final
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import msgspec
from msgspec import Struct

from .engine import Engine
from .site import TREES, WORK

WAITS_S: Final = 8.0
STOPS: Final = ("hold", "return", "land")


class Ack(Struct, frozen=True, omit_defaults=True):
    """What an engine said yes to."""

    wall: float
    """When its answer was read, seconds since 1970."""
    took_s: float
    kind: str
    """task, abort, stop, release (of any stop), clear, load, lockdown."""
    target: str
    agents: tuple[str, ...] = ()
    """Of a stop: who got it."""
    word: str = ""


class Said(Struct, frozen=True):
    """An answer."""

    status: int
    """0: none came."""
    body: Any
    took_s: float

    @property
    def ok(self) -> bool:
        return 200 <= self.status < 300


class Client:
    """Works with an engine through HTTP.

    Args:
        engine: whose.
        folder: where the journal of what was acknowledged goes.
        seed: of what it does.
        most_open: so many tasks of its own are open at once.
    """

    def __init__(self, engine: Engine, folder: Path, *, seed: int = 0, most_open: int = 3) -> None:
        self._engine, self._random, self._most_open = engine, Random(seed), most_open
        self._file = (folder / "acknowledged.jsonl").open("ab", buffering=0)
        self._lock = threading.Lock()
        self.acks: list[Ack] = []
        self.bugs: list[str] = []
        """Answers that no engine should give: status 500."""
        self.slowest_s = 0.0
        self._requested = 0
        self._release_at: dict[str, float] = {}
        self.open: list[dict[str, Any]] = []
        """The open tasks, as the engine last said."""

    def close(self) -> None:
        """Close the journal."""
        self._file.close()

    # -- one request -------------------------------------------------------------------------------------------------
    def ask(self, path: str, body: Mapping[str, Any] | None = None, within_s: float = WAITS_S) -> Said:
        """Send a request; status 0 if there was no answer."""
        url, began = self._engine.url, time.monotonic()
        if not url:
            return Said(0, None, 0.0)
        data = None if body is None else json.dumps(body).encode()
        request = Request(f"{url}{path}", data, {"Content-Type": "application/json"})
        try:
            with urlopen(request, timeout=within_s) as answer:
                said = Said(answer.status, json.loads(answer.read()), time.monotonic() - began)
        except HTTPError as error:
            with error:
                text = error.read().decode("utf-8", "replace")
            said = Said(error.code, _json(text), time.monotonic() - began)
            if error.code == 500:
                self.bugs.append(f"{path} {body or ''}: {text[:600]}")
        except (OSError, ValueError, HTTPException):  # it died, or stands still
            said = Said(0, None, time.monotonic() - began)
        return said

    def note(self, kind: str, target: str, said: Said, agents: Sequence[str] = (), word: str = "") -> None:
        """Write down what was acknowledged."""
        ack = Ack(time.time(), round(said.took_s, 3), kind, target, tuple(agents), word)
        with self._lock:
            self.acks.append(ack)
            self._file.write(msgspec.json.encode(ack) + b"\n")

    # -- words -------------------------------------------------------------------------------------------------------
    def request(self, task: str, params: Mapping[str, Any], within_s: float = WAITS_S) -> str:
        """Request a task; return its id, or nothing."""
        said = self.ask("/v1/tasks", {"task": task, "params": dict(params)}, within_s)
        if not said.ok:
            return ""
        self.note("task", said.body["id"], said, word=task)
        return str(said.body["id"])

    def abort(self, task: str) -> bool:
        """Abort a task."""
        said = self.ask(f"/v1/tasks/{task}/abort", {})
        if said.ok:
            self.note("abort", task, said)
        return said.ok

    def order(self, where: str, order: str, within_s: float = WAITS_S) -> Said:
        """Give an order to an agent (`agents/lwd_1`), a task (`tasks/Look-1`) or all (empty)."""
        said = self.ask(f"/v1/{where}/orders" if where else "/v1/orders", {"order": order, "by": "bench"}, within_s)
        if said.ok:
            who = [one["who"] for one in said.body["ordered"]]
            fresh = [] if said.body["stands_already"] else who
            kind = "stop" if order in STOPS else "release"
            self.note(kind, where, said, fresh if kind == "stop" else who, order)
        return said

    def lockdown(self, how: str) -> bool:
        """Press or release lockdown."""
        said = self.ask("/v1/lockdown", {"how": how, "by": "bench"})
        if said.ok:
            released = how == "release"
            self.note("release" if released else "lockdown", "", said, word=how)
        return said.ok

    def load(self, path: str, task: str = "Look", wait: str = "3 s", name: str = "Glance") -> Said:
        """Load a task from a path, under a name of its own; it runs nothing."""
        text = next(text for text in TREES.values() if f"\ntask: {task}\n" in text).replace(
            "wait: 2 s", f"wait: {wait}"
        )
        text = text.replace(f"\ntask: {task}\n", f"\ntask: {name}\n")
        said = self.ask("/v1/library", {"file": path, "texts": {path: text}, "by": "bench"})
        if said.ok:
            self.note("load", path, said, word=task)
        return said

    def known(self) -> set[str] | None:
        """Return the ids of the tasks that the engine knows, None if it does not say."""
        said = self.ask("/v1/tasks?limit=10000")
        return {task["id"] for task in said.body["tasks"]} if said.ok else None

    def tasks(self) -> list[str]:
        """Return the ids of the tasks that were acknowledged."""
        return [ack.target for ack in list(self.acks) if ack.kind == "task"]

    # -- work --------------------------------------------------------------------------------------------------------
    def work(self) -> None:
        """Do what comes next: request, stop, abort, release, and undo what holds up the work."""
        self.tend()
        if len(self.open) < self._most_open:
            task, params = WORK[(self._requested + self._random.randrange(3)) % len(WORK)]
            self._requested += 1
            self.request(task, params)
        dice = self._random.random()
        if dice < 0.04 and self.open:
            self.abort(self._random.choice(self.open)["id"])
        elif dice < 0.12:
            self._stop_something()
        elif dice < 0.13 and not self._release_at:
            if self.lockdown(self._random.choice(STOPS)):
                self._release_at["lockdown"] = time.monotonic() + self._random.uniform(2.0, 6.0)
        elif dice < 0.16:
            folder = self._random.choice(("trees", "trees/q.yaml", "trees/a b", "trees/x.yaml/y.yaml", "trees/.x"))
            self.load(f"{folder}/look.yaml", wait=f"{self._random.randint(1, 9)} s")

    def _stop_something(self) -> None:
        busy = [task for task in self.open if task["agents"]]
        dice = self._random.random()
        if dice < 0.5 and busy:
            where = f"agents/{self._random.choice(self._random.choice(busy)['agents'])}"
        elif dice < 0.8 and busy:
            where = f"tasks/{self._random.choice(busy)['id']}"
        else:
            where = ""
        if self.order(where, self._random.choice(STOPS)).ok:
            self._release_at[where] = time.monotonic() + self._random.uniform(2.5, 8.0)

    def tend(self) -> None:
        """Look what is open, release what was stopped long enough, hand back, clear."""
        for where, at in list(self._release_at.items()):
            if time.monotonic() >= at and self._let_go(where):
                del self._release_at[where]
        said = self.ask("/v1/tasks?status=open")
        if not said.ok:
            return
        self.open = said.body["tasks"]
        self.slowest_s = max(self.slowest_s, said.took_s)
        for task in self.open:
            if "resume" in task["held"]:
                self.order(f"tasks/{task['id']}", "continue")

    def _let_go(self, where: str) -> bool:
        if where == "lockdown":
            return self.lockdown("release")
        said = self.order(where, "continue")
        return said.status != 0

    def heal(self, *, abort: bool) -> list[dict[str, Any]] | None:
        """Let everything go on, hand back, clear, and perhaps abort what is open; return what is open, None: no answer."""
        for where in list(self._release_at):
            if self._let_go(where):
                del self._release_at[where]
        said, agents = self.ask("/v1/tasks?status=open"), self.ask("/v1/agents")
        if not said.ok or not agents.ok:
            return None
        self.open = said.body["tasks"]
        if said.body["lockdown"]["on"]:
            self.lockdown("release")
        for agent in agents.body["agents"]:
            self._heal_agent(agent)
        for task in self.open:
            if task["held"]:
                self.order(f"tasks/{task['id']}", "continue")
            if abort and task["status"] != "ENDING":
                self.abort(task["id"])
        return self.open

    def _heal_agent(self, agent: Mapping[str, Any]) -> None:
        path = f"/v1/agents/{agent['id']}"
        if agent["taken"] and agent["control"] == "engine":
            said = self.ask(
                f"{path}/handback", {"how": "return" if agent["landed"] == "airborne" else "end", "by": "bench"}
            )
            if said.ok:
                self.note("release", f"agents/{agent['id']}", said, [agent["id"]], "handback")
        if agent["quarantine"] or agent["rebooted"]:
            said = self.ask(f"{path}/clear", {"by": "bench"})
            if said.ok:
                self.note("clear", f"agents/{agent['id']}", said, [agent["id"]])
        if agent["order"]:
            self.order(f"agents/{agent['id']}", "continue")


def _json(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return {}
