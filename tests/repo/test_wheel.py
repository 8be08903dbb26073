"""An installed formiga needs no checkout: the wheel carries the catalogue and the task library."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel and unpack it, as pip would, into a folder of its own."""
    folder = tmp_path_factory.mktemp("wheel")
    checkout = folder / "checkout"
    keep_out = shutil.ignore_patterns(".*", "__pycache__", "build", "dist")
    shutil.copytree(ROOT, checkout, ignore=keep_out)
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(checkout)]
    done = subprocess.run(build, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = folder.glob("*.whl")
    site = folder / "site"
    zipfile.ZipFile(wheel).extractall(site)
    shutil.rmtree(checkout)
    return site


def formiga(site: Path, cwd: Path, *args: str) -> "subprocess.CompletedProcess[str]":
    """Run the unpacked package from `cwd`; its path comes before the editable install of this checkout."""
    env = {**os.environ, "PYTHONPATH": str(site)}
    return subprocess.run(
        [sys.executable, "-m", "formiga_bt", *args], cwd=cwd, env=env, capture_output=True, text=True, check=False
    )


def test_the_wheel_checks_its_own_trees_from_an_empty_folder(installed: Path, tmp_path: Path) -> None:
    trees = installed / "formiga_bt" / "_data" / "trees"
    done = formiga(installed, tmp_path, "check", "--strict", str(trees))
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("ok: ")


def test_the_wheel_does_not_use_the_checkout(installed: Path, tmp_path: Path) -> None:
    env = {**os.environ, "PYTHONPATH": str(installed)}
    code = "import formiga_bt.base.packaged as p; print(p.folder('actions'))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=env, capture_output=True, text=True, check=True
    )
    assert Path(done.stdout.strip()) == installed / "formiga_bt" / "_data" / "actions"


def test_the_wheel_has_the_guide_to_the_language_for_assistants(installed: Path, tmp_path: Path) -> None:
    code = "from formiga_bt.llm.mcp.pages import language, topics; print(len(topics()), language('roles')[:7])"
    env = {**os.environ, "PYTHONPATH": str(installed)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=env, capture_output=True, text=True, check=True
    )
    assert done.stdout == f"{len(list((ROOT / 'docs' / 'language').glob('*.md'))) - 1} # Roles\n"


def test_the_wheel_makes_a_site_whose_first_task_flies(installed: Path, tmp_path: Path) -> None:
    assert formiga(installed, tmp_path, "init", "meadow").returncode == 0
    words = ("trees/hello.yaml", "--site", "site.yaml")
    for verb in ("check", "dryrun"):
        done = formiga(installed, tmp_path / "meadow", verb, *words)
        assert done.returncode == 0, done.stdout + done.stderr


def test_the_wheel_explains_codes_and_prints_schemas(installed: Path, tmp_path: Path) -> None:
    page = formiga(installed, tmp_path, "explain", "E031").stdout
    assert "Wrong:" in page
    assert "can still be airborne" in page
    assert "Why a task ended" in formiga(installed, tmp_path, "explain", "no_agent").stdout
    assert "drone.GoTo" in formiga(installed, tmp_path, "schema", "--editor").stdout


def test_the_wheel_has_no_adapter_but_its_card_and_says_where_it_is(installed: Path, tmp_path: Path) -> None:
    """13 MB that only drafts with one local model need."""
    assert not list(installed.rglob("*.gguf"))
    code = "from formiga_bt.llm.adapters import absent; print(absent('qwen2.5-coder-0.5b'), absent('smollm2'))"
    env = {**os.environ, "PYTHONPATH": str(installed)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=env, capture_output=True, text=True, check=True
    )
    assert "--adapter FILE" in done.stdout
