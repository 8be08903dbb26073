"""A writer that is killed at any point leaves a journal that opens, with whole steps only, and all that it called durable."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from formiga_bt.journal.past import Past
from formiga_bt.journal.store import Journal
from tests.unit.journal.conftest import Recording, as_told, folded, steps_of
from tests.unit.journal.killed import BATCH, BATCHES

ROOT = Path(__file__).parents[3]


@pytest.mark.network
def test_a_killed_writer_leaves_a_journal_of_whole_commits(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.unit.journal.killed", str(tmp_path)]
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, env=env, cwd=ROOT, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    folders = sorted(tmp_path.iterdir(), key=lambda folder: int(folder.name))
    assert len(folders) > 15
    steps = steps_of("move_task")
    lengths = []
    for folder in folders:
        acked = int((folder / "acked").read_text()) if (folder / "acked").exists() else 0
        with Journal(folder / "journal.db", "demo", durability="normal") as journal:
            epoch = journal.take()
            kept = [kept.step for kept in journal.read()]
            lengths.append(len(kept))
            assert kept == list(steps[: len(kept)])
            assert len(kept) % BATCH == 0, "all steps of a commit or none"
            assert acked <= len(kept) // BATCH <= acked + 1
            assert journal.last()[0] == len(kept)
            if journal.starts():
                assert epoch == 2
                assert as_told(Past(journal).state()) == as_told(folded(kept))
            seq, at = journal.last()
            state = Past(journal).state() if journal.starts() else folded([])
            state.seq, state.now = seq, at + 1
            Recording(journal, state, thin=False).feed(steps[seq : seq + 1])
            assert journal.last()[0] == seq + 1, "the next engine goes on"
    assert {0, BATCH, BATCH * BATCHES} <= set(lengths)
