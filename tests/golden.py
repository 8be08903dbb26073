"""The wording of the product, pinned in one file a room: tests assert facts and codes, and give texts to `wording`.

`wording(text)` in a test of tests/unit/cli compares the text with the test's entry in tests/unit/cli/wording.txt, and
`wording.file(path, text)` with a whole file. `pytest --update-golden [PATH]` writes both as they are now: read the
difference, for it is what people will read. What differs from machine to machine (temporary folders, loopback ports,
process ids) and digests read <tmp>, <n> and <digest>; what the wall clock says is left out by `timeless`.
"""

import difflib
import os
import platform
import re
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TMP = re.escape(tempfile.gettempdir())
NORMAL = (
    (re.compile(rf"{TMP}/pytest-of-[^/\s]+/pytest-\d+(/popen-gw\d+)?(/[\w.-]+?\d+(?=\W|$))?"), "<tmp>"),
    (re.compile(rf"{TMP}/(tmp|formiga-[a-z]+-)\w{{8}}\b|{TMP}(?=[\s:,;]|$)"), "<tmp>"),
    (re.compile(r"(?<![\w/])test_\w{25}\d\b"), "<tmp>"),  # a site that has the name of its folder
    (re.compile(r"postgresql:\S*%2Fformiga-pg-\w{8}\b"), "<postgres>"),
    (re.compile(re.escape(sys.executable)), "<python>"),
    (re.compile(rf"(?<=\(process ){os.getpid()} on {re.escape(platform.node())}(?=\))"), "<n> on <host>"),
    (re.compile(rf"{re.escape(str(ROOT))}(?=/)"), "<formiga>"),
    (re.compile(r"(?<=127\.0\.0\.1:)\d{4,5}\b|(?<=127\.0\.0\.1', )\d{4,5}\b"), "<n>"),
    (re.compile(rf"\b{os.getpid()}\b"), "<n>"),
    (re.compile(r"\b[0-9a-f]{64}\b|\b(?=[a-f]*[0-9])(?=[0-9]*[a-f])[0-9a-f]{8}([0-9a-f]{8})?\b"), "<digest>"),
    (re.compile(r"(?<=\()[0-9]{8}(?=\))"), "<digest>"),  # one without a letter
)
HEAD = "# What people read of this room, one entry a test. Written by pytest --update-golden: read it, do not edit it."


class Golden:
    """The golden files of a run of pytest. `update`: they are written and nothing is compared.

    `files` are those whose tests were all collected, `tests` the ids of the tests there that give a wording.
    """

    def __init__(self, update: bool) -> None:
        self.update = update
        self.files: set[str] = set()
        self.tests: set[str] = set()
        self._rooms: dict[Path, dict[str, str]] = {}

    def room(self, file: Path) -> dict[str, str]:
        """Return the entries of a file by their keys, which are tests (`test_x.py::test_y`, or ` (2)` after it)."""
        if file not in self._rooms:
            blocks = (
                re.split(r"^(?=\S)", file.read_text(encoding="utf-8"), flags=re.MULTILINE)[2:] if file.exists() else []
            )
            heads = (block.partition("\n") for block in blocks)
            self._rooms[file] = {
                key: re.sub("^    ", "", body, flags=re.MULTILINE).rstrip("\n") for key, _, body in heads
            }
        return self._rooms[file]

    def stale(self) -> list[str]:
        """Return entries whose test is gone or gives no wording any more, as far as files were collected."""
        found = []
        for file in sorted(ROOT.glob("tests/**/wording.txt")):
            for key in self.room(file):
                test = f"{file.parent.relative_to(ROOT).as_posix()}/{_order(key)[0]}"
                where = test.partition("::")[0]
                if (where in self.files and test not in self.tests) or not (ROOT / where).exists():
                    found.append(f"{file.relative_to(ROOT)}: {key}")
        return found

    def write(self) -> None:
        """Write each room, less what is stale."""
        gone = self.stale()
        for file, entries in self._rooms.items():
            kept = {key: text for key, text in entries.items() if f"{file.relative_to(ROOT)}: {key}" not in gone}
            lines = (
                key + "\n" + re.sub(r"^(?=.)", "    ", kept[key], flags=re.MULTILINE)
                for key in sorted(kept, key=_order)
            )
            file.write_text("\n\n".join((HEAD, *lines)) + "\n", encoding="utf-8") if kept else file.unlink(
                missing_ok=True
            )


