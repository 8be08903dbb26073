"""A start of the engine that goes on from its journal: what it begins with, and what is told about it.

    Comeback.find(...)  ->  an Engine(resumes=True)  ->  Comeback.first(...), the engine's first input

| file of the runtime folder | what |
|---|---|
| `alive.json` | once a second: wall time and engine time; how long the engine was away is counted from there |
| `resuming.json` | tasks that stopped the engine while it resumed them: after the second time they are not rebuilt any more |
"""

import json
import logging
import os
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND, Micros, passed_us
from formiga_bt.base.durable import PRIVATE_FILE, private
from formiga_bt.base.errors import SiteError
from formiga_bt.base.site_folder import write_durably
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import Alarm, CancelGoal, EngineStep, NotifyPeople, Resumed, Serve
from formiga_bt.engine.kernel.journal_levels import JOURNAL, LEVELS
from formiga_bt.engine.kernel.library import Bundles
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Catalogue, Site, Task

if TYPE_CHECKING:
    from formiga_bt.journal.store import BundleRow, Journal

ALIVE: Final = "alive.json"
RESUMING: Final = "resuming.json"
PULSE_S: Final = 1.0
POISON: Final = 2
"""So often a task may stop the engine while it is resumed."""
SHOWN: Final = 8
SEEN: Final = 3
LAST: Final = 500
"""Steps of the last commit are looked for among so many."""
log = logging.getLogger("formiga.resuming")


class Sign(Struct, frozen=True):
    """A sign of life."""

    wall: Micros
    at: Micros
    """Engine time."""
    speed: float = 1.0
    seq: int = 0
    kept: bool = True
    """Everything up to then is in the journal."""
    written: int = 0
    """`seq` of the last step that was on disk."""


def last_sign(folder: Path) -> Sign | None:
    """Return the last sign of life of the former engine; None if there is none that can be read."""
    try:
        return msgspec.json.decode((folder / ALIVE).read_bytes(), type=Sign)
    except (OSError, msgspec.MsgspecError):
        return None


