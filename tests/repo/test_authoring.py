"""docs/authoring.md: its commands are run, one after another in one folder, and say what the document shows.

A line `...` stands for any lines.
"""

import re
import shlex
from pathlib import Path

import pytest

from formiga_bt.cli.app import run

DOC = (Path(__file__).parents[2] / "docs" / "authoring.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(?:console|yaml file=(\S+))\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def shown(text: str) -> "re.Pattern[str]":
    lines = [r"(?:.*\n)*" if line == "..." else re.escape(line) + r"\n" for line in text.splitlines()]
    return re.compile("".join(lines))


def test_the_commands_of_the_page_say_what_it_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    ran = 0
    for file, block in BLOCK.findall(DOC):
        if file:
            Path(file).write_text(block, encoding="utf-8")
            continue
        for command, expected in re.findall(r"^\$ formiga (.*)\n((?:(?!\$ ).*\n)*)", block, re.MULTILINE):
            run(shlex.split(command))
            out = capsys.readouterr().out
            assert shown(expected).fullmatch(out), f"$ formiga {command}\n{out}"
            ran += 1
    assert ran >= 10
