"""A program that writes journals and is killed at their statements in turn: `python -m tests.unit.journal.killed FOLDER`.

In each folder `<n>` lies the journal of a writer that was killed before its n-th statement (or at a commit), and how many
batches it had been told were durable.
"""

import os
import signal
import sys
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from formiga_bt.journal.store import Journal
from tests.unit.journal.conftest import Recording, steps_of

BATCH = 3
BATCHES = 8


def write(folder: Path, at: int) -> None:
    """Write a journal; die before statement `at`."""
    done = 0

    def count(*_: Any) -> None:
        nonlocal done
        done += 1
        if done == at:
            os.kill(os.getpid(), signal.SIGKILL)

    steps = steps_of("move_task")
    journal = Journal(folder / "journal.db", "demo", durability="normal")
    for event in ("before_cursor_execute", "after_cursor_execute", "commit", "begin"):
        sa.event.listen(journal.database.engine, event, count)
    journal.take()
    recording = Recording(journal, thin=False, snapshot_steps=2 * BATCH)
    for batch in range(BATCHES):
        recording.feed(steps[batch * BATCH : (batch + 1) * BATCH], BATCH)
        (folder / "acked").write_text(str(batch + 1))
    recording.writer.end()
    (folder / "whole").touch()


def main() -> None:
    """Kill at every seventh statement, until one writer comes to its end."""
    steps_of("move_task")
    at = 1
    while True:
        folder = Path(sys.argv[1]) / str(at)
        folder.mkdir()
        child = os.fork()
        if not child:
            write(folder, at)
            os._exit(0)
        _, status = os.waitpid(child, 0)
        if (folder / "whole").exists():
            return
        assert os.WIFSIGNALED(status), status
        at += 7


if __name__ == "__main__":
    main()
