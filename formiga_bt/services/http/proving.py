"""Whether the person whom a request names has said it: their own secret, asked for in mode real.

It proves that who calls knows the secret, nothing more. Hashing one takes 0.1 s and 32 MB: it is done in the thread of the
request, two at once, some wait, more are refused. Wrong tries are counted for each person: after `MOST_WRONG` in a minute
nothing is compared until the first of them is a minute ago.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from formiga_bt.base.clock import SECOND, Micros, passed_us
from formiga_bt.base.errors import SiteError, TaskError
from formiga_bt.base.person_secrets import SECRETS, Hashed, command, find_secret, read_secrets, wrong
from formiga_bt.engine.kernel.inputs import Trouble
from formiga_bt.lang.model import Site
from formiga_bt.services.refused import Refused

log = logging.getLogger("formiga.proving")

AT_ONCE: Final = 2
MOST_WAITING: Final = 6
"""Requests that wait for one of these places, each in a thread of the door's."""
MOST_WRONG: Final = 5
WINDOW_US: Final = 60 * SECOND


def people_of(site: Site) -> dict[str, list[str]]:
    """Return who may have a secret: the people and pilots whom the site file names, with what they are."""
    found: dict[str, list[str]] = {}
    for role, people in site.people.items():
        for person in people:
            found.setdefault(person, []).append(role)
    for pilot in site.pilots:
        found.setdefault(pilot, []).append("pilots")
    return found


class Proofs:
    """Compares secrets with the site's file, which is read anew each time.

    Args:
        folder: the site's runtime folder.
        site: whose people may have one; asks for none in mode simulation.
        clock: microseconds of a clock that never goes back.
        fits: compares; tests put their own.
    """

    def __init__(
        self,
        folder: Path,
        site: Site,
        clock: Callable[[], Micros] = passed_us,
        fits: Callable[[Hashed, str], bool] = Hashed.fits,
    ) -> None:
        self.needed = site.mode == "real"
        self._folder, self._clock, self._fits = folder, clock, fits
        self._speakers = [*dict.fromkeys((*site.people.get("approvers", ()), *site.pilots))]
        self._lock = threading.Lock()
        self._places = threading.Semaphore(AT_ONCE)
        self._inside = 0
        self._wrong: dict[str, deque[Micros]] = {one: deque() for one in people_of(site)}

    def check(self, person: str, secret: str) -> None:
        """Let a person's word pass, or not.

        Raises:
            Refused: `secret_missing`, `secret_wrong`, `secret_wait` (too many wrong ones), `secrets_unusable`, `busy`.
        """
        if not self.needed:
            return
        try:
            if person not in self._wrong:
                raise TaskError("secret_missing", f"{person or 'nobody'} is not named in the site file")
            known = find_secret(self._folder, person, secret)
            with self._place(), self._try(person):
                if not self._fits(known, secret):
                    raise wrong(person)
        except TaskError as error:
            if isinstance(error, Refused):
                raise
            log.warning("%s: %s", error.code, error)
            raise Refused(error.code, error.text, _hint(error.code, person)) from None
        except SiteError as error:
            raise Refused("secrets_unusable", error.text, error.help) from None

    @contextmanager
    def _place(self) -> Iterator[None]:
        """Take one of the places to compare in; others wait, within bounds."""
        with self._lock:
            if self._inside >= AT_ONCE + MOST_WAITING:
                raise Refused("busy", "too many secrets are compared already", "try again in some seconds")
            self._inside += 1
        try:
            with self._places:
                yield
        finally:
            with self._lock:
                self._inside -= 1

    @contextmanager
    def _try(self, person: str) -> Iterator[None]:
        """Count a try as wrong, before it is compared, so that many at once are not more; a right one counts no more."""
        now = self._clock()
        with self._lock:
            tries = self._recent(person, now)
            if len(tries) >= MOST_WRONG:
                wait_s = (tries[0] + WINDOW_US - now) // SECOND + 1
                raise Refused(
                    "secret_wait",
                    f"{MOST_WRONG} wrong secrets of {person} within a minute",
                    f"wait {wait_s} s; was that not {person}? Then {command(person)} sets another one",
                )
            tries.append(now)
        yield
        with self._lock, suppress(ValueError):  # it took so long that it is forgotten
            tries.remove(now)

    def _recent(self, person: str, now: Micros) -> deque[Micros]:
        tries = self._wrong[person]
        while tries and tries[0] <= now - WINDOW_US:
            tries.popleft()
        return tries

    def without(self) -> list[str]:
        """Return the approvers and pilots of a real site who have no secret yet; none, if that cannot be known."""
        if not self.needed:
            return []
        try:
            known = read_secrets(self._folder)
        except SiteError:
            return []
        return [one for one in self._speakers if one not in known]

    def troubles(self) -> Iterable[Trouble]:
        """Return what is wrong now, for `StandingAlarms`."""
        if not self.needed:
            return
        try:
            read_secrets(self._folder)
        except SiteError as error:
            yield Trouble("secrets_unusable", SECRETS, str(error).replace("\n  help: ", "; "))
        now = self._clock()
        with self._lock:
            guessed = [one for one in self._wrong if len(self._recent(one, now)) >= MOST_WRONG]
        for person in guessed:
            text = f"{MOST_WRONG} wrong secrets of {person} within a minute: does somebody guess?"
            yield Trouble("secret_guessed", person, text)


def _hint(code: str, person: str) -> str:
    if code == "secret_wrong":
        return f"forgotten? Who owns the site's files sets another one: {command(person)} --reset"
    return (
        f"set one: {command(person)}; then say it at a terminal, which asks for it, or send it as header Formiga-Secret"
    )
