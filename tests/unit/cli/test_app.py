"""The frame of the command line: help, version, unknown verbs, errors and exit codes, speed of start."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from formiga_bt import __version__
from formiga_bt.base.diagnostics import Diagnostic, Mark
from formiga_bt.base.errors import TaskError, TreeError
from formiga_bt.cli import app, main
from formiga_bt.cli.app import run
from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.verbs import verbs
from tests.golden import Wording

HEAVY = {"numpy", "lap", "zenoh", "py_trees", "pyproj", "shapely", "graphviz", "sqlalchemy"}


def test_help_lists_every_verb_with_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--help"]) == 0
    words = " ".join(capsys.readouterr().out.split())
    for verb in verbs().values():
        assert f"{verb.name} {verb.help}" in words or (verb.name in words and verb.help[:30] in words)


def test_no_argument_is_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([]) == 0
    assert "Usage: formiga" in capsys.readouterr().out


@pytest.mark.parametrize("args", [["--version"], ["-V"]])
def test_version(args: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(args) == 0
    assert capsys.readouterr().out == f"formiga {__version__}\n"


def test_an_unknown_verb_gets_the_nearest_one(capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    assert run(["chekc"]) == 2
    wording(capsys.readouterr().err)


@pytest.mark.parametrize("name", list(verbs()))
def test_each_verb_has_help(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([name, "--help"]) == 0
    assert f"Usage: formiga {name}" in capsys.readouterr().out


def test_an_unknown_option_is_a_usage_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "--nope", "x.yaml"]) == 2
    assert "--nope" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (UnusableFile("cannot read x"), 2),
        (TaskError("unknown_task", "there is no task t1"), 1),
        (TreeError("x.yaml cannot be used", [Diagnostic("E004", Mark("x.yaml", 1, 1), "unknown key")]), 1),
        (KeyboardInterrupt(), 130),
    ],
)
def test_errors_of_ours_end_in_words_and_a_code(
    error: BaseException, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def command() -> None:
        raise error

    monkeypatch.setattr(app, "import_module", lambda _path: SimpleNamespace(command=command))
    assert run(["check"]) == code
    said = capsys.readouterr().err
    assert str(error) in said
    assert "Traceback" not in said


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["check", "trees"], ["sim", "nonsense", "--virtual"]])
def test_a_full_disk_is_told_in_one_line(words: list[str], wording: Wording) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "formiga_bt", *words], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 1
    wording(done.stderr)


def test_who_closed_its_output_gets_the_code_and_no_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    assert run(["--version"]) == 0
    assert run(["check", "no/such.yaml"]) == 2


def test_ctrl_c_while_things_are_imported_is_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(app, "verbs", interrupted)
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 130


def test_starting_and_listing_verbs_loads_nothing_heavy() -> None:
    code = (
        f"import sys; from formiga_bt.cli.app import run; run(['--help']); print(sorted({HEAVY!r} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_a_verb_that_asks_an_engine_does_not_load_the_task_language(tmp_path: Path) -> None:
    code = (
        "import sys; from formiga_bt.cli.app import run; run(['tasks']); print('formiga_bt.lang.text' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout.splitlines()[-1] == "False"


def test_python_m_is_the_same_command() -> None:
    done = subprocess.run([sys.executable, "-m", "formiga_bt", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"formiga {__version__}\n"
