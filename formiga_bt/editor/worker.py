"""Checks in a process of their own, so that the one that answers an editor is never busy with them.

The server's side is `CheckerProcess`: it starts the process, hands it one job at a time, and kills it when a newer text of the
very file makes its work worthless. The other side is `main`: jobs come in over stdin, reports go out over stdout, pickled, each
with its length before it. A report holds data only; what was visible at steps is put together again with the server's own
catalogue.
"""

import gc
import json
import os
import pickle
import struct
import subprocess
import sys
import traceback
from collections.abc import Mapping
from contextlib import redirect_stdout, suppress
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import IO, Any, Final

from formiga_bt.base.diagnostics import Diagnostic
from formiga_bt.editor.checks import Checked, check
from formiga_bt.editor.project import Document, Project
from formiga_bt.editor.seen import Seen
from formiga_bt.lang.expr.scope import MaybeUnset, Scope
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.types import Type

_START: Final = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from formiga_bt.editor.worker import main; main()"
)
NICE: Final = 5
"""Who answers an editor goes before who checks."""
_LENGTH: Final = struct.Struct(">Q")


@dataclass(frozen=True, slots=True)
class CheckJob:
    """A file to check, with all that the editor has open."""

    actions: tuple[Path, ...]
    site: Path | None
    root: Path | None
    path: Path
    texts: Mapping[Path, tuple[int, str]]
    """Version and text of each open file."""


@dataclass(frozen=True, slots=True)
class Visible:
    """A `Scope` without what the server has itself."""

    names: Mapping[str, Type]
    maybe_unset: Mapping[str, MaybeUnset]
    roles: frozenset[str]
    built_ins: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Report:
    """What a check found."""

    version: int
    diagnostics: tuple[Diagnostic, ...] = ()
    visible: tuple[Visible, ...] = ()
    at: tuple[tuple[int, int, int], ...] = ()
    """Line and column of each step, with the number of what is visible there."""
    error: str = ""
    """The check itself went wrong: the traceback."""

    def checked(self, document: Document, catalogue: Catalogue, site: Site | None) -> Checked:
        """Return what was found of a document, with scopes that read this process's catalogue and site."""
        scopes = [
            Scope(
                one.names,
                agent_types=catalogue.types,
                roles=one.roles,
                maybe_unset=one.maybe_unset,
                site=site,
                built_ins=one.built_ins,
            )
            for one in self.visible
        ]
        at = [(line, col, scopes[number]) for line, col, number in self.at]
        return Checked(self.version, self.diagnostics, Seen(document.lines, at) if at else None)


def reported(found: Checked) -> Report:
    """Return what a check found as data."""
    numbers: dict[int, int] = {}
    visible: list[Visible] = []
    at = []
    for line, col, scope in found.seen.at if found.seen is not None else ():
        if id(scope) not in numbers:
            numbers[id(scope)] = len(visible)
            visible.append(Visible(dict(scope.names), dict(scope.maybe_unset), scope.roles, scope.built_ins))
        at.append((line, col, numbers[id(scope)]))
    return Report(found.version, found.diagnostics, tuple(visible), tuple(at))


# --- the server's side ---------------------------------------------------------------------------------------------


class CheckerProcess:
    """One process that checks, replaced when it is killed."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._path: Path | None = None
        """What it works at."""

    def warm_up(self) -> None:
        """Start the process before there is anything to check."""
        with self._lock:
            self._started()

    def overtake(self, path: Path) -> None:
        """A file has a newer text: a check of its last one is given up."""
        with self._lock:
            if self._path == path:
                self._kill()

    def check(self, job: CheckJob) -> Report | None:
        """Check a file, in a thread that may wait; None if it was overtaken.

        Raises:
            RuntimeError: the check went wrong; its traceback.
        """
        with self._lock:
            process = self._started()
            self._path = job.path
        try:
            assert process.stdin is not None
            assert process.stdout is not None
            _write(process.stdin, job)
            report: Report | None = _read(process.stdout)
        except (OSError, EOFError):
            report = None
        with self._lock:
            self._path = None
            given_up = self._process is not process
            if report is None and not given_up:
                self._process = None
            if report is None or given_up:
                _let_go(process)
        if report is None and not given_up:
            raise RuntimeError(f"the checking process ended with {process.returncode}")
        if report is not None and report.error:
            raise RuntimeError(report.error)
        return report

    def stop(self) -> None:
        """End the process."""
        with self._lock:
            self._kill()

    def _started(self) -> "subprocess.Popen[bytes]":
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-c", _START, json.dumps(sys.path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
            )
        return self._process

    def _kill(self) -> None:
        """End the process; who reads from it sees that, and closes its pipes."""
        if self._process is not None:
            self._process.kill()
            if self._path is None:
                _let_go(self._process)
        self._process = None


def _let_go(process: "subprocess.Popen[bytes]") -> None:
    """Wait for the end of a process that has closed its pipes, or was killed."""
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with suppress(OSError):
                pipe.close()
    process.wait()


# --- the process -----------------------------------------------------------------------------------------------------


@dataclass(slots=True)
class _Desk:
    """What is kept from job to job: the project with the catalogue and sites that it has read."""

    project: Project = field(default_factory=Project)
    told: Any = None

    def work(self, job: CheckJob) -> Report:
        told = (job.actions, job.site, job.root)
        if told != self.told:
            self.project, self.told = Project(job.actions, job.site, job.root), told
        self.project.open = {path: Document(path, text, version) for path, (version, text) in job.texts.items()}
        return reported(check(self.project, self.project.open[job.path]))


def main() -> None:
    """Check what comes in until nothing comes any more. What is printed meanwhile goes to stderr."""
    with suppress(OSError):
        os.nice(NICE)
    gc.disable()  # a check makes much and drops it whole: looking for garbage meanwhile takes longer than the check
    desk = _Desk()
    words_in, words_out = sys.stdin.buffer, sys.stdout.buffer
    with redirect_stdout(sys.stderr), suppress(EOFError, KeyboardInterrupt, BrokenPipeError):
        while True:
            job = _read(words_in)
            try:
                report = desk.work(job)
            except Exception:  # noqa: BLE001 - told to the server, which goes on
                report = Report(-1, error=traceback.format_exc())
            _write(words_out, report)
            gc.collect()


def _write(pipe: IO[bytes], what: Any) -> None:
    data = pickle.dumps(what, pickle.HIGHEST_PROTOCOL)
    pipe.write(_LENGTH.pack(len(data)) + data)
    pipe.flush()


def _read(pipe: IO[bytes]) -> Any:
    head = pipe.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        raise EOFError
    (length,) = _LENGTH.unpack(head)
    data = pipe.read(length)
    if len(data) < length:
        raise EOFError
    return pickle.loads(data)
