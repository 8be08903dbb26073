"""What a client sends over the protocol, and what it gets back."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import anyio
import pytest
from mcp import types

from formiga_bt.llm.mcp.ground import ServerFiles
from formiga_bt.llm.mcp.server import Front
from formiga_bt.llm.mcp.tools import Desk
from formiga_bt.llm.mcp.worker import JobProcesses

WAIT = "formiga: 1\ntask: Circle\nagents: {w: {type: watcher}}\nsteps: [{ask: '\ud800?', of: [w], timeout: 1 min}]\n"


async def nothing(*_: object) -> None: ...


def called(name: str, arguments: dict[str, Any]) -> types.CallToolResult:
    def connect() -> Any:
        raise AssertionError("no engine is asked")

    front = Front(Desk(ServerFiles(), connect, JobProcesses(ServerFiles()), lambda: 7, ("eve",)))
    ctx: Any = SimpleNamespace(session=SimpleNamespace(client_params=None, report_progress=nothing))

    async def call() -> types.CallToolResult:
        return await front.call_tool(ctx, types.CallToolRequestParams(name=name, arguments=arguments))

    return anyio.run(call)


@pytest.mark.parametrize("tool", ["check_task", "show_task"])
def test_half_a_letter_is_a_letter_that_cannot_be_read(tool: str) -> None:
    told = called(tool, {"yaml": WAIT})
    (text,) = told.content
    assert isinstance(text, types.TextContent)
    assert not told.is_error, text.text
    assert text.text.encode()


def test_half_a_letter_in_a_proposal_is_kept_as_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    told = called("propose_task", {"yaml": WAIT, "why": "a circle \ud800"})
    (text,) = told.content
    assert isinstance(text, types.TextContent)
    assert not told.is_error, text.text
    (kept,) = tmp_path.glob(".formiga/*/drafts/1/task.yaml")
    assert "\ufffd?" in kept.read_text(encoding="utf-8")
