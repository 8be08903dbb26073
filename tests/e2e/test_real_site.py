"""A site in mode real by the commands alone: approve at a terminal, a pilot on duty, fly, kill the engine in flight, export."""

import csv
import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.error import HTTPError
from urllib.parse import quote
from urllib.request import Request, urlopen

import pytest

from agents_sim.launch import FleetProcesses
from formiga_bt.cli.inputs import read_world
from formiga_bt.rehearsal.rehearsal import fleet_of
from tests.e2e.terminal import at_terminal
from tests.e2e.test_service import Shell, wait_for_agents

pytestmark = pytest.mark.network
REAL = "people: {watchers: [watcher_1], approvers: [ann, bob]}\npilots: [{id: pia, max_airborne: 1}]\n"


FAST = (
    "from formiga_bt.cli import main; from formiga_bt.cli.operator import up; up.gaps = lambda site, speed: []\n"
    "from formiga_bt.services import beginning; beginning.follows_wall = lambda site: False\n"
    "main()"
)
"""`formiga`, but a real site may have a clock of another speed: the drones of this test are simulated."""


@pytest.fixture
def field(tmp_path: Path) -> Iterator[Shell]:
    made = Shell(tmp_path)
    made.run("init", "field")
    made.folder = tmp_path / "field"
    made.program = ("-c", FAST)
    file = made.folder / "site.yaml"
    text = file.read_text(encoding="utf-8").replace(":7447", ":0").replace("mode: simulation", "mode: real")
    assert "people: {watchers: [watcher_1]}\n" in text
    file.write_text(text.replace("people: {watchers: [watcher_1]}\n", REAL), encoding="utf-8")
    yield made
    made.close()


SECRET = "a word of their own"


def set_secrets(field: Shell, *people: str) -> None:
    """Set the secrets of people, as a script does."""
    file = field.folder / "secret"
    file.write_text(SECRET + "\n")
    file.chmod(0o600)
    field.environment["FORMIGA_NEW_SECRET_FILE"] = str(file)
    for person in people:
        assert f"the secret of {person} is set" in field.run("access", "secret", person)
    del field.environment["FORMIGA_NEW_SECRET_FILE"]


def wait(is_met: Callable[[], object], within_s: float = 40.0) -> None:
    until = time.monotonic() + within_s
    while not is_met():
        assert time.monotonic() < until, "waited in vain"
        time.sleep(0.2)


def approve(field: Shell, task: str, by: str, secret: str = SECRET) -> str:
    code, shown = at_terminal(
        field.folder, "approve", task, "--by", by,
        until=r"digest.*: $", types=lambda shown: shown.split("digest  ")[1][:8],
        then=[(f"Secret of {by}: $", secret)],
    )  # fmt: skip
    assert (code == 0) == (secret == SECRET), shown
    assert SECRET not in shown
    return shown


def status(url: str, path: str, token: str = "", body: object = None, **headers: str) -> int:
    """Return the status of a request as any program may send it."""
    words = {**headers, **({"Authorization": f"Bearer {token}"} if token else {}), "Content-Type": "application/json"}
    data = None if body is None else json.dumps(body).encode()
    try:
        with urlopen(Request(url + path, data, words), timeout=20) as answer:
            return int(answer.status)
    except HTTPError as error:
        with error:
            return error.code


