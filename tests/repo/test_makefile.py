"""Every command of the Makefile can be read by the shell, whatever a fresh checkout still has to make first."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TARGETS = re.findall(r"^\.PHONY: (.+)$", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)[0].split()


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("given", [(), ("EXTERNAL=1",)], ids=["plain", "external"])
def test_the_shell_can_read_the_commands_of_each_target(tmp_path: Path, target: str, given: tuple[str, ...]) -> None:
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    printed = subprocess.run(["make", "-n", target, *given], cwd=tmp_path, capture_output=True, text=True, check=True)
    read = subprocess.run(["sh", "-n"], input=printed.stdout, capture_output=True, text=True, check=False)
    assert not read.stderr, printed.stdout
