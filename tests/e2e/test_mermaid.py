"""Our flowcharts in the real Mermaid, the parser that GitHub has. Needs node, npm and npm's registry."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from formiga_bt.cli.inputs import read_task, read_world
from formiga_bt.rehearsal.testing import packaged_task
from formiga_bt.show.tree.drawing import drawing_of
from formiga_bt.show.tree.mermaid import mermaid_of

PACKAGES = ("mermaid@11.17.2", "jsdom@25.0.1")
GOLDEN = Path(__file__).parents[1] / "unit" / "show" / "golden"
PARSE = """
import { JSDOM } from "jsdom";
import { readFileSync } from "fs";
const dom = new JSDOM("<!DOCTYPE html><body></body>");
globalThis.window = dom.window;
globalThis.document = dom.window.document;
globalThis.Element = dom.window.Element;
const { default: mermaid } = await import("mermaid");
const found = {};
for (const file of process.argv.slice(2)) {
  try { found[file] = (await mermaid.parse(readFileSync(file, "utf8"))).diagramType; }
  catch (error) { found[file] = String(error); }
}
console.log(JSON.stringify(found));
"""
HOSTILE = """formiga: 1
task: Hostile
agents: {ann: {type: watcher}}
steps:
  - notify: "</script> `code` #quot; --> \\"x\\" | end; %% {{x}} [y](z) **b** &lt; \\\\n"
    to: [ann]
    name: "- 1. <img src=x>"
"""

pytestmark = [pytest.mark.external, pytest.mark.slow]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is None or npm is None:
        pytest.skip("node and npm are not installed")
    folder = tmp_path_factory.mktemp("mermaid")
    install = [npm, "install", "--silent", "--no-audit", "--no-fund", "--prefix", str(folder), *PACKAGES]
    done = subprocess.run(install, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        pytest.skip(f"npm cannot install {PACKAGES}: {done.stderr[-300:]}")
    (folder / "parse.mjs").write_text(PARSE, encoding="utf-8")
    return folder


def test_mermaid_reads_what_we_write_and_not_anything(folder: Path) -> None:
    (folder / "hostile.yaml").write_text(HOSTILE, encoding="utf-8")
    hostile = read_task(folder / "hostile.yaml", read_world()).task
    assert hostile is not None
    (folder / "hostile.mmd").write_text(mermaid_of(drawing_of(hostile)), encoding="utf-8")
    (folder / "delivery.mmd").write_text(mermaid_of(drawing_of(packaged_task("delivery"))), encoding="utf-8")
    (folder / "wrong.mmd").write_text("flowchart LR\n  a --> [\n", encoding="utf-8")
    files = [folder / "hostile.mmd", folder / "delivery.mmd", GOLDEN / "task.mmd", folder / "wrong.mmd"]
    command = ["node", "parse.mjs", *map(str, files)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = list(json.loads(done.stdout).values())
    assert found[:3] == ["flowchart-v2"] * 3
    assert "Parse error on line 2" in found[3]
