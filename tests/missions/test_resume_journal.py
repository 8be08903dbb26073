"""The killed engine's state comes from a real journal: thinned telemetry, snapshots, the codec; nothing of it is in memory."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from formiga_bt.engine.drivers.persist import Outcome
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.journal.past import Past
from formiga_bt.journal.store import Journal
from formiga_bt.journal.writer import Writer
from tests.missions.crashing import Crashing, Killed
from tests.missions.test_resume import Plain, begin


class Journaled:
    """A `Persist` over a journal, that ends the engine after so many steps."""

    def __init__(self, flown: Crashing, path: Path, left: int) -> None:
        state = flown.flight.engine.state
        self.journal = Journal(path, "demo")
        self.journal.take(state.epoch)
        self.left = left
        self.writer = Writer(
            self.journal, lambda: flown.flight.engine.state, wall=lambda: flown.flight.now,
            clock=lambda: flown.flight.now / 1e6, snapshot_steps=100,
        )  # fmt: skip
        self.writer.begin()

    def keep(self, steps: Sequence[EngineStep]) -> Outcome:
        """Keep steps, and die after the last one."""
        kept = self.writer.keep(steps)
        self.left -= 1
        if not self.left:
            raise Killed
        return kept


@pytest.mark.parametrize("name", ["pick_up", "delivery"])
def test_missions_go_on_from_the_journal(name: str, tmp_path: Path) -> None:
    plain = Plain(name)
    for n, step in enumerate(range(20, plain.steps, plain.steps // 4)):
        flown, id_ = begin(name)
        for left in (step, 7, 0):  # killed, killed again while it asks, and then never more
            journaled = Journaled(flown, tmp_path / f"{n}.db", left)
            flown.flight.driver._persist = journaled
            if not left:
                break
            assert not flown.run()
            journaled.journal.close()
            with Journal(tmp_path / f"{n}.db", "demo", read_only=True) as journal:
                state = Past(journal).state()
                state.seq = max(state.seq, journal.last()[0], flown.flight.engine.state.seq)
            flown.resume(away_s=1.0, state=state, again=())
        assert flown.run()
        task = flown.flight.task(id_)
        assert (task.status, task.outcome.code, task.hold.words) == (plain.status, plain.code, ()), flown.story()
        assert flown.twice() == []
        assert set(flown.again_begun()) <= set(plain.rounds)
        journaled.journal.close()
        flown.flight.close()
