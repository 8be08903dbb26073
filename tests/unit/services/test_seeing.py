"""What is seen, through HTTP: the same as from the fold itself; addresses, tokens and ids that are wrong say so."""

import http.server
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest
from py_trees.blackboard import Blackboard as PyTreesBlackboard
from py_trees.display import unicode_blackboard

from formiga_bt.base.errors import FormigaError, TaskError, UnusableFile
from formiga_bt.cli.author import show
from formiga_bt.cli.operator import why
from formiga_bt.cli.options import connect_source
from formiga_bt.client import ApiError, Client, NoEngine, connect
from formiga_bt.engine.kernel.changes import TaskPut
from formiga_bt.engine.kernel.records import TaskTimes
from formiga_bt.show.why.text import in_words
from tests.golden import Wording, timeless
from tests.unit.services.conftest import Service, starter
from tests.unit.services.fakes import task
from tests.unit.services.test_view import step

pytestmark = pytest.mark.network
HOSTILE = ("../health", "a/b", "%2e%2e", "x\x1b[31m", "Ask-1'--", "x" * 3000, "Ünï", "?over=1", "#", " ")


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    with starter(tmp_path_factory.mktemp("seeing"))() as running:
        running.submit("Ask")
        running.submit("Stay")
        running.wait(lambda: running.get("/v1/inbox")["questions"])
        yield running


@pytest.fixture
def remote(service: Service, monkeypatch: pytest.MonkeyPatch) -> Client:
    for name in ("FORMIGA_URL", "FORMIGA_TOKEN", "FORMIGA_TOKEN_FILE"):
        monkeypatch.delenv(name, raising=False)
    return connect_source(url=service.url)


def still(service: Service, one: Any, other: Any) -> tuple[Any, Any]:
    """Return two answers of the same state: nothing was folded between them."""
    state = service.host.view.state
    for _ in range(100):
        before = state.seq, state.now
        first, second = one(), other()
        if (state.seq, state.now) == before:
            return first, second
    raise AssertionError("the engine never stood still")


