"""Judges a site from outside: what its agents noted of themselves, what the client noted of acknowledgements, how starts went.

What an engine says good of itself counts for nothing here; what it says bad of itself does.
"""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from math import hypot
from pathlib import Path
from typing import Final

import msgspec
from msgspec import Struct

from agents_sim.goalbook import GoalNote, read_books
from agents_sim.ledger import Note, RotorNote
from agents_sim.ledger import judge as tell_referee
from agents_sim.referee import Referee

from .client import Ack
from .crew import Reboot
from .engine import Start
from .site import MACHINES, PORTS

AT_PORT_M: Final = 3.0
FRESH_S: Final = 60.0
"""A clearance lives so long (engine time)."""
SKEW_S: Final = 5.0
"""An agent's engine time and the engine's may differ by this."""
STOP_S: Final = 2.0
RELEASES: Final = ("release", "clear", "abort", "task", "lockdown")


class Finding(Struct, frozen=True):
    """Something that must not happen, and did."""

    what: str
    """lost, begun_twice, no_clearance, no_cause, start, stop_late, ..."""
    text: str


class Evidence(Struct):
    """What there is to judge by."""

    folder: Path
    acks: Sequence[Ack]
    starts: Sequence[Start] = ()
    ended: Sequence[str] = ()
    away: Sequence[tuple[float, float]] = ()
    """When no engine could act."""
    silent: Sequence[tuple[str, float, float]] = ()
    """When an agent could not."""
    reboots: Sequence[Reboot] = ()
    lag_s: float = 0.0
    """How late this process itself was woken at most: the machine has other work."""
    speed: float = 10.0
    unkept: Sequence[tuple[float, float]] = ()
    """When the disk took nothing: what was acknowledged then may be forgotten, as the engine says."""


def judge(seen: Evidence) -> list[Finding]:
    """Return what was wrong."""
    notes = list(read_books(seen.folder / "sim"))
    return [
        *_begun_twice(notes), *_rotors(seen, notes), *_reboots(seen, notes), *_stops(seen, notes), *_aborted(seen, notes),
        *_starts(seen), *_referee(seen.folder),
    ]  # fmt: skip


def _begun_twice(notes: Sequence[GoalNote]) -> Iterator[Finding]:
    begun = Counter((note.agent, note.goal) for note in notes if note.state == "begun")
    for (agent, goal), times in begun.items():
        if times > 1:
            yield Finding("begun_twice", f"{agent} began the goal {goal} {times} times")


def rotor_starts(folder: Path) -> Iterator[RotorNote]:
    """Return all rotor starts of a site."""
    decoder: msgspec.json.Decoder[Note] = msgspec.json.Decoder(Note)  # type: ignore[arg-type]
    for path in sorted((folder / "sim").glob("*.motion.jsonl")):
        for line in path.read_bytes().splitlines(keepends=True):
            if line.endswith(b"\n") and isinstance(note := decoder.decode(line), RotorNote):
                yield note


def _rotors(seen: Evidence, notes: Sequence[GoalNote]) -> Iterator[Finding]:
    """No rotor start away from a port without a word of a person that is fresh, for this place, since the last boot."""
    for start in rotor_starts(seen.folder):
        port = min(
            PORTS, key=lambda name: hypot(PORTS[name][0] - start.place.east_m, PORTS[name][1] - start.place.north_m)
        )
        away_m = hypot(PORTS[port][0] - start.place.east_m, PORTS[port][1] - start.place.north_m)
        if away_m <= AT_PORT_M:
            continue
        where = f"{start.agent} started its rotors {away_m:.0f} m from {port}"
        if start.clearance is None:
            yield Finding("no_clearance", f"{where} without a clearance")
            continue
        age_s = (start.at - start.clearance.at) / 1e6
        if not -SKEW_S <= age_s <= FRESH_S + SKEW_S:
            yield Finding("no_clearance", f"{where} with a clearance {age_s:.0f} s old")
        word = [
            note
            for note in notes
            if note.action == "" and note.state == "succeeded" and note.agent == start.clearance.by
            and abs(note.at - start.clearance.at) / 1e6 <= FRESH_S
        ]  # fmt: skip
        if not word:
            yield Finding("no_clearance", f"{where}, and {start.clearance.by} never said a word for it")
        wall = _wall_of(notes, start)
        boots = [one for one in seen.reboots if one.agent == start.agent and wall is not None and one.wall < wall]
        if boots and word and max(note.wall for note in word) / 1e6 < boots[-1].wall - 5.0:
            yield Finding("no_clearance", f"{where} on a clearance that was given before its reboot")


