"""A test marked `external` may not slip away unseen: with FORMIGA_EXTERNAL it runs, or it fails."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SKIPS = "import pytest\n\n@pytest.mark.external\ndef test_it():\n    pytest.skip('no database here')\n"


@pytest.mark.parametrize(("external", "select", "outcome"), [("1", "", "1 failed"), ("", "", "1 skipped")])
def test_a_skipped_external_test_fails_where_external_is_asked_for(
    external: str, select: str, outcome: str, tmp_path: Path
) -> None:
    shutil.copy(ROOT / "tests" / "conftest.py", tmp_path)
    (tmp_path / "test_it.py").write_text(SKIPS, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-c", str(ROOT / "pyproject.toml"), "--rootdir", str(tmp_path)]
    done = subprocess.run(
        [*command, "-p", "no:cacheprovider", "-m", select, str(tmp_path)],
        cwd=tmp_path,
        env={**os.environ, "FORMIGA_EXTERNAL": external},
        capture_output=True,
        text=True,
        check=False,
    )
    assert outcome in done.stdout.splitlines()[-1], done.stdout + done.stderr
