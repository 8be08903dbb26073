"""Many deaths in a short time, with live readers: what was acknowledged before each `kill -9` must be known after it."""

import time
from pathlib import Path
from random import Random

from .judge import Finding
from .play import Round, Torture
from .readers import Readers

ONE = ("lwd_1", "picker_1", "watcher_1")


def kills(folder: Path, seed: int, number: int, deaths: int, *, readers: bool = True) -> Round:
    """Kill the engine of one site so often.

    Args:
        folder: becomes the site's; is left there.
        seed: of the moments, and of what is read.
        number: of the site.
        deaths: how many.
        readers: whether somebody reads the journal all the time.
    """
    random = Random(f"kills/{seed}/{number}")
    began = time.monotonic()
    with Torture(folder, seed=random.randrange(1 << 30), speed=10.0, only=ONE, hold_after="10 min") as torture:
        reading = Readers(torture.client, folder, seed=random.randrange(1 << 30), pause_s=0.1, quick=True)
        if readers:
            reading.__enter__()
        try:
            for _ in range(deaths):
                if not torture.engine.start().ok:
                    break
                torture.check_known()
                _live(torture, random)
                torture.engine.kill()
            torture.engine.start()
            torture.check_known()
        finally:
            if readers:
                reading.close()
        torture.engine.kill()
        found = [*torture.judged(), *(Finding("bug", text) for text in reading.bugs)]
    return Round(
        seed, number, round(time.monotonic() - began, 1), len(torture.client.tasks()), len(torture.client.acks),
        len(torture.engine.deaths), {"kill": deaths}, dict(reading.done), found, round(torture.lag.most_s, 2), {}, str(folder),
    )  # fmt: skip


def _live(torture: Torture, random: Random) -> None:
    """Let an engine live for a moment: tasks are requested up to the last instant, old ones aborted."""
    until = time.monotonic() + random.uniform(0.1, 2.5)
    while True:
        torture.client.request("Look" if random.random() < 0.7 else "Stay", {})
        if time.monotonic() >= until:
            return
        torture.client.tend()
        for task in torture.client.open[4:]:
            torture.client.abort(task["id"])
        time.sleep(random.uniform(0.0, 0.3))
