"""Alarms that stand of the engine's own process: its clock, its folder, people's secrets. The engine itself knows none of it.

Each second `StandingAlarms` asks its checks what is wrong now, and hands the engine what has changed: there what is new is an
alarm as any other, and what is no more is cleared.
What stands is in `GET /v1/health`, on the top line of `formiga watch` and in its list of what needs a person, also when the
engine has stopped.
"""

import logging
import threading
from collections.abc import Callable, Iterable
from typing import Final

from msgspec import Struct

from formiga_bt.base.clock import OFF, SECOND, EngineClock, Micros, wall_clock_us
from formiga_bt.base.clock_sync import ClockSync, clock_sync
from formiga_bt.engine.kernel.inputs import Trouble
from formiga_bt.show.offset import offset_words

EACH_S: Final = 1.0
log = logging.getLogger("formiga.house")


class Standing(Struct, frozen=True):
    """A trouble, and since when it stands."""

    trouble: Trouble
    since: Micros
    """Wall clock."""


Check = Callable[[], Iterable[Trouble]]
Tell = Callable[[tuple[Trouble, ...]], None]
"""Called with all that is wrong, at the first look and when a trouble begins or is over."""


class StandingAlarms:
    """Watches over the house of an engine in a thread of its own; `standing` may be read from any.

    Args:
        tell: tells the engine what is wrong now.
        checks: each returns what is wrong now; more may be added before `start`.
    """

    def __init__(self, tell: Tell, checks: Iterable[Check] = ()) -> None:
        self.checks = list(checks)
        self.standing: tuple[Standing, ...] = ()
        """What stands, the oldest first; replaced whole."""
        self._tell = tell
        self._told: set[tuple[str, str]] | None = None
        """What was told; None: nothing yet, not even that all is well."""
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name="formiga-house", daemon=True)

    def start(self) -> None:
        """Look once, then each second."""
        self.look()
        self._thread.start()

    def stop(self) -> None:
        """End; may be called twice."""
        self._end.set()
        if self._thread.is_alive():
            self._thread.join(5.0)

    def look(self) -> None:
        """Ask each check, and tell what is wrong if that is not what was told last."""
        found = {(one.code, one.subject): one for check in self.checks for one in check()}
        before = {(one.trouble.code, one.trouble.subject): one for one in self.standing}
        now = wall_clock_us()
        stays = [Standing(found[key], one.since) for key, one in before.items() if key in found]
        begins = [Standing(one, now) for key, one in found.items() if key not in before]
        self.standing = (*stays, *begins)
        if self._told != set(found):
            self._told = set(found)
            self._tell(tuple(one.trouble for one in self.standing))

    def _run(self) -> None:
        while not self._end.wait(EACH_S):
            try:
                self.look()
            except Exception:  # a bug in one look must not end all later ones
                log.exception("the engine's house could not be looked through")


def machine_clock_check(clock: EngineClock, ask: Callable[[], ClockSync | None] = clock_sync) -> Check:
    """Return the check whether the wall clock, which engine time follows, is itself right, as far as the kernel knows.

    A clock that nothing ever set right is no trouble that begins while the engine runs: `formiga doctor` tells it.
    """
    was_right = False

    def look() -> Iterable[Trouble]:
        nonlocal was_right
        told = ask() if clock.follows_wall else None
        if told is None:
            return ()
        right = told.synchronised and told.most_off_s * SECOND <= OFF
        was_right = was_right or right
        if right or not (told.synchronised or was_right):
            return ()
        why = f"may be off by {told.most_off_s:.1f} s" if told.synchronised else "is set right by nothing any more"
        text = f"this machine's clock {why}; look at what sets it (NTP): timedatectl, or chronyc tracking"
        return (Trouble("clock_off", "machine", text),)

    return look


def clock_check(clock: EngineClock) -> Check:
    """Return the check whether engine time that follows the wall clock is far from it."""

    def look() -> Iterable[Trouble]:
        ahead = clock.ahead_us
        if not clock.follows_wall or abs(ahead) <= OFF:
            return ()
        help_ = (
            "set the machine's clock right; until it has caught up, a start is refused (clock_ahead)"
            if ahead > 0
            else "a restart of the engine sets it right at once"
        )
        text = f"engine time is {offset_words(ahead)}, and approaches it by 1 % of the time that passes; {help_}"
        return (Trouble("clock_off", "clock", text),)

    return look
