"""A whole service in this process: a real engine and driver, real HTTP on the loopback, machines that obey."""

import json
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.parse import quote
from urllib.request import Request, urlopen

import pytest

from formiga_bt.base.durable import private_folder
from formiga_bt.base.person_secrets import LEAST_N, Hashed, hashed, write_secret
from formiga_bt.cli.author.starts import start as first_file
from formiga_bt.cli.inputs import read_task, read_world
from formiga_bt.services.host import EngineHost
from tests.unit.services.wire import Wire

TREES = {
    "hello.yaml": first_file("hello"),
    "ask.yaml": """\
formiga: 1
task: Ask
aliases: [AskTask]
params: {word: {type: text, default: fine, aliases: [saying]}, height: {type: distance, default: 10 m}}
agents: {watcher: {type: watcher}}
steps:
  - ask: Is it good?
    of: [watcher]
    options: [yes_it_is, no_not_yet]
    expect: result.answer == 'yes_it_is'
    timeout: 30 min
  - notify: ${word} at ${height}
    to: [watcher]
""",
    "count.yaml": """\
formiga: 1
task: Count
agents: {watcher: {type: watcher}}
steps:
  - ask: How many are there, and where?
    of: [watcher]
    form: {many: {type: int, min: 0}, spot: place}
    timeout: 30 min
    save_as: seen
  - check: seen.many == 7 and distance(seen.spot, base) > 1 m
""",
    "stay.yaml": """\
formiga: 1
task: Stay
agents: {watcher: {type: watcher}}
steps: [{wait: 1 h}]
""",
    "sos.yaml": """\
formiga: 1
task: Sos
agents: {picker: {type: picker}}
steps: [{wait_for: picker.sos, timeout: 1 h}]
""",
    "heavy.yaml": """\
formiga: 1
task: Heavy
params: {robot: {type: agent, of: [hwd], optional: true}}
agents: {drone: {type: hwd, id: "${robot}"}}
steps: [{wait: 1 s}]
""",
}


class Service:
    """A running host, and a plain HTTP client of it."""

    def __init__(self, host: EngineHost, wire: Wire) -> None:
        self.host, self.wire = host, wire
        self.url = host.address.url
        self.headers = {"Content-Type": "application/json"}
        """Of every request; a site in mode real wants its token."""
        if host.site.mode == "real":
            token = (host.runtime_folder / "token").read_text(encoding="ascii").strip()
            self.headers["Authorization"] = f"Bearer {token}"

    def call(self, method: str, path: str, body: Any = None, headers: dict[str, str] | None = None) -> tuple[int, Any]:
        """Return status and JSON of an answer. A body of bytes goes as it is; whoever approves says their secret."""
        person = (
            path.split("/")[3] if path.endswith("/duty") else body["by"] if path == "/v1/approvals" and body else ""
        )
        if person:
            headers = {"Formiga-Secret": quote(secret_of(person)), **(headers or {})}
        data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        made = Request(f"{self.url}{path}", data, {**self.headers, **(headers or {})}, method=method)
        try:
            with urlopen(made, timeout=20) as answer:
                text = answer.read()
                is_json = answer.headers.get_content_type() == "application/json"
                return answer.status, json.loads(text) if is_json else text.decode()
        except HTTPError as error:
            with error:
                return error.code, json.loads(error.read())

    def get(self, path: str) -> Any:
        status, found = self.call("GET", path)
        assert status == 200, found
        return found

    def post(self, path: str, body: Any = None, **headers: str) -> Any:
        status, found = self.call("POST", path, body, headers)
        assert status in (200, 201), found
        return found

    def refused(self, method: str, path: str, body: Any = None, headers: dict[str, str] | None = None) -> Any:
        status, found = self.call(method, path, body, headers)
        assert status >= 400, found
        assert found["status"] == status
        assert set(found) >= {"code", "text", "help"}
        return found

    def submit(self, task: str, **params: Any) -> str:
        return str(self.post("/v1/tasks", {"task": task, "params": params})["id"])

    def task(self, task_id: str) -> Any:
        """Return everything about a task, with the fields of its fact beside the others."""
        detail = self.get(f"/v1/tasks/{task_id}")
        return {**detail, **detail["task"]}

    def ends(self, task_id: str) -> Any:
        self.wait(lambda: self.task(task_id)["ended_at"])
        return self.task(task_id)

    def codes(self, task_id: str) -> list[str]:
        return [b["code"] for b in self.get(f"/v1/tasks/{task_id}/why")["because"]]

    @staticmethod
    def wait(is_met: Callable[[], Any], within_s: float = 10.0) -> None:
        until = time.monotonic() + within_s
        while not is_met():
            assert time.monotonic() < until, "waited in vain"
            time.sleep(0.01)


Start = Callable[..., AbstractContextManager[Service]]


@pytest.fixture
def start(tmp_path: Path) -> Start:
    """Start a service in `tmp_path`; options go to `EngineHost`."""
    return starter(tmp_path)


REAL = "people: {watchers: [watcher_1], approvers: [ann, bob]}\npilots: [{id: pia, max_airborne: 1}]\n"


def make_real(tmp_path: Path) -> None:
    """Let the site of a folder be in mode real, with two approvers and a pilot."""
    file = tmp_path / "site.yaml"
    text = file.read_text(encoding="utf-8").replace("mode: simulation", "mode: real")
    file.write_text(text.replace("people: {watchers: [watcher_1]}\n", REAL), encoding="utf-8")
    folder = tmp_path / ".formiga" / "meadow"
    private_folder(folder)
    for person in ("ann", "bob", "pia"):
        write_secret(folder, person, cheap(secret_of(person)))


def secret_of(person: str) -> str:
    """Return the secret that `make_real` sets."""
    return f"{person}'s own, with ä % and blanks"


@cache
def cheap(secret: str) -> Hashed:
    """Return a hash that costs as little as is taken."""
    return hashed(secret, (LEAST_N, 8, 1))


def starter(tmp_path: Path) -> Start:
    """Return what starts a service in a folder; options go to `EngineHost`."""
    (tmp_path / "site.yaml").write_text(first_file("site").replace("@site", "meadow"), encoding="utf-8")

    @contextmanager
    def begin(*, auto: bool = True, **options: Any) -> Iterator[Service]:
        world = read_world((), tmp_path / "site.yaml")
        assert world.site is not None
        tasks = {}
        for name, text in TREES.items():
            (tmp_path / name).write_text(text, encoding="utf-8")
            read = read_task(tmp_path / name, world)
            assert read.task is not None, read.diagnostics
            tasks[read.task.name] = read.task
        wire = Wire(auto=auto)
        options = {"http": "127.0.0.1:0", "desk": {"watcher_1": "watcher"}, "speed": 20.0, **options}
        with EngineHost(world.site, world.catalogue, tasks, beside=tmp_path, wires=[wire], **options) as host:
            service = Service(host, wire)
            wire.add("lwd_1", "lwd", world.site.ports["p1"].at)
            service.wait(lambda: len(service.get("/v1/agents")["agents"]) >= 2)
            service.wait(lambda: service.get("/v1/agents")["agents"][0]["at"])
            yield service

    return begin


@pytest.fixture
def service(start: Start) -> Iterator[Service]:
    with start() as running:
        yield running
