"""`formiga mcp` as an assistant meets it: a process, and the client of the protocol's own library over stdin and stdout."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import anyio
import pytest
from anyio.from_thread import BlockingPortal, start_blocking_portal
from mcp import Client, Implementation, MCPError, StdioServerParameters, stdio_client

from formiga_bt.base.packaged import folder
from formiga_bt.llm.mcp.tools import TOOLS
from tests.e2e.rig import children, is_running

pytestmark = pytest.mark.network

PATIENCE_S = 60.0
LOOK = """\
formiga: 1
task: Look
imports: [lib/flying.yaml]
params:
  target: place
agents:
  drone: {type: lwd, near: "${target}"}
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${target}", height: 40 m}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
ASK = """\
formiga: 1
task: Ask
agents:
  picker: {type: picker}
steps:
  - ask: Shall we?
    of: [picker]
    options: ["yes", "no"]
    timeout: 1 min
    expect: result.answer == 'yes'
"""
LONG = (
    "formiga: 1\ntask: Long\nagents:\n  p: {type: picker}\nsteps:\n  - repeat: 20 h\n    steps:\n      - wait: 100 ms\n"
)
TOKEN = "a-token-that-nobody-may-see"


class Assistant:
    """A client with a site's folder, driven from a test's thread."""

    def __init__(self, portal: BlockingPortal, client: Client, place: Path) -> None:
        self.portal = portal
        self.client = client
        self.folder = place

    def do(self, ask: Callable[[], Awaitable[Any]]) -> Any:
        """Return what the client is answered."""

        async def soon() -> Any:
            with anyio.fail_after(PATIENCE_S):
                return await ask()

        return self.portal.call(soon)

    def call(self, tool: str, **arguments: Any) -> dict[str, Any]:
        """Return the structured content of a tool's answer."""
        told = self.do(lambda: self.client.call_tool(tool, arguments))
        assert not told.is_error, told.content[0].text
        assert TOKEN not in told.model_dump_json()
        found: dict[str, Any] = told.structured_content
        return found

    def refused(self, tool: str, **arguments: Any) -> str:
        """Return why a tool did not do it."""
        told = self.do(lambda: self.client.call_tool(tool, arguments))
        assert told.is_error, told.content[0].text
        text: str = told.content[0].text
        return text


@pytest.fixture(scope="module")
def assistant(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Assistant]:
    """A server of a site's own folder, and a client that has greeted it."""
    place = tmp_path_factory.mktemp("meadow")
    shutil.copy(folder("trees") / "demo-site.yaml", place / "site.yaml")
    (place.parent / "secret.yaml").write_text("formiga: 1\nsubtrees: {}\n", encoding="utf-8")
    (place / ".formiga" / "rovaniemi").mkdir(parents=True)
    (place / ".formiga" / "rovaniemi" / "token").write_text(TOKEN, encoding="utf-8")
    command = StdioServerParameters(command=sys.executable, args=["-m", "formiga_bt", "mcp"], cwd=place)
    greeting = Client(stdio_client(command), client_info=Implementation(name="desk helper", version="1"))
    with start_blocking_portal() as portal, portal.wrap_async_context_manager(greeting) as client:
        yield Assistant(portal, client, place)


def test_it_greets_with_how_to_begin(assistant: Assistant) -> None:
    assert assistant.client.server_info is not None
    assert assistant.client.server_info.name == "formiga"
    assert "a person reads the proposal and runs it" in (assistant.client.instructions or "")


def test_tools_have_schemas_and_say_which_one_writes(assistant: Assistant) -> None:
    listed = assistant.do(assistant.client.list_tools).tools
    assert [one.name for one in listed] == [one.name for one in TOOLS]
    assert [one.name for one in listed if not one.annotations.read_only_hint] == ["propose_task"]
    assert not any(one.annotations.destructive_hint for one in listed)
    assert all(one.input_schema["type"] == one.output_schema["type"] == "object" for one in listed)


def test_the_site_can_be_looked_at(assistant: Assistant) -> None:
    fleet = assistant.call("list_agents")
    assert fleet["engine"].startswith("no engine runs for ")
    (first,) = [one for one in fleet["agents"] if one["id"] == "lwd_1"]
    assert {"type": "lwd", "kind": "machine", "home": "p1"}.items() <= first.items()
    assert "GoTo" in {one["name"] for one in assistant.call("list_actions")["actions"]}
    assert {"PickUp", "Convoy"} <= {one["task"] for one in assistant.call("list_tasks")["tasks"]}


def test_the_language_can_be_read(assistant: Assistant) -> None:
    assert "steps" in assistant.call("language")["topics"]
    assert assistant.call("language", topic="roles")["text"].startswith("# Roles")
    assert "there is no topic 'role'; did you mean 'roles'?" in assistant.refused("language", topic="role")
    assert assistant.call("explain_code", code="e030")["text"].startswith("E030: ")
    assert assistant.call("schema")["schema"]
    assert assistant.call("schema", form="json")["schema"]


