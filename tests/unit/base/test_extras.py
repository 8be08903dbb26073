"""What is said of a package that is missing: a command that works, though formiga_bt itself is in no index."""

import re
import sys
from pathlib import Path
from typing import get_args

import pytest

from formiga_bt.base import extras
from formiga_bt.base.extras import Extra, install, packages
from formiga_bt.cli.app import run

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("extra", get_args(Extra))
def test_the_command_names_the_packages_that_the_project_says(extra: Extra) -> None:
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    said = {line.partition(">=")[0] for line in project["optional-dependencies"][extra]}
    command = install(extra)
    assert command.startswith(f"{sys.executable} -m pip install ")
    assert said == {one.replace("<", ">").partition(">")[0] for one in packages(extra)}
    assert "formiga-bt" not in command


def test_no_text_of_the_program_advises_to_install_it_from_an_index() -> None:
    files = [
        path
        for name in ("formiga_bt", "agents_sim", "docs")
        for path in (ROOT / name).rglob("*")
        if path.suffix in (".py", ".md")
    ]
    assert len(files) > 300
    assert [str(path) for path in files if re.search(r"pip install '?formiga", path.read_text(encoding="utf-8"))] == []


@pytest.mark.parametrize("words", [("show", "trees/pick_up.yaml"), ("gantt", "PickUp-1"), ("map", "--all")])
def test_a_picture_without_the_packages_that_draw_is_refused_with_what_to_install(
    words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(extras, "find_spec", lambda name: None)
    monkeypatch.chdir(ROOT)
    out = tmp_path / "out.png"
    assert run([*words, "-o", str(out)]) == 2
    said = capsys.readouterr().err
    assert "matplotlib and resvg_py" in said
    assert install("charts") in said
    assert not out.exists()
