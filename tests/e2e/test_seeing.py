"""What an operator types to see: show, why, gantt, map and stats, of one running engine with simulated agents in processes."""

import json
import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from shutil import copy, copytree
from typing import Any

import pytest

from tests.e2e.test_service import ASK, Shell

pytestmark = pytest.mark.network
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def shell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shell]:
    """A folder whose engine has flown a circle, and asks a person who does not answer."""
    folder = tmp_path_factory.mktemp("seeing")
    site = (ROOT / "trees" / "demo-site.yaml").read_text(encoding="utf-8")
    (folder / "site.yaml").write_text(site.replace(":7447", ":0"), encoding="utf-8")
    copytree(ROOT / "trees" / "lib", folder / "trees" / "lib")
    copy(ROOT / "trees" / "circle.yaml", folder / "trees")
    (folder / "trees" / "ask.yaml").write_text(ASK, encoding="utf-8")
    shell = Shell(folder)
    try:
        shell.up("--sim", "--desk", "eve:watcher")
        until = time.monotonic() + 40
        while not any(one["type"] == "lwd" for one in shell.json("agents")["agents"]):
            assert time.monotonic() < until
            time.sleep(0.1)
        assert "SUCCEEDED" in shell.run("run", "Circle", "--follow")
        assert shell.run("run", "Ask").startswith("Ask-2")
        while "Is it good?" not in shell.run("inbox"):
            assert time.monotonic() < until
            time.sleep(0.1)
        yield shell
        shell.run("down", "--yes")
        shell.ended()
    finally:
        shell.close()


def test_show_tells_how_each_step_of_a_task_stands(shell: Shell) -> None:
    ended = shell.run("show", "Circle-1", "--ascii", "--width", "100").splitlines()
    assert ended[:2] == ["Circle-1 SUCCEEDED", "steps"]
    assert all(re.match(r"[|` -]*\+ ", line) for line in ended[2:]), ended
    assert any("drone.GoTo(to: spot)  37 runs" in line for line in ended)

    waits = shell.run("show", "Ask-2", "--ascii", "--width", "100").splitlines()
    assert waits[0].startswith("Ask-2 ACTIVE")
    assert re.search(r"^`- > ask .*Q\d+ asks ", waits[2]), waits


def test_show_writes_pictures(shell: Shell) -> None:
    for name, head in (("c.html", "<!doctype html>"), ("c.json", "{")):
        shell.run("show", "Circle-1", "-o", name)
        assert (shell.folder / name).read_text(encoding="utf-8").lower().lstrip().startswith(head), name


def test_why_explains(shell: Shell) -> None:
    assert shell.run("why", "Circle-1").startswith("Circle-1 SUCCEEDED\n")
    said = shell.run("why", "Ask-2")
    assert said.startswith("Ask-2 ACTIVE\n")
    assert re.search(r"Q\d+", said)
    assert "formiga answer" in said
    assert "eve" in said


def test_gantt_draws_who_did_what_when(shell: Shell) -> None:
    lines = shell.run("gantt", "Circle-1", "--ascii", "--width", "80").splitlines()
    assert lines[0].startswith("Circle-1  SUCCEEDED after ")
    assert re.match(r"  lwd_\d +\[TakeOff", lines[1]), lines
    assert max(len(line) for line in lines) <= 80
    assert {task["id"] for task in shell.json("gantt", "--all")["tasks"]} == {"Circle-1", "Ask-2"}
    shell.run("gantt", "--all", "-o", "g.svg")
    assert "<svg" in (shell.folder / "g.svg").read_text(encoding="utf-8")


def test_map_draws_where_they_went(shell: Shell) -> None:
    lines = shell.run("map", "Circle-1", "--ascii", "--width", "80").splitlines()
    assert lines[0] == "rovaniemi: Circle-1"
    assert any(re.match(r"\w lwd_\d +\d+ m over ground in ", line) for line in lines), lines
    assert max(len(line) for line in lines) <= 80
    shell.run("map", "--all", "-o", "m.png")
    assert (shell.folder / "m.png").read_bytes().startswith(b"\x89PNG")


def test_stats_tells_how_long_things_took(shell: Shell) -> None:
    lines = shell.run("stats", "--ascii", "--width", "90").splitlines()
    assert lines[2] == "tasks  from the first step to the end"
    assert re.match(r"Circle +1 .* min .*#$", lines[4]), lines
    assert any(re.match(r"lwd GoTo +\d+ ", line) for line in lines)
    assert max(len(line) for line in lines) <= 90

    found = shell.json("stats", "Circle", "--hours", "1")
    assert [(one["name"], one["n"]) for one in found["tasks"]] == [("Circle", 1)]
    shell.run("stats", "-o", "s.csv")
    assert (shell.folder / "s.csv").read_text(encoding="utf-8").startswith("table,name,group,n,failed,")


def test_a_task_that_waits_travels_as_json(shell: Shell) -> None:
    shown = json.loads(shell.run("show", "Ask-2", "--format", "json"))
    assert {step["path"]: step["status"] for step in shown["steps"]}["steps/steps[0]"] == "running"


def test_an_assistant_sees_what_goes_on(shell: Shell) -> None:
    import anyio
    from mcp import Client, StdioServerParameters, stdio_client

    command = StdioServerParameters(command=sys.executable, args=["-m", "formiga_bt", "mcp"], cwd=shell.folder)

    async def look() -> dict[str, tuple[str, Any]]:
        asked = {"list_agents": {}, "now": {}, "explain": {"id": "Ask-2"}, "show_task": {"id": "Circle-1"}}
        async with Client(stdio_client(command)) as client:
            found = {name: await client.call_tool(name, arguments) for name, arguments in asked.items()}
        return {name: (told.content[0].text, told.structured_content) for name, told in found.items()}

    told = anyio.run(look)
    assert {text.splitlines()[1] for text, _ in told.values()} == {"--- begin of data ---"}
    fleet, now = told["list_agents"][1], told["now"][1]
    assert fleet["engine"] == "running"
    assert all(one["here"] for one in fleet["agents"] if one["kind"] == "machine")
    assert [(one["task"], one["text"], one["asked"]) for one in now["questions"]] == [("Ask-2", "Is it good?", ["eve"])]
    assert told["explain"][1]["of"] == "Ask-2 ACTIVE"
    assert told["show_task"][1]["status"] == "Circle-1 SUCCEEDED"
    token = (shell.folder / ".formiga" / "rovaniemi" / "token").read_text(encoding="ascii").strip()
    assert token not in str(told)
