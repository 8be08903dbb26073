"""A driver whose engine goes on while its steps are committed: a `RealtimeDriver` with a `PersistAhead`, in virtual time.

Steps are taken at once; their effects leave, and who asked is answered, when the batch that they are in is on disk. An engine
that dies takes with it all that was not: the batch under way is on disk or not, what came after it never was.
"""

from collections.abc import Callable
from functools import partial
from random import Random
from typing import TYPE_CHECKING, Final

from formiga_bt.base.clock import Micros
from formiga_bt.engine.drivers.virtual import VirtualDriver
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import inputs as inp

if TYPE_CHECKING:
    from tests.simulation.world import World

BATCH_US: Final[Micros] = 2_000
"""A batch is handed over when its oldest step is so old."""
COMMITS_US: Final = (1_000, 5_000, 20_000, 100_000, 400_000)
SLOW_US: Final[Micros] = 800_000


class AheadDriver(VirtualDriver):
    """Made of a `VirtualDriver` by `begin`."""

    world: "World"
    dice: Random
    batch: list[inp.EngineStep]
    under_way: list[inp.EngineStep] | None
    staged: bool
    dead: bool
    due: bool
    late: list[str]
    """What comes up while the process stands still."""
    stood_at: Micros

    @classmethod
    def begin(cls, driver: VirtualDriver, world: "World", dice: Random) -> None:
        """Let a driver go on like this."""
        driver.__class__ = cls
        assert isinstance(driver, cls)
        driver.world, driver.dice = world, dice
        driver.batch, driver.under_way = [], None
        driver.staged = driver.dead = driver.due = False
        driver.late, driver.stood_at = [], -1

    def _handle(self, now: Micros, given: inp.Input) -> inp.EngineStep:
        step = self.engine.handle(now, given)
        self.world.keeper.take(step)
        for change in step.changes:
            if isinstance(change, ch.WallTimerSet):
                self._set_wall(change.timer, change.after_us)
        for listener in self.listeners:
            listener(step)
        self.batch.append(step)
        self._hand_over_soon()
        return step

    def _later(self, after_us: Micros, call: str) -> None:
        def go() -> None:
            if self._waits is not None:
                self.late.append(call)
            elif not self.dead:
                getattr(self, call)()

        self.scheduler.call_at(self.scheduler.now() + after_us, go)

    def _hand_over_soon(self) -> None:
        if self.batch and self.under_way is None and not self.due:
            self.due = True
            self._later(BATCH_US, "hand_over")

    def hand_over(self) -> None:
        """Begin to commit what has been taken so far."""
        self.due = False
        if self.under_way is not None or not self.batch:
            return
        disk = self.world.disk
        assert disk.writer is not None
        self.under_way, self.batch = self.batch, []
        self.staged = disk.writer.start(self.under_way)
        self._later(SLOW_US if disk.slow else self.dice.choice(COMMITS_US), "end")

    def end(self) -> None:
        """What was under way is on disk: release it."""
        steps, writer = self.under_way, self.world.disk.writer
        if steps is None or writer is None:
            return
        self.under_way = None
        if self.staged:
            writer.commit()
        kept = writer.finish()
        self.world.keeper.kept(steps, kept)
        if kept.news is not None:
            self.scheduler.call_at(self.scheduler.now() + 1, partial(self._news, kept.news))
        for step in steps:
            self.world.release(step)
            for effect in step.effects:
                failure = self._too_late(step, effect) or self.switchboard.carry_out(effect, self._beat)
                if failure is not None:
                    self.scheduler.call_at(self.scheduler.now() + 1, partial(self._news, failure))
        self._hand_over_soon()

    def _news(self, given: inp.Input) -> None:
        if not self.dead:
            self._feed(given)

    def stand_still(self, us: Micros, wall: Callable[[], Micros] | None = None) -> inp.EngineStep:
        """Stand still, commits too; what did not leave before does so only if it is no goal of a step."""
        self.stood_at = self.scheduler.now()
        step = super().stand_still(us, wall)
        late, self.late = self.late, []
        for call in late:
            if not self.dead:
                getattr(self, call)()
        return step

    def _too_late(self, step: inp.EngineStep, effect: inp.Effect) -> inp.EffectFailed | None:
        if step.at > self.stood_at or not isinstance(effect, inp.SendGoal) or effect.safety:
            return None
        if self.engine.state.agents[effect.agent].human:
            return None
        return inp.EffectFailed(effect.agent, "goal", effect.goal_id, "unreachable", "the engine stood still")

    def flush(self) -> None:
        """Commit and release all that was taken."""
        while self.under_way is not None or self.batch:
            if self.under_way is None:
                self.hand_over()
            self.end()

    def die(self, *, kept: bool) -> None:
        """The process is gone: what was being committed is on disk, or not."""
        self.dead = True
        writer = self.world.disk.writer
        if kept and self.under_way is not None and self.staged and writer is not None:
            writer.commit()
