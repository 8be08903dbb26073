"""The schema in a real yaml-language-server: what an author sees while writing. Needs node, npm and npm's registry."""

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytestmark = [pytest.mark.external, pytest.mark.network, pytest.mark.slow]
SERVER = "yaml-language-server@2.0.0"

TASK = """\
formiga: 1
task: Example
priority: high
agents:
  drone:
    type: lwd
    near: ${base}
steps:
  - do: drone.GoTo
    with:
      to: ${above(base, 60 m)}
    timeout: 15
  - dance: 3
"""


class Server:
    """A language server over stdin and stdout."""

    def __init__(self, command: list[str], folder: Path) -> None:
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=folder)
        self._number = 0
        self._version = 0
        self.problems: dict[str, list[dict[str, Any]]] = {}

    def send(self, method: str, params: Any, number: int | None = None) -> None:
        message: dict[str, Any] = {"jsonrpc": "2.0", "method": method, "params": params}
        self._write(message if number is None else {**message, "id": number})

    def _write(self, message: dict[str, Any]) -> None:
        data = json.dumps(message).encode()
        assert self._process.stdin is not None
        self._process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(data) + data)
        self._process.stdin.flush()

    def read(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        length = 0
        while (line := self._process.stdout.readline()) not in (b"\r\n", b"\n"):
            assert line, "the server has ended"
            if line.lower().startswith(b"content-length:"):
                length = int(line.split(b":")[1])
        message: dict[str, Any] = json.loads(self._process.stdout.read(length))
        if "id" in message and "method" in message:
            wanted = message["params"].get("items", []) if message["method"] == "workspace/configuration" else None
            self._write(
                {"jsonrpc": "2.0", "id": message["id"], "result": wanted and [self.settings(w) for w in wanted]}
            )
        if message.get("method") == "textDocument/publishDiagnostics":
            self.problems[message["params"]["uri"]] = message["params"]["diagnostics"]
        return message

    schema = ""

    def settings(self, wanted: dict[str, Any]) -> Any:
        yaml = {"schemas": {self.schema: "*.yaml"}, "validate": True, "hover": True, "completion": True}
        return yaml if wanted.get("section") == "yaml" else None

    def ask(self, method: str, params: Any) -> Any:
        self._number += 1
        number = self._number
        self.send(method, params, number)
        while True:
            message = self.read()
            if message.get("id") == number and "method" not in message:
                assert "error" not in message, message
                return message["result"]

    def open(self, path: Path, text: str) -> str:
        self._version += 1
        uri = path.with_name(f"{path.stem}{self._version}.yaml").as_uri()
        document = {"uri": uri, "languageId": "yaml", "version": 1, "text": text}
        self.send("textDocument/didOpen", {"textDocument": document})
        return uri

    def end(self) -> None:
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is None or npm is None:
        pytest.skip("node and npm are not installed")
    folder = tmp_path_factory.mktemp("editor")
    install = [npm, "install", "--silent", "--no-audit", "--no-fund", "--prefix", str(folder), SERVER]
    done = subprocess.run(install, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"npm cannot install {SERVER}: {done.stderr[-300:]}")
    schema = folder / "formiga.schema.json"
    printed = [sys.executable, "-m", "formiga_bt", "schema", "--editor", "--site", "demo"]
    schema.write_text(subprocess.run(printed, capture_output=True, text=True, check=True).stdout, encoding="utf-8")
    main = folder / "node_modules" / "yaml-language-server" / "bin" / "yaml-language-server"
    found = Server([node, str(main), "--stdio"], folder)
    found.schema = schema.as_uri()
    capabilities = {
        "textDocument": {
            "completion": {"completionItem": {"snippetSupport": True, "documentationFormat": ["markdown"]}},
            "hover": {"contentFormat": ["markdown"]},
        },
        "workspace": {"configuration": True},
    }
    found.ask("initialize", {"processId": None, "rootUri": folder.as_uri(), "capabilities": capabilities})
    found.send("initialized", {})
    found.send("workspace/didChangeConfiguration", {"settings": {"yaml": found.settings({"section": "yaml"})}})
    first = found.open(folder / "first.yaml", TASK)
    while first not in found.problems:  # the schema is read by then
        found.read()
    yield found
    found.end()


def labels(server: Server, folder: Path, text: str) -> set[str]:
    """Return what is offered at the mark `|` of a text."""
    before = text.partition("|")[0]
    uri = server.open(folder / "task.yaml", text.replace("|", "", 1))
    place = {"line": before.count("\n"), "character": len(before.rpartition("\n")[2])}
    found = server.ask("textDocument/completion", {"textDocument": {"uri": uri}, "position": place})
    return {item["label"] for item in found["items"]}


def hover(server: Server, folder: Path, text: str) -> str:
    before = text.partition("|")[0]
    uri = server.open(folder / "task.yaml", text.replace("|", "", 1))
    place = {"line": before.count("\n"), "character": len(before.rpartition("\n")[2])}
    found = server.ask("textDocument/hover", {"textDocument": {"uri": uri}, "position": place})
    contents = found["contents"]
    return str(contents["value"] if isinstance(contents, dict) else contents).replace("\\", "")


HEAD = "formiga: 1\ntask: Example\n"


def test_keys_of_a_task_are_offered(server: Server, tmp_path: Path) -> None:
    assert {"agents", "on_failure", "cleanup_timeout"} <= labels(server, tmp_path, HEAD + "|")


def test_kinds_of_steps_are_offered(server: Server, tmp_path: Path) -> None:
    offered = labels(server, tmp_path, HEAD + "steps:\n  - |")

    assert {"do", "ask", "parallel", "repeat", "switch", "timeout", "retry"} <= offered


def test_options_of_a_step_are_offered(server: Server, tmp_path: Path) -> None:
    offered = labels(server, tmp_path, HEAD + "steps:\n  - ask: Ready?\n    |")

    assert {"of", "options", "escalate_after", "timeout", "expect"} <= offered


def test_words_of_an_option_are_offered(server: Server, tmp_path: Path) -> None:
    assert {"low", "medium", "high"} <= labels(server, tmp_path, HEAD + "priority: |")


def test_actions_of_the_catalogue_are_offered(server: Server, tmp_path: Path) -> None:
    offered = labels(server, tmp_path, HEAD + "steps:\n  - do: |")

    assert {"drone.GoTo", "lwd.Explore", "picker.MiniFinder"} <= offered
    assert "hwd.CutMotors" not in offered


def test_fields_of_the_action_are_offered_and_no_others(server: Server, tmp_path: Path) -> None:
    offered = labels(server, tmp_path, HEAD + "steps:\n  - do: drone.GoTo\n    with:\n      |")

    assert {"to", "speed"} <= offered
    assert not {"altitude", "at", "region"} & offered


def test_places_of_the_site_are_offered(server: Server, tmp_path: Path) -> None:
    offered = labels(server, tmp_path, HEAD + "steps:\n  - do: drone.LandIn\n    with:\n      at: |")

    assert {"camp", "north_field", "p1"} <= offered


def test_agent_types_are_offered(server: Server, tmp_path: Path) -> None:
    assert {"lwd", "hwd", "picker"} <= labels(server, tmp_path, HEAD + "agents:\n  drone:\n    type: |")


def test_keys_of_a_site_are_offered(server: Server, tmp_path: Path) -> None:
    assert {"ports", "fence", "no_fly"} <= labels(server, tmp_path, "formiga_site: 1\nname: here\n|")


def test_hover_tells_what_a_key_means_and_what_holds_without_it(server: Server, tmp_path: Path) -> None:
    assert "Fail unless this holds" in hover(
        server, tmp_path, HEAD + "steps:\n  - do: drone.TakeOff\n    ex|pect: true\n"
    )
    assert "(medium)" in hover(server, tmp_path, HEAD + "prio|rity: high\n")
    with_ = HEAD + "steps:\n  - do: drone.TakeOff\n    with:\n      alti|tude: 30 m\n"
    assert "Default: agent.transit_height." in hover(server, tmp_path, with_)


def test_mistakes_are_marked_while_one_writes(server: Server, tmp_path: Path) -> None:
    uri = server.open(tmp_path / "task.yaml", TASK)
    while uri not in server.problems:
        server.read()
    lines = {problem["range"]["start"]["line"] + 1 for problem in server.problems[uri]}

    assert lines == {12, 13}
