"""Files of one agent that outlive its process: the body's state, and the ledger of its motion.

`<id>.body.json` is replaced at each change of motion and at least every half second, so that a drone whose process was
killed is found hovering where it was. `<id>.motion.jsonl` grows by a line per segment, rotor start or place of a
person; `judge` reads all ledgers of a folder to a `Referee`. Written by `__main__`, read by it and by whoever judges.
"""

import heapq
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct

from agents_sim.lines import Disk, Lines
from agents_sim.motion import BodyState, MotionKind, PersonState, Recorder, Segment
from formiga_bt.base.clock import Micros
from formiga_bt.base.geo import Place
from formiga_bt.transport.messages import Clearance


class Saved(Struct, frozen=True, kw_only=True):
    """The body as it was saved: at which engine and wall time, at which speed of the engine's clock."""

    body: BodyState | PersonState
    engine_us: Micros
    wall_us: Micros
    speed: float


class BodyFile:
    """The state file of one agent.

    Args:
        folder: where it is.
        agent: whose.
        disk: whom to tell that it cannot be written.
    """

    def __init__(self, folder: Path, agent: str, disk: Disk | None = None) -> None:
        self._path = folder / f"{agent}.body.json"
        self._new = folder / f"{agent}.body.json.new"
        self._disk = disk if disk is not None else Disk(agent)

    def save(self, saved: Saved) -> None:
        """Replace the file at once: a reader finds the old state or the new one, never half of it.

        On a full disk the old one stays.
        """
        try:
            self._new.write_bytes(msgspec.json.encode(saved))
            os.replace(self._new, self._path)
        except OSError as error:
            self._disk.failed(self._path.name, error)
        else:
            self._disk.worked(self._path.name)

    def load(self) -> Saved | None:
        """Return what was saved, None if there is nothing.

        Raises:
            ValueError: the file is not one of ours.
        """
        try:
            return msgspec.json.decode(self._path.read_bytes(), type=Saved)
        except FileNotFoundError:
            return None
        except msgspec.DecodeError as error:
            raise ValueError(f"{self._path} is no body file: {error}; delete it to begin anew") from error


class MotionNote(Struct, frozen=True, tag="motion"):
    """A ledger line: from `segment.t0` on the drone moves so."""

    agent: str
    segment: Segment
    kind: MotionKind

    @property
    def at(self) -> Micros:
        """Return when it begins."""
        return self.segment.t0

    def tell(self, recorder: Recorder) -> None:
        """Pass the line on."""
        recorder.moved(self.agent, self.segment, self.kind)


class RotorNote(Struct, frozen=True, tag="rotors"):
    """A ledger line: rotors started."""

    agent: str
    at: Micros
    place: Place
    clearance: Clearance | None

    def tell(self, recorder: Recorder) -> None:
        """Pass the line on."""
        recorder.rotors_started(self.agent, self.at, self.place, self.clearance)


class PersonNote(Struct, frozen=True, tag="person"):
    """A ledger line: from `at` on the person stands there."""

    agent: str
    at: Micros
    place: Place

    def tell(self, recorder: Recorder) -> None:
        """Pass the line on."""
        recorder.person_at(self.agent, self.at, self.place)


Note = MotionNote | RotorNote | PersonNote


class NoteTaker:
    """A `Recorder` that makes each call a `Note` and hands it to `take`."""

    def __init__(self, take: Callable[[Note], None]) -> None:
        self._take = take

    def moved(self, agent: str, segment: Segment, kind: MotionKind) -> None:
        """Note a motion."""
        self._take(MotionNote(agent, segment, kind))

    def rotors_started(self, agent: str, at: Micros, place: Place, clearance: Clearance | None) -> None:
        """Note a rotor start."""
        self._take(RotorNote(agent, at, place, clearance))

    def person_at(self, person: str, at: Micros, place: Place) -> None:
        """Note where a person stands."""
        self._take(PersonNote(person, at, place))


class Ledger:
    """The ledger file of one agent, open for appending.

    Args:
        folder: where it is.
        agent: whose.
        disk: whom to tell that it cannot be written.
    """

    def __init__(self, folder: Path, agent: str, disk: Disk | None = None) -> None:
        self._lines = Lines(folder / f"{agent}.motion.jsonl", disk if disk is not None else Disk(agent))

    def write(self, note: Note) -> None:
        """Append a line; if there is room it is with the operating system when this returns."""
        self._lines.write(msgspec.json.encode(note))

    def try_again(self) -> None:
        """Write what had no room."""
        self._lines.try_again()

    def close(self) -> None:
        """Close the file."""
        self._lines.close()


def judge(folder: Path, recorder: Recorder) -> Micros:
    """Tell a referee all that the ledgers of a folder hold, in order of time. Return until when there is something.

    A line cut short by the death of its writer is left out, and so is what a drone meant to fly after its body was last
    saved: if its process is dead it has hovered there since, if not, that is yet to come.
    """
    last = 0
    ledgers = [_in_order(_with_death(_read(path), folder)) for path in sorted(folder.glob("*.motion.jsonl"))]
    for note in heapq.merge(*ledgers, key=lambda note: note.at):
        last = max(last, note.segment.t1 if isinstance(note, MotionNote) else note.at)
        note.tell(recorder)
    return last


def _read(path: Path) -> Iterator[Note]:
    decoder: Any = msgspec.json.Decoder(Note)
    with path.open("rb") as lines:
        for line in lines:
            if line.endswith(b"\n"):
                yield decoder.decode(line)


def _with_death(notes: Iterator[Note], folder: Path) -> Iterator[Note]:
    """Add to a drone's notes that it hovers (or stands) from the instant on at which its body was last saved."""
    newest: Note | None = None
    for newest in notes:
        yield newest
    if newest is None or isinstance(newest, PersonNote):
        return
    saved = BodyFile(folder, newest.agent).load()
    if saved is not None and isinstance(saved.body, BodyState):
        body = saved.body.found_at(saved.engine_us, saved.engine_us, 0.0)
        if saved.body.segment.t1 > saved.engine_us or newest.at > saved.engine_us:
            yield MotionNote(newest.agent, body.segment, body.kind)


def _in_order(notes: Iterator[Note]) -> list[Note]:
    """Return the notes that hold: where engine time went back (another engine), what was said beyond is void."""
    kept: list[Note] = []
    for note in notes:
        while kept and kept[-1].at > note.at:
            kept.pop()
        kept.append(note)
    return kept