def test_a_task_is_checked_and_drawn(assistant: Assistant) -> None:
    assert assistant.call("check_task", yaml=LOOK)["ok"]
    told = assistant.call("check_task", yaml=LOOK.replace("lwd", "lwdd"))
    assert [(one["code"], one["line"]) for one in told["problems"] if one["severity"] == "error"] == [("E020", 7)]
    assert "call FlyTo" in assistant.call("show_task", yaml=LOOK)["tree"]
    assert "Circle" in assistant.call("show_task", task="Circle")["tree"]


def test_a_dry_run_tells_progress_and_facts(assistant: Assistant) -> None:
    heard: list[str] = []

    async def hear(progress: float, total: float | None, message: str | None) -> None:
        heard.append(message or "")

    async def ask() -> Any:
        arguments = {"yaml": LOOK, "params": {"target": "north_field"}}
        return await assistant.client.call_tool("dry_run", arguments, progress_callback=hear)

    told = assistant.do(ask)
    assert told.structured_content["status"] == "SUCCEEDED"
    assert told.structured_content["agents"] == {"drone": ["lwd_3"]}
    assert told.content[0].text.startswith("Look SUCCEEDED after ")
    assert heard[:2] == ["Look is checked; it begins to fly", "1 min of virtual time"]


def test_a_proposal_waits_for_a_person_and_starts_nothing(assistant: Assistant) -> None:
    told = assistant.call("propose_task", yaml=LOOK, params={"target": "camp"}, why="look at the camp")
    place = assistant.folder / ".formiga" / "rovaniemi" / "drafts" / "1"
    assert (told["proposal"], told["file"], told["status"]) == (1, str(place / "task.yaml"), "SUCCEEDED")
    mine = assistant.folder.resolve() / "look.yaml"
    keep = f"cp -n {told['file']} {mine}"
    assert told["next"] == [f"formiga show {told['file']}", keep, f"formiga run {mine} -p target=camp"]
    line, _, text = (place / "task.yaml").read_text(encoding="utf-8").partition("\n")
    assert (line.partition(" {")[0], text) == ("# drafted", LOOK)
    origin = json.loads((place / "origin.json").read_text(encoding="utf-8"))
    assert (origin["by"], origin["request"], origin["approved_by"]) == ("mcp:desk helper", "look at the camp", "")
    assert origin["unix_millis"] > 0


def test_what_does_not_fly_is_not_proposed(assistant: Assistant) -> None:
    answers = {"picker_1": ["no"], "picker_2": ["no"]}
    told = assistant.refused("propose_task", yaml=ASK, answers=answers, why="ask whether we go")
    assert told.startswith("not proposed, because its dry run went wrong:\nAsk FAILED after ")
    assert "target" in assistant.refused("propose_task", yaml=LOOK, why="look")


def test_without_an_engine_it_is_told_how_to_start_one(assistant: Assistant) -> None:
    for tool, arguments in (("now", {}), ("explain", {"id": "PickUp-1"}), ("show_task", {"id": "PickUp-1"})):
        assert "start one in the folder of your site.yaml: formiga up" in assistant.refused(tool, **arguments)


@pytest.mark.parametrize(
    ("tool", "arguments", "why"),
    [
        ("check_task", {"yaml": "x" * 70_000}, "Expected `str` of length <= 65536"),
        ("check_task", {"yaml": "š" * 40_000}, "the task is larger than 64 kB"),
        ("check_task", {"yaml": 7}, "Expected `str`, got `int` - at `$.yaml`"),
        ("check_task", {}, "missing required field `yaml`"),
        ("check_task", {"yaml": ""}, "give one of yaml; given: none"),
        ("check_task", {"yaml": LOOK, "path": "/etc/passwd"}, "unknown field `path`"),
        ("dry_run", {"task": "Circle", "yaml": LOOK}, "give one of yaml, task; given: yaml, task"),
        ("dry_run", {"task": "../secret"}, "there is no task '../secret'"),
        ("dry_run", {"task": "Circle", "hours": 1e9}, "Expected `float` <= 24.0"),
        ("dry_run", {"task": "Circle", "params": {str(n): 1 for n in range(101)}}, "length <= 100"),
        (
            "dry_run",
            {"yaml": LOOK, "params": {"target": "@/etc/passwd"}},
            "parameter 'target' begins with '@', which means a file",
        ),
        ("list_actions", {"agent_type": "tank"}, "there is no agent type 'tank'"),
    ],
)
def test_what_cannot_be_used_is_refused_with_why(
    assistant: Assistant, tool: str, arguments: dict[str, Any], why: str
) -> None:
    assert why in assistant.refused(tool, **arguments)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n", "E003"),
        ("!!python/object/apply:os.system [ls]\n", "E003"),
        ("[" * 5000, "E003"),
        ("{" * 60_000, "E003"),
        ("\x00", "E001"),
        (LOOK.replace("lib/flying.yaml", "../secret.yaml"), "E008"),
        (LOOK.replace("lib/flying.yaml", "/etc/passwd"), "E008"),
        ("formiga: 1\ntask: T\nvars:\n  n: ${" + "9" * 5000 + " ** 99999}\nsteps:\n  - wait: 1 s\n", "E"),
        ("formiga: 1\ntask: T\nvars:\n  n: ${" + "(" * 20_000 + "1}\nsteps:\n  - wait: 1 s\n", "E"),
    ],
    ids=["bomb", "tag", "deep", "braces", "nul", "up", "absolute", "power", "parentheses"],
)
def test_hostile_texts_are_refused_by_the_checker(assistant: Assistant, text: str, code: str) -> None:
    told = assistant.call("check_task", yaml=text)
    assert not told["ok"]
    assert any(one["code"].startswith(code) for one in told["problems"]), told["rendered"]


