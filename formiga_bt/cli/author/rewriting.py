"""Files that a verb changes: read with their line ends, shown as a difference, replaced in one step.

Called by `formiga fmt` and `formiga fix`.
"""

import difflib
import os
import shutil
from pathlib import Path

from formiga_bt.cli.inputs import UnusableFile, readable


def read_exactly(path: Path) -> str:
    """Return a file's text with the line ends that it has.

    Raises:
        UnusableFile: it cannot be read, or is no UTF-8 text.
    """
    try:
        with readable(path).open(encoding="utf-8", newline="") as file:
            return file.read()
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise UnusableFile(f"cannot read {path}: {why}") from error


def difference(path: Path, old: str, new: str) -> str:
    """Return the unified difference of two texts of a file."""
    before, after = old.splitlines(keepends=True), new.splitlines(keepends=True)
    lines = difflib.unified_diff(before, after, str(path), str(path))
    return "".join(line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n" for line in lines)


def rewrite(path: Path, text: str) -> None:
    """Replace a file by a new text; whoever reads it meanwhile sees the old or the new one.

    Raises:
        UnusableFile: it cannot be written.
    """
    path = path.resolve()
    beside = path.with_name(f".{path.name}.new")
    try:
        with beside.open("w", encoding="utf-8", newline="") as file:
            file.write(text)
        shutil.copymode(path, beside)
        os.replace(beside, path)
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise UnusableFile(f"cannot write {path}: {error.strerror or error}") from error


def yaml_files(paths: list[Path]) -> list[Path]:
    """Return the files, with each folder replaced by the YAML files below it.

    Raises:
        UnusableFile: a path cannot be read, or a folder holds no YAML file.
    """
    found: list[Path] = []
    for path in paths:
        if not path.is_dir():
            found.append(readable(path))
            continue
        below = sorted(p for p in path.rglob("*.y*ml") if p.suffix in (".yaml", ".yml") and p.is_file())
        if not below:
            raise UnusableFile(f"no YAML file (*.yaml, *.yml) below {path}")
        found += below
    return list(dict.fromkeys(found))