# -- equal answers -----------------------------------------------------------------------------------------------------
def test_the_site_a_task_time_space_and_figures_are_the_same_through_http(
    service: Service, remote: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    near = service.host.source
    for clock in ("_clock", "_wall", "_ahead"):
        monkeypatch.setattr(near, clock, lambda: 0)  # the engine's time is that of its last step then

    answers: list[tuple[Any, Any]] = [
        (near.now, remote.now),
        (lambda: near.now(first=1, count=1, find="st"), lambda: remote.now(first=1, count=1, find="st")),
        (lambda: near.now(over=True), lambda: remote.now(over=True)),
        (lambda: near.task("Ask-1"), lambda: remote.task("Ask-1")),
        (near.timeline, remote.timeline),
        (lambda: near.timeline(["Ask-1", "Stay-2"]), lambda: remote.timeline(["Ask-1", "Stay-2"])),
        (near.chart, remote.chart),
        (lambda: near.stats(hours=1.0), lambda: remote.stats(hours=1.0)),
    ]
    for one, other in answers:
        here, there = still(service, one, other)
        assert here == there


def test_the_blackboard_is_the_engines_and_is_shown_to_py_trees_own_tools(
    service: Service, remote: Client, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("storage", "metadata"):
        monkeypatch.setattr(PyTreesBlackboard, name, {})
    here, there = still(
        service, lambda: service.host.source.blackboard("/fleet/lwd/"), lambda: remote.blackboard("/fleet/lwd/")
    )

    assert there.keys == msgspec.to_builtins(here.keys)
    assert {key.split("/")[3] for key in there.keys} == {"lwd_1"}
    assert remote.blackboard("/tasks/").keys == {"/tasks/Ask-1/status": "ACTIVE", "/tasks/Stay-2/status": "ACTIVE"}
    assert set(remote.blackboard("/allocation/").keys) == {"/allocation/grants/Ask-1", "/allocation/grants/Stay-2"}

    there.show_in_py_trees()
    assert "/fleet/lwd/lwd_1/liveness" in unicode_blackboard()

    with pytest.raises(UnusableFile, match="/fleet/"):
        show.command("/flet/", blackboard=True, url=service.url)
    show.command("/tasks/", blackboard=True, url=service.url)
    assert capsys.readouterr().out.splitlines() == ['/tasks/Ask-1/status  "ACTIVE"', '/tasks/Stay-2/status  "ACTIVE"']


@pytest.mark.parametrize("of", ["Ask-1", "Stay-2", "lwd_1", "watcher_1"])
def test_an_explanation_is_the_same_through_http(service: Service, remote: Client, of: str) -> None:
    def plain(found: Any) -> Any:
        headline, lines = found
        return headline, [(one.code, one.hint, one.depth) for one in lines]

    assert plain(remote.why(of)) == plain(service.host.source.why(of))


def test_the_page_says_what_the_site_does(remote: Client) -> None:
    found = remote.now()

    assert (found.site, found.engine, found.total, found.top.needs_you) == ("meadow", "ok", 2, 1)
    assert [one.number for one in found.questions] == ["Q1"]
    assert remote.task("Ask-1").drawing.task == "Ask"


# -- the command -------------------------------------------------------------------------------------------------------
def test_why_by_an_address_is_the_text_that_the_facts_make(
    service: Service, remote: Client, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    why.command("Ask-1", url=service.url)

    said = capsys.readouterr()
    assert said.out.splitlines()[0] == "Ask-1 ACTIVE"
    wording(timeless(said.out))
    assert said.err == ""  # it is said once
    assert in_words(*remote.why("Ask-1")).splitlines()[0] == "Ask-1 ACTIVE"


def test_json_is_the_answer_of_the_api(service: Service, capsys: pytest.CaptureFixture[str]) -> None:
    why.command("Stay-2", as_json=True, url=service.url)

    assert '"status": "ACTIVE"' in capsys.readouterr().out


# -- what is wrong -----------------------------------------------------------------------------------------------------
def test_an_unknown_id_says_which_are_near(remote: Client) -> None:
    for ask in (remote.why, remote.task):
        with pytest.raises(TaskError, match="Ask-1") as refused:
            ask("Ask-11")
        assert refused.value.code == "unknown_task"


@pytest.mark.parametrize("of", HOSTILE)
def test_hostile_ids_are_unknown_and_nothing_else(remote: Client, of: str) -> None:
    for ask in (remote.why, remote.task, lambda one: remote.timeline([one]), lambda one: remote.chart([one])):
        with pytest.raises(FormigaError) as refused:
            ask(of)
        assert len(str(refused.value)) < 400
        assert "\x1b" not in str(refused.value)


@pytest.mark.parametrize(
    "path",
    [
        "/v1/now?first=-1",
        "/v1/now?count=100000",
        "/v1/now?over=maybe",
        "/v1/stats?hours=-1",
        f"/v1/now?find={'x' * 300}",
    ],
)
def test_pages_out_of_bounds_are_refused(service: Service, path: str) -> None:
    assert service.refused("GET", path)["code"] == "bad_request"


def test_openapi_has_the_shapes_of_the_facts(service: Service) -> None:
    document = service.get("/v1/openapi.json")

    assert {
        "/v1/blackboard",
        "/v1/now",
        "/v1/tasks/{task_id}/picture",
        "/v1/timeline",
        "/v1/chart",
        "/v1/stats",
    } <= set(document["paths"])
    assert {"Now", "TaskPicture", "TaskFact", "Box", "Track", "Spread"} <= set(document["components"]["schemas"])
    answer = document["paths"]["/v1/now"]["get"]["responses"]["200"]["content"]["application/json"]["schema"]
    assert answer == {"$ref": "#/components/schemas/Now"}


def test_nobody_there(remote: Client, wording: Wording) -> None:
    with pytest.raises(NoEngine) as refused:
        connect_source(url="http://127.0.0.1:1").now()
    wording(refused.value)


@contextmanager
def other_server(status: int, body: bytes) -> Iterator[str]:
    """Serve the same to everybody."""

    class Answers(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(status)
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            pass

    server = http.server.HTTPServer(("127.0.0.1", 0), Answers)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


@pytest.mark.parametrize(
    ("status", "body", "words"),
    [
        (200, b"<html>hello</html>", "is no formiga engine"),
        (404, b"not here", "is no formiga engine"),
        (302, b"", "is no formiga engine"),
        (404, b'{"code": "no_such_route", "text": "GET /v1/now: Not Found"}', "is of another version"),
        (200, b'{"site": 4}', "is of another version"),
    ],
)
def test_somebody_else_there(remote: Client, status: int, body: bytes, words: str) -> None:
    with other_server(status, body) as url, pytest.raises(FormigaError, match=words):
        connect_source(url=url).now()


def test_a_token_that_is_wrong_or_missing_is_never_shown(
    service: Service, remote: Client, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, wording: Wording
) -> None:
    monkeypatch.setenv("FORMIGA_TOKEN", "s3cret")
    with pytest.raises(ApiError) as refused:
        connect_source(url=service.url).now()
    wording(refused.value)
    assert "s3cret" not in str(refused.value)
    right = service.host.runtime_folder / "token"
    assert connect_source(url=service.url, token_file=right).now().site == "meadow"
    monkeypatch.delenv("FORMIGA_TOKEN")
    monkeypatch.setenv("FORMIGA_TOKEN_FILE", str(right))
    monkeypatch.setenv("FORMIGA_URL", service.url + "/v1/")
    assert connect().health().site == "meadow"
    (tmp_path / "token").write_text("s3\ncret", encoding="utf-8")
    (tmp_path / "token").chmod(0o644)
    with pytest.raises(UnusableFile, match="can be read by others") as open_one:
        connect_source(url=service.url, token_file=tmp_path / "token")
    assert open_one.value.help == f"chmod 600 {tmp_path / 'token'}"
    (tmp_path / "token").chmod(0o600)
    with pytest.raises(UnusableFile, match="holds no token") as unusable:
        connect_source(url=service.url, token_file=tmp_path / "token")
    assert "cret" not in str(unusable.value)
    with pytest.raises(UnusableFile) as refused_2:
        connect_source(url=service.url, token_file=tmp_path / "none")
    wording(refused_2.value)


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("127.0.0.1:8420", "is no address of an engine; for example http://127.0.0.1:8420"),
        ("ftp://x", "is no address of an engine"),
        ("http://", "is no address of an engine"),
        ("http://x:99999", "--url: Port out of range"),
        ("http://me:pass@x", "names and passwords do not belong into an address"),
        ("http://x/?a=1", "is no address of an engine"),
        ("http://x/\r\nA: b", "letters that no address has|no address"),
    ],
)
def test_addresses_that_are_none(remote: Client, url: str, words: str) -> None:
    with pytest.raises(UnusableFile, match=words) as refused:
        connect(url=url)
    assert "pass@" not in str(refused.value)


def test_two_engines_named_are_one_too_many(remote: Client, tmp_path: Path) -> None:
    with pytest.raises(UnusableFile, match="name two engines"):
        connect(tmp_path, "http://x")
    with pytest.raises(UnusableFile, match="goes with --url"):
        connect(token_file=tmp_path)


# -- many tasks --------------------------------------------------------------------------------------------------------
def test_a_page_of_a_thousand_tasks_holds_the_view_for_a_moment_only(tmp_path: Path) -> None:
    with starter(tmp_path)() as service:
        many = [TaskPut(task(f"Look-{n}", order=n, times=TaskTimes(submitted_at=1))) for n in range(1000)]
        service.host.view.feed_step(step(10**6, *many))
        service.host.view.catch_up()
        source = connect_source(url=service.url)
        source.now()
        began = time.perf_counter()
        found = source.now(count=100)
        took = time.perf_counter() - began

    assert (found.total, len(found.tasks)) == (1000, 100)
    assert took < 1.0  # some 30 ms on an idle machine
    print(f"a page of now over 1000 tasks by HTTP: {took * 1000:.0f} ms")


def test_a_simulation_that_is_ahead_of_the_wall_clock_says_so_in_each_answer(
    service: Service, remote: Client, wording: Wording
) -> None:
    """The service runs 20 times as fast: its times were read as those of the wall clock."""
    service.wait(lambda: service.get("/v1/health")["ahead_us"] > 6_000_000)
    assert remote.now().ahead_us > 6_000_000
    assert remote.ahead_us > 6_000_000
    wording(timeless(service.host.clock_text))


def test_tasks_are_asked_for_by_a_status_that_there_is(service: Service) -> None:
    for status in ("open", "held", "active", "FAILED", "Open"):
        assert "tasks" in service.get(f"/v1/tasks?status={status}")
    refused = service.refused("GET", "/v1/tasks?status=foo")
    assert (refused["status"], refused["code"]) == (422, "bad_status")


def test_why_of_nothing_says_that_it_is_neither(remote: Client, wording: Wording) -> None:
    with pytest.raises(TaskError) as refused:
        remote.why("Xyzzy")
    wording(refused.value)
    with pytest.raises(TaskError) as refused:
        remote.why("Ask-11")
    wording(refused.value)