class Pulse:
    """Gives a sign of life once a second, in a thread of its own.

    Args:
        folder: the runtime folder.
        now: engine time.
        speed: of the clock.
        state: the engine's; only its numbers are looked at.
        written: `seq` of the last step that is on disk.
    """

    def __init__(
        self,
        folder: Path,
        now: Callable[[], Micros],
        speed: Callable[[], float],
        state: Callable[[], EngineState],
        written: Callable[[], int] = lambda: 0,
    ) -> None:
        self._written = written
        self._file = folder / ALIVE
        self._now, self._speed, self._state = now, speed, state
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name="formiga-pulse", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """Give a last one, then end."""
        self._end.set()
        if self._thread.is_alive():
            self._thread.join(5.0)

    def _run(self) -> None:
        while True:
            over = self._end.wait(PULSE_S)
            with suppress(OSError):  # then the journal tells, less exactly
                self._give()
            if over:
                return

    def _give(self) -> None:
        state = self._state()
        kept = state.counters.get(JOURNAL, 0) < LEVELS["full"]
        sign = Sign(time.time_ns() // 1000, self._now(), self._speed(), state.seq, kept, self._written())
        beside = self._file.with_name(f".{self._file.name}.new")
        with open(beside, "wb", opener=private) as new:
            new.write(msgspec.json.encode(sign))
        beside.replace(self._file)


class Blame:
    """Which tasks stopped the engine while it resumed them. Its file outlives a process that dies at once.

    Args:
        folder: the runtime folder.
    """

    def __init__(self, folder: Path) -> None:
        self._file = folder / RESUMING
        self._open: int | None = None
        self._length = 0
        self.tries: dict[str, int] = {}
        said: Any = {}
        with suppress(OSError, ValueError):
            said = json.loads(self._file.read_text(encoding="utf-8"))
        if isinstance(said, dict):
            tries = said.get("tries", {})
            self.tries = {str(task): int(n) for task, n in tries.items()} if isinstance(tries, dict) else {}
            if said.get("now"):
                self.count(str(said["now"]))

    @property
    def poison(self) -> tuple[str, ...]:
        """Return the tasks that are not rebuilt any more."""
        return tuple(task for task, n in self.tries.items() if n >= POISON)

    def look(self, task: str) -> None:
        """A task is about to be rebuilt, or (empty) none is any more."""
        with suppress(OSError):
            if self._open is None:
                self._open = os.open(self._file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, PRIVATE_FILE)
            text = json.dumps({"tries": self.tries, "now": task}).encode()
            os.pwrite(
                self._open, text.ljust(self._length), 0
            )  # once for each of thousands of tasks: nothing else is done
            self._length = len(text)
            if not task:
                os.close(self._open)
                self._open = None

    def count(self, task: str) -> None:
        """A task has stopped the engine."""
        self.tries[task] = self.tries.get(task, 0) + 1
        with suppress(SiteError):
            write_durably(self._file, json.dumps({"tries": self.tries, "now": ""}))

    def take(self, step: EngineStep) -> None:
        """Follow the engine: once all is known again, nobody is to blame."""
        for change in step.changes:
            if isinstance(change, ch.ResumePut) and (change.resume is None or change.resume.phase == "watching"):
                self._file.unlink(missing_ok=True)


class Comeback:
    """What a start of the engine goes on from.

    Args:
        state: after the last step that was journaled.
        sign: when the former engine was last alive.
        folder: the runtime folder.
    """

    def __init__(self, state: EngineState, sign: Sign, folder: Path) -> None:
        self.state = state
        self.sign = sign
        self.blame = Blame(folder)
        self.open = [task for task in state.tasks.values() if task.section != "done"]
        """The tasks that had not ended."""
        self.restored = False
        """The journal was restored from a backup."""
        self.again: tuple[CancelGoal | NotifyPeople | Alarm, ...] = ()
        self.node_state = 0
        self.rebuilt: dict[str, str] = {}
        self.lost: dict[str, str] = {}
        self.newer: list[Serve] = []
        """Tasks whose files have changed: new requests get them as they are now."""
        self._wall = time.time_ns() // 1000

    @property
    def without(self) -> frozenset[str]:
        """Return the tasks whose trees are not rebuilt."""
        return frozenset((*self.lost, *self.blame.poison))

    @property
    def outage_us(self) -> Micros:
        """Return how long the engine was away."""
        return max(0, self._wall - self.sign.wall)

    @property
    def begins_at(self) -> Micros:
        """Return the engine time to go on at: the outage has passed for tasks, too."""
        return self.sign.at + round(self.outage_us * self.sign.speed) if self.open else 0

    def first(self, epoch: int, unbuilt: Mapping[str, str]) -> Resumed:
        """Return the engine's first input.

        Args:
            epoch: of this start.
            unbuilt: what the engine could not rebuild.
        """
        return Resumed(
            epoch=epoch,
            at=self.sign.at,
            since=self.sign.wall,
            wall=self._wall,
            heard=passed_us(),
            speed=self.sign.speed,
            node_state=self.node_state,
            rebuilt=self.rebuilt,
            lost={**unbuilt, **self.lost},
            poison=self.blame.poison,
            again=self.again,
            restored=self.restored,
        )

    def told(self, site: Site) -> list[str]:
        """Return what people should know of it, in sentences."""
        mine = [task for task in self.open if not task.system.agent]
        held = [
            "restored from a backup: all is HELD, under lockdown. Look at your machines, then: formiga lockdown release"
        ]
        if not self.open:
            return held if self.restored else []
        away = (
            f"{self.outage_us / SECOND:.1f} s"
            if self.outage_us < 600 * SECOND
            else f"{self.outage_us // (60 * SECOND)} min"
        )
        names = [task.id for task in mine]
        shown = ", ".join(names[:SHOWN]) + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")
        said = [f"resumed after {away}: {shown or 'ways home'}; what became of their goals is asked now"]
        if self.restored:
            said += [*held, "then formiga continue TASK, or formiga abort TASK, for each"]
        elif self.outage_us > site.resume_hold_after_us:
            see = ", ".join(f"formiga why {task}" for task in names[:SEEN])
            said.append(f"they wait for a person, for the outage was long{f'; see {see}' if see else ''}")
        said += [f"{task} is not resumed: {why}; its machines come home" for task, why in self.lost.items()]
        said += [f"{task} stopped the engine {POISON} times; its machines come home" for task in self.blame.poison]
        return said


def find(journal: "Journal", folder: Path, tasks: Bundles, site: Site, catalogue: Catalogue) -> Comeback | None:
    """Return what to go on from, or None: the journal has nothing of this site.

    Versions of tasks that the state names are added to `tasks`, read from the exact files that were kept.

    Raises:
        JournalError: the journal cannot be read.
    """
    from formiga_bt.journal.past import Past

    if journal.first_snapshot_at() is None:
        return None
    state = Past(journal).state()
    seq, at = journal.last()
    last = list(journal.read(max(0, seq - LAST)))
    wall = last[-1].wall if last else 0
    starts = journal.starts()
    if starts:
        wall = max(wall, starts[-1].wall, starts[-1].ended or 0)
    sign = last_sign(folder)
    heard = max((agent.heard_at for agent in state.agents.values()), default=0)
    older = sign is not None and sign.written > seq
    if sign is None or older:  # how long the engine was away is counted from what is known of it
        seq = max(seq, sign.seq) if sign is not None else seq
        sign = Sign(wall, max(at, heard), seq=seq)
    elif sign.wall < wall:  # a step, or a clean end, came after it
        sign = Sign(
            wall, max(at, heard, sign.at + round((wall - sign.wall) * sign.speed)), sign.speed, sign.seq, sign.kept
        )
    state.seq = max(state.seq, seq, sign.seq) + 1
    state.now = max(state.now, at, heard)
    found = Comeback(state, replace_at(sign, state.now), folder)
    found.node_state = int(starts[-1].versions.get("node_state", 0)) if starts else 0
    found.again = tuple(
        effect
        for kept in last
        if kept.wall == last[-1].wall and starts[-1].ended is None  # after a clean end all have left
        for effect in kept.step.effects
        if isinstance(effect, CancelGoal | NotifyPeople | Alarm)
    )
    if older:
        found.again += (Alarm("journal_older", _older(at)),)
    _check_catalogue(state, catalogue)
    _rebuild(found, journal.bundles(), tasks, site, catalogue)
    return found


def _older(at: Micros) -> str:
    return (
        f"the journal ends at {datetime.fromtimestamp(at / SECOND).astimezone():%Y-%m-%d %H:%M:%S}, before the end of what was "
        "kept: it is an older copy, or its -wal was removed; look at what its tasks did since"
    )


def _check_catalogue(state: EngineState, catalogue: Catalogue) -> None:
    """Refuse to go on without what machines of open tasks are, and do.

    Raises:
        SiteError: the catalogue has not a type or an action any more.
    """
    for agent in state.agents.values():
        if agent.task and agent.type not in catalogue.types:
            raise SiteError(_gone(f"type {agent.type}", f"{agent.id} works for {agent.task}"))
    for goal in state.goals.values():
        if goal.action not in catalogue.actions:
            raise SiteError(_gone(f"action {goal.action}", f"{goal.agent} does it for {goal.task or 'the engine'}"))


def _gone(what: str, why: str) -> str:
    return (
        f"the catalogue has no {what} any more, and {why}\n"
        "  help: start once more with the old catalogue (--actions FILE) until that has ended, or was aborted"
    )


def replace_at(sign: Sign, at: Micros) -> Sign:
    """Return a sign that is not before the state."""
    return msgspec.structs.replace(sign, at=max(sign.at, at))


# -- versions of tasks -------------------------------------------------------------------------------------------------
def _rebuild(found: Comeback, rows: "list[BundleRow]", tasks: Bundles, site: Site, catalogue: Catalogue) -> None:
    state = found.state
    kept = {(row.name, row.bundle): row for row in rows}
    before: dict[str, Task] = {}
    for task in found.open:
        if task.request.bundle == "system":
            continue
        model, why = _version(kept, tasks, site, catalogue, task.name, task.request.bundle)
        if model is None:
            found.lost[task.id] = why
            continue
        found.rebuilt[task.id] = task.request.bundle
        if task.name not in state.library:
            before[task.name] = model
    for name, versions in state.library.items():
        for version in versions:
            _version(kept, tasks, site, catalogue, name, version.bundle)
    for name, now in list(tasks.items()):
        newest = state.library[name][-1].bundle if name in state.library else now.bundle
        first = before.get(name)
        if first is not None and first.bundle != now.bundle:
            tasks.serve(first)  # so that what runs keeps its number, and what is new gets the next
            newest = first.bundle
        if newest != now.bundle:
            found.newer.append(Serve(name, now.bundle, "engine"))


def _version(
    kept: "Mapping[tuple[str, str], BundleRow]",
    tasks: Bundles,
    site: Site,
    catalogue: Catalogue,
    name: str,
    bundle: str,
) -> tuple[Task | None, str]:
    """Return a version of a task, added to `tasks` from the files that were kept if it is not there; or why it cannot be."""
    there = tasks.version(name, bundle)
    if there is not None:
        return there, ""
    row = kept.get((name, bundle))
    if row is None:
        return None, "the journal has not the files that it was started with"
    texts = row.texts

    def read(path: Path) -> str:
        for last in (len(path.parts), 2):  # the very file; or one of the same name, if the folder is another one now
            for one, text in texts.items():
                if Path(one).parts[-last:] == path.parts[-last:]:
                    return text
        raise FileNotFoundError(2, "it was not kept", str(path))

    text = texts.get(row.file)
    if text is None:
        return None, f"the journal has not the text of {row.file}"
    loaded = load_task_text(
        text, row.file, catalogue=catalogue, site=site, folder_=Path(row.file).parent, read=read
    )  # fmt: skip
    if loaded.task is None:
        first = next((one for one in loaded.diagnostics if one.severity == "error"), None)
        return None, f"{first.mark}: {first.code}: {first.message}" if first is not None else "it is no task"
    made = replace(loaded.task, bundle=bundle)  # its hash holds the catalogue of then
    tasks.add(made)
    return made, ""