def test_a_program_of_this_machine_neither_flies_nor_approves(field: Shell) -> None:
    """Over HTTP on the loopback any program could: no token was asked for, and `by` was what it said."""
    address = field.up()
    runtime = field.folder / ".formiga/field"
    token = (runtime / "token").read_text().strip()
    for path in ("/v1/health", "/v1/tasks", "/v1/openapi.json", "/v1/events"):
        assert status(address.url, path) == 401
    assert status(address.url, "/v1/tasks", body={"task": "Hello"}) == 401
    assert status(address.url, "/v1/lockdown", body={}) == 401
    assert "LOCKDOWN" in field.run("lockdown", "--land"), "at the local door"
    assert "released" in field.run("lockdown", "release")

    set_secrets(field, "ann", "pia")
    assert (runtime / "secrets.json").stat().st_mode & 0o777 == 0o600
    approvals = f"{address.url}/v1/approvals"
    with urlopen(Request(approvals, headers={"Authorization": f"Bearer {token}"}), timeout=20) as answer:
        (digest,) = [one["digest"] for one in json.load(answer)["tasks"] if one["task"] == "Hello"]
    body = {"task": "Hello", "by": "ann", "digest": digest, "typed": digest[:8]}
    assert status(address.url, "/v1/approvals", token, body) == 403
    assert status(address.url, "/v1/approvals", token, body, **{"Formiga-Secret": "guessed by a program"}) == 403
    assert status(address.url, "/v1/pilots/pia/duty", token, {"on": True}) == 403
    assert "with a secret of pia's own" in field.run("duty", "pia", "on", code=1)
    assert "nothing is approved" in field.run("approve", "--list")
    assert "that is not the secret of ann" in approve(field, "Hello", "ann", "not what it is")
    assert "is approved by ann" in approve(field, "Hello", "ann")
    assert status(address.url, "/v1/pilots/pia/duty", token, {"on": True}, **{"Formiga-Secret": quote(SECRET)}) == 200
    assert "the engine ends" in field.run("down", "--yes")
    assert "the wire is not checked" in field.ended()
    assert not [one for one in runtime.rglob("*") if one.is_file() and SECRET.encode() in one.read_bytes()]


def test_from_not_approved_to_a_flight_in_the_log(field: Shell, tmp_path: Path) -> None:
    set_secrets(field, "ann", "pia")
    address = field.up("--desk", "watcher_1")
    world = read_world((), field.folder / "site.yaml")
    assert world.site is not None
    specs = [spec for spec in fleet_of(world.site, world.catalogue) if spec.id != "watcher_1"]
    with FleetProcesses(specs, site=world.site.name, connect=address.endpoint, state_dir=tmp_path / "sim"):
        wait_for_agents(field, 5)
        said = field.run("run", "Hello", code=1)
        assert "is not approved as it is now; an approver (ann, bob) must: formiga approve Hello --by NAME" in said
        assert "is approved by ann" in approve(field, "Hello", "ann")
        assert "Hello" in field.run("approve", "--list")

        field.run("run", "Hello", "--param", "target=lake_shore")
        wait(lambda: "nobody of pia is on duty" in field.run("why", "Hello-1"))
        field.environment["FORMIGA_SECRET"] = SECRET
        assert "pia is on duty" in field.run("duty", "pia", "on")
        wait(lambda: "1 of 1" in field.run("duty", "--list"))
        assert "Hello-1 SUCCEEDED" in field.run("run", "Hello", "--follow").replace("Hello-2", "Hello-1")

        (first, second) = csv.DictReader(field.run("log", "export").splitlines())
        assert (first["task"], second["task"]) == ("Hello-1", "Hello-2")
        assert (first["pilot"], first["mode"], first["landed_by"]) == ("pia", "real", "task")
        assert float(first["battery_used_percent"]) > 1.0

        field.run("run", "Hello")  # and now the engine dies while it flies
        flying = field.folder / ".formiga/field/flying.json"
        wait(lambda: json.loads(flying.read_text(encoding="utf-8")))
        os.kill(field.engines[-1].pid, signal.SIGKILL)
        field.engines[-1].wait()
        lines = field.run("log", "export").splitlines()
        assert len(lines) == 4
        (under_way,) = [row for row in csv.DictReader(lines) if not row["landing_utc"]]
        assert (under_way["task"], under_way["pilot"]) == ("Hello-3", "pia")

        field.up()
        assert "ann" in field.run("approve", "--list")
        said = field.run("duty", "--list")
        assert "pia    on" in said  # the engine was away for a moment only, and what flew is still watched
        assert "the engine ends" in field.run("down", "--yes")