class Wording:
    """The texts of one test, in the order in which it gives them."""

    def __init__(self, golden: Golden, test: str) -> None:
        parts = Path(test.partition("::")[0]).parts
        folder = Path(*parts[: 3 if parts[1] == "unit" else 2])
        self._golden, self._test = golden, test
        self._file = ROOT / folder / "wording.txt"
        self._key = test.removeprefix(f"{folder.as_posix()}/")
        self._given = 0

    def __call__(self, *texts: object) -> None:
        """Compare texts with the next entry of the test; of a list each item is a line."""
        __tracebackhide__ = True
        self._given += 1
        key = self._key + (f" ({self._given})" if self._given > 1 else "")
        text = normal("\n".join(line for one in texts for line in _lines(one)))
        entries = self._golden.room(self._file)
        if self._golden.update:
            entries[key] = text
        self._compare(f"{self._file.relative_to(ROOT)}: {key}", entries.get(key, ""), text)

    def file(self, path: Path, text: str) -> None:
        """Compare a text with a whole file."""
        __tracebackhide__ = True
        if self._golden.update:
            path.write_text(text, encoding="utf-8")
        self._compare(str(path), path.read_text(encoding="utf-8") if path.exists() else "", text)

    def end(self) -> None:
        """Nothing was left out. Called when the test passed."""
        entries = self._golden.room(self._file)
        left = [key for key in entries if _order(key)[0] == self._key and _order(key)[1] > self._given]
        for key in left if self._golden.update else ():
            del entries[key]
        self._compare(f"{self._file.relative_to(ROOT)}, not given", "" if self._golden.update else "\n".join(left), "")

    def _compare(self, where: str, expected: str, came: str) -> None:
        __tracebackhide__ = True
        if expected != came:
            lines = difflib.unified_diff(expected.split("\n"), came.split("\n"), where, "now", lineterm="", n=2)
            again = f'If the new wording is right: python -m pytest --update-golden "{self._test}"'
            pytest.fail("\n".join((*lines, again)))


def normal(text: str) -> str:
    """Return a text as it would be on another machine, each unprintable character escaped, no blanks at ends of lines."""
    for pattern, instead in NORMAL:
        text = pattern.sub(instead, text)
    text = "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in text)
    return re.sub(r" +$", "", text, flags=re.MULTILINE).strip("\n")


def having(text: str, *words: str) -> list[str]:
    """Return the lines of a long text that have one of some words."""
    return [line for line in text.split("\n") if any(word in line for word in words)]


def timeless(text: str) -> str:
    """Return what was said by the wall clock without its dates and its seconds and minutes."""
    return re.sub(r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d(:\d\d)?Z?|\b\d+(\.\d+)? (s|min)\b( \d+ s\b)?", "<time>", text)


def _lines(one: object) -> Iterable[str]:
    if isinstance(one, str | BaseException) or not isinstance(one, Iterable):
        return [str(one)]
    lines = [" | ".join(map(str, line)) if isinstance(line, tuple | list) else str(line) for line in one]
    return sorted(lines) if isinstance(one, set | frozenset) else lines


def _order(key: str) -> tuple[str, int]:
    """Return the test of a key, and which of its texts it is."""
    numbered = re.fullmatch(r"(.*) \((\d+)\)", key)
    return (numbered[1], int(numbered[2])) if numbered else (key, 1)