def test_two_are_served_at_once_and_pings_meanwhile(assistant: Assistant) -> None:
    ended: list[str] = []

    async def ask() -> None:
        async def one(name: str, tool: str, **arguments: Any) -> None:
            await assistant.client.call_tool(tool, arguments)
            ended.append(name)

        async with anyio.create_task_group() as group:
            group.start_soon(lambda: one("dry run", "dry_run", task="PatrolAndEscort"))
            group.start_soon(lambda: one("check", "check_task", yaml=LOOK))
            await one("topic", "language")

    assistant.do(ask)
    assert ended[0] == "topic"
    assert sorted(ended) == ["check", "dry run", "topic"]


def test_a_dry_run_that_is_given_up_ends_its_process(assistant: Assistant) -> None:
    (server,) = children(os.getpid())

    async def give_up() -> None:
        async def hear(progress: float, total: float | None, message: str | None) -> None:
            assert children(server)
            scope.cancel()

        with anyio.CancelScope() as scope:
            await assistant.client.call_tool("dry_run", {"yaml": LONG, "hours": 24}, progress_callback=hear)
        assert scope.cancelled_caught
        with anyio.fail_after(PATIENCE_S):
            while children(server):
                await anyio.sleep(0.01)

    assistant.do(give_up)
    assert assistant.call("check_task", yaml=LOOK)["ok"]


def test_texts_are_listed_in_pages_and_read(assistant: Assistant) -> None:
    async def all_of() -> list[str]:
        found, cursor = [], None
        while True:
            page = await assistant.client.list_resources(cursor=cursor)
            found += [one.uri for one in page.resources]
            if page.next_cursor is None:
                return found
            cursor = page.next_cursor

    listed = assistant.do(all_of)
    assert {"formiga://language", "formiga://codes/E030", "formiga://trees/PickUp"} <= set(listed)
    (text,) = assistant.do(lambda: assistant.client.read_resource("formiga://trees/PickUp")).contents
    assert text.text.startswith("formiga: 1\ntask: PickUp")
    assert len(assistant.do(assistant.client.list_resource_templates).resource_templates) == 4
    for uri in ("file:///etc/passwd", "formiga://trees/../../site", "formiga://language/..%2f..%2fREADME"):
        with pytest.raises(MCPError, match="there is no"):
            assistant.do(lambda uri=uri: assistant.client.read_resource(uri))


def test_a_prompt_tells_how_to_write_a_mission(assistant: Assistant) -> None:
    (listed,) = assistant.do(assistant.client.list_prompts).prompts
    assert [one.name for one in listed.arguments] == ["request"]
    told = assistant.do(lambda: assistant.client.get_prompt(listed.name, {"request": "look at the camp"}))
    assert "> look at the camp" in told.messages[0].content.text
    with pytest.raises(MCPError, match="there is no prompt 'x'"):
        assistant.do(lambda: assistant.client.get_prompt("x"))


def test_a_tool_that_is_not_there_is_an_error_of_the_protocol(assistant: Assistant) -> None:
    with pytest.raises(MCPError, match="there is no tool 'run_task'; tools: list_agents, "):
        assistant.do(lambda: assistant.client.call_tool("run_task", {}))


def test_it_ends_when_stdin_closes_also_in_a_dry_run(tmp_path: Path) -> None:
    """Without the client of the library, which would end it if it did not end itself; with the older greeting."""
    command = [sys.executable, "-m", "formiga_bt", "mcp"]
    server = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=tmp_path, text=True)
    assert server.stdin is not None
    assert server.stdout is not None

    def send(**message: Any) -> None:
        print(json.dumps({"jsonrpc": "2.0", **message}), file=server.stdin, flush=True)

    client = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "old", "version": "1"}}
    print("this is no JSON", file=server.stdin, flush=True)
    send(id=1, method="initialize", params=client)
    greeting = next(said for line in server.stdout if (said := json.loads(line)).get("id") == 1)
    assert greeting["result"]["serverInfo"]["name"] == "formiga"
    send(method="notifications/initialized")
    arguments = {"yaml": LONG, "hours": 24}
    send(id=2, method="tools/call", params={"name": "dry_run", "arguments": arguments, "_meta": {"progressToken": 1}})
    assert json.loads(server.stdout.readline())["method"] == "notifications/progress"
    (job,) = children(server.pid)
    server.stdin.close()
    assert server.wait(PATIENCE_S) == 0
    assert not is_running(job)
    server.stdout.close()
