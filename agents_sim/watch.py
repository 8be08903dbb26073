"""The referee as a process: hears the motion of all agents of a site over Zenoh and judges it while it happens.

`python -m agents_sim.watch --site farm` joins the engine's router (and waits for it), publishes its verdict each second
under `world/referee/verdict`, and prints it when it ends (SIGTERM, SIGINT), with exit status 1 if it is not clean. With
`--state-dir` the last verdict is on the agents' ledgers: they also know of a drone killed in flight, which from afar
looks as if it flew on until it is found.
"""

import argparse
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import msgspec

from agents_sim.ledger import Note, judge
from agents_sim.referee import Referee, Verdict
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.errors import TransportError
from formiga_bt.transport.messages import ClockBeat
from formiga_bt.transport.zenoh_agent import ZenohObserver
from formiga_bt.transport.zenoh_keys import CLOCK, MOTION

LATE_WALL_S: Final = 1.0
"""News of a motion may be this late; what is younger is not judged yet."""
VERDICT_KEY: Final = "world/referee/verdict"


class Watch:
    """Feeds a `Referee` with what agents publish. Call `listen` now and then, from one thread."""

    def __init__(self, observer: ZenohObserver) -> None:
        self.referee = Referee()
        self.bad_messages = 0
        self._observer = observer
        self._beat: ClockBeat | None = None

    def listen(self) -> None:
        """Take in what came since the last call."""
        for key, raw in self._observer.poll():
            try:
                if key == CLOCK.of_all:
                    self._beat = msgspec.json.decode(raw, type=ClockBeat)
                else:
                    note: Note = _NOTES.decode(raw)
                    note.tell(self.referee)
            except msgspec.DecodeError:
                self.bad_messages += 1

    def verdict(self) -> Verdict:
        """Judge up to a little before the engine's newest beat."""
        return self.referee.verdict(self._judged_until())

    def _judged_until(self) -> Micros:
        if self._beat is None:
            return 0
        return self._beat.engine_us - round(LATE_WALL_S * SECOND * self._beat.speed)


_NOTES: Final[Any] = msgspec.json.Decoder(Note)


def watch(site: str, connect: str, is_stopping: Callable[[], bool], state_dir: Path | None = None) -> Verdict:
    """Watch a site until `is_stopping`, and return the verdict; `state_dir`: where the agents' ledgers are."""
    observer = ZenohObserver(site, connect=connect)
    watched = Watch(observer)
    is_open, next_verdict = False, 0.0
    try:
        while not is_stopping():
            if not is_open:
                is_open = _open(observer)
            watched.listen()
            if is_open and time.monotonic() >= next_verdict:
                next_verdict = time.monotonic() + 1.0
                observer.put(VERDICT_KEY, watched.verdict())
            time.sleep(0.05)
        if state_dir is not None:
            referee = Referee()
            return referee.verdict(judge(state_dir, referee))
        watched.listen()
        return watched.verdict()
    finally:
        observer.close()


def _open(observer: ZenohObserver) -> bool:
    try:
        observer.open(MOTION.of_all, CLOCK.of_all)
    except TransportError:
        return False  # no engine yet
    return True


def main(arguments: Sequence[str] | None = None) -> int:
    """Watch until told to end. Return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m agents_sim.watch", description="The referee of a simulated site.")
    parser.add_argument("--site", required=True, help="the site's name")
    parser.add_argument("--connect", default="tcp/127.0.0.1:7447", help="the engine's endpoint (%(default)s)")
    parser.add_argument("--state-dir", type=Path, help="where the agents' ledgers are, for the last verdict")
    parser.add_argument("--exit-with-parent", type=int, nargs="?", const=os.getppid(), metavar="PID")
    options = parser.parse_args(sys.argv[1:] if arguments is None else arguments)
    stops: list[int] = []
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda got, _: stops.append(got))
    parent = options.exit_with_parent
    verdict = watch(
        options.site,
        options.connect,
        lambda: bool(stops) or (parent is not None and os.getppid() != parent),
        options.state_dir,
    )
    with suppress(OSError):  # whoever started it judges the ledgers then
        print(msgspec.json.encode(verdict).decode(), flush=True)  # noqa: T201
    return 0 if verdict.is_clean else 1


if __name__ == "__main__":
    status = main()
    os._exit(status)  # a session that hangs while it closes must not keep the process alive