def _wall_of(notes: Sequence[GoalNote], start: RotorNote) -> float | None:
    """Return when rotors started by the wall clock: that of the goal that began nearest to it."""
    mine = [note for note in notes if note.agent == start.agent and note.state == "begun"]
    near = min(mine, key=lambda note: abs(note.at - start.at), default=None)
    return near.wall / 1e6 if near is not None and abs(near.at - start.at) < 5e6 else None


def _reboots(seen: Evidence, notes: Sequence[GoalNote]) -> Iterator[Finding]:
    """A machine that was started anew on the ground starts its rotors only by a person's word or a task granted since."""
    for boot in seen.reboots:
        if boot.kind != "rest":
            continue
        after = min(
            (one.wall for one in seen.reboots if one.agent == boot.agent and one.wall > boot.wall), default=1e18
        )
        mine = [note for note in notes if note.agent == boot.agent and note.state == "begun"]
        first = next((n for n in mine if n.action == "TakeOff" and boot.wall < n.wall / 1e6 < after), None)
        if first is None:
            continue
        task, section = first.goal.split("/")[0], first.goal.split("/")[2:3]
        had_begun = any(note.goal.split("/")[0] == task and note.wall / 1e6 < boot.wall for note in mine)
        is_own = task == "safety" or section[:1] != ["steps"] or task not in _asked(seen)
        word = [
            ack for ack in seen.acks if boot.wall - 1.0 <= ack.wall <= first.wall / 1e6 and _lets(ack, boot.agent, task)
        ]
        if not word and (had_begun or is_own):
            yield Finding(
                "no_cause",
                f"{boot.agent} was started anew on the ground{' of another place' if boot.moved else ''}, and "
                f"{first.wall / 1e6 - boot.wall:.1f} s later began {first.goal} without anybody's word",
            )


def _asked(seen: Evidence) -> set[str]:
    return {ack.target for ack in seen.acks if ack.kind == "task"}


def _lets(ack: Ack, agent: str, task: str) -> bool:
    """Return whether an acknowledged word lets a machine start: it names it, its task, or all."""
    if ack.kind == "stop":
        return ack.word == "return" and (agent in ack.agents)
    if ack.kind not in RELEASES:
        return False
    if ack.kind == "lockdown":
        return ack.word == "return"
    return ack.target in ("", f"agents/{agent}", f"tasks/{task}", task) or agent in ack.agents


def _stops(seen: Evidence, notes: Sequence[GoalNote]) -> Iterator[Finding]:
    """What a machine did when a stop for it was acknowledged has ended, or something else has begun, 2 s later."""
    by_agent: dict[str, list[GoalNote]] = defaultdict(list)
    for note in notes:
        by_agent[note.agent].append(note)
    for ack in seen.acks:
        if ack.kind != "stop":
            continue
        for agent in ack.agents:
            if agent in MACHINES:
                yield from _stop(seen, ack, agent, by_agent[agent])


