"""`formiga sim` beside a running engine: agents are processes, the API takes the tasks, faults come on the engine's clock."""

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from formiga_bt.base.packaged import folder
from formiga_bt.base.site_folder import find_engines
from tests.e2e.rig import wait_until

pytestmark = pytest.mark.network


@pytest.fixture
def engine(tmp_path: Path) -> Iterator[Path]:
    """Run the engine of the demo's site in a folder."""
    shutil.copy(folder("trees") / "demo-site.yaml", tmp_path / "site.yaml")
    words = ["up", "--speed", "20", "--http", "127.0.0.1:0", "--listen", "tcp/127.0.0.1:0", "--quiet"]
    words += ["--tasks", str(folder("trees"))]
    with (tmp_path / "up.log").open("wb") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "formiga_bt", *words], cwd=tmp_path, stdout=log, stderr=log, stdin=subprocess.DEVNULL
        )
    try:
        wait_until(lambda: find_engines(tmp_path) or process.poll() is not None, what="the engine is up")
        yield tmp_path
    finally:
        process.terminate()
        process.wait(10)


def sim(cwd: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, "-m", "formiga_bt", "sim", *words],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=90,
        check=False,
    )


def test_a_scenario_is_played_beside_a_running_engine(engine: Path) -> None:
    done = sim(engine, "nonsense")
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.findall(r"^fault: (.*)$", done.stdout, re.MULTILINE) == [
        "hwd_2: nan",
        "lwd_1: nan",
        "hwd_2: wrong_id hwd_1 x2",
        "hwd_1: lose_result",
    ]
    assert re.search(r"^PickUp-1 .*SUCCEEDED$", done.stdout, re.MULTILINE)
    assert re.search(r"^MoveTask-2 .*SUCCEEDED$", done.stdout, re.MULTILINE)
    assert "crashes: 0, starts near people without clearance: 0" in done.stdout


def test_an_engine_that_is_not_there_is_said_in_words(tmp_path: Path) -> None:
    done = sim(tmp_path, "nonsense", "--connect", "tcp/127.0.0.1:9")
    assert done.returncode == 1
    assert "no engine answers at tcp/127.0.0.1:9 (site 'rovaniemi')" in done.stderr
    assert "Traceback" not in done.stderr