def _stop(seen: Evidence, ack: Ack, agent: str, notes: Sequence[GoalNote]) -> Iterator[Finding]:
    until = deadline(seen, ack.wall, agent)
    if until is None:
        return
    open_: dict[str, GoalNote] = {}
    for note in notes:
        if note.wall / 1e6 > ack.wall - 0.05:
            break
        if note.state == "begun":
            open_[note.goal] = note
        else:
            open_.pop(note.goal, None)
    boots = [boot.wall for boot in seen.reboots if boot.agent == agent and boot.wall < ack.wall]
    open_ = {name: note for name, note in open_.items() if not boots or note.wall / 1e6 > boots[-1]}
    if not open_:  # what a process had that died has ended with it
        return
    goal = list(open_.values())[-1]
    news = [
        note
        for note in notes
        if ack.wall - 0.05 < note.wall / 1e6 <= until and (note.goal != goal.goal or note.state != "begun")
    ]
    if news or goal.goal.startswith("safety/") or goal.action == "LandIn" or goal.goal.split("/")[2:3] != ["steps"]:
        return  # what ends on the ground anyway may be finished
    after = next((note for note in notes if note.wall / 1e6 > until), None)
    how = "never" if after is None else f"after {after.wall / 1e6 - ack.wall:.1f} s"
    yield Finding(
        "stop_late", f"{ack.word} of {agent} was acknowledged, and {goal.goal} went on; something changed {how}"
    )


def deadline(seen: Evidence, wall: float, agent: str) -> float | None:
    """Return until when a stop must be carried out; None: nobody can say, as its agent could not hear it."""
    if any(who == agent and began - 5.0 < wall + STOP_S and end + 2.0 > wall for who, began, end in seen.silent):
        return None
    until = wall + STOP_S + seen.lag_s
    for began, end in sorted(seen.away):
        if began < until and end > wall:
            return None if end - began > 8.0 else end + STOP_S + 10.0  # it asks first what happened meanwhile
    return until


def _aborted(seen: Evidence, notes: Sequence[GoalNote]) -> Iterator[Finding]:
    """Nothing of the steps of a task is begun long after its abort was acknowledged, but what a `finally` puts in order."""
    for ack in seen.acks:
        if ack.kind != "abort" or _during(ack.wall, seen.unkept):
            continue
        late = ack.wall + 3.0 + seen.lag_s
        for note in notes:
            parts = note.goal.split("/")
            goes_on = parts[0] == ack.target and parts[2:3] == ["steps"] and ".finally[" not in note.goal
            if note.state == "begun" and goes_on and note.wall / 1e6 > late:
                yield Finding(
                    "abort_undone",
                    f"{ack.target} was aborted, and {note.wall / 1e6 - ack.wall:.1f} s later began {note.goal}",
                )
                break


def _during(wall: float, spans: Sequence[tuple[float, float]]) -> bool:
    return any(began - 1.0 <= wall <= end + 3.0 for began, end in spans)


def _starts(seen: Evidence) -> Iterator[Finding]:
    """Each start succeeds, or says in one line what a person must do; what was not harmed starts."""
    for start in seen.starts:
        if start.ok:
            continue
        has_word = ("help:" in start.said or "next:" in start.said) and "Traceback" not in start.said
        if not has_word:
            yield Finding("start", f"start {start.number} failed, and nothing says what to do:\n{start.said[-1500:]}")
        elif not start.harmed:
            yield Finding("start", f"start {start.number} failed though nothing was harmed:\n{start.said[-1500:]}")
    for text in seen.ended:
        yield Finding("ended", f"an engine {text}")


def _referee(folder: Path) -> Iterator[Finding]:
    referee = Referee()
    verdict = referee.verdict(tell_referee(folder / "sim", referee))
    for crash in verdict.crashes:
        yield Finding("crash", f"{crash.a} and {crash.b} came within {crash.distance_m:g} m")
    for start in verdict.unsafe_starts:
        yield Finding("unsafe_start", f"{start.agent} started its rotors {start.distance_m:g} m from {start.person}")


def lost(acks: Sequence[Ack], known: set[str], unkept: Sequence[tuple[float, float]] = ()) -> list[Finding]:
    """Return the acknowledged tasks that the engine does not know any more."""
    return [
        Finding("lost", f"{ack.target} was acknowledged, and the engine knows nothing of it")
        for ack in acks
        if ack.kind == "task" and ack.target not in known and not _during(ack.wall, unkept)
    ]


def summary(found: Sequence[Finding]) -> Mapping[str, int]:
    """Return how many findings there are of each kind."""
    return dict(Counter(one.what for one in found))
