"""What all engines that tick have in common: somebody outside calls each tree again and again."""

from collections.abc import Callable, Sequence

from benchmarks.peers.protocol import Mail


class TickingFleet:
    """Trees that are ticked, each with its mail.

    Args:
        ticks: per tree: tick it once and return running, success or failure.
        mails: per tree.
    """

    def __init__(self, ticks: Sequence[Callable[[], str]], mails: Sequence[Mail]) -> None:
        self.ticks = list(ticks)
        self.mails = list(mails)
        self.states = ["running"] * len(self.ticks)
        for tree in range(len(self.ticks)):
            self.tick(tree)

    def tick(self, tree: int) -> None:
        """Tick a tree unless it has ended."""
        if self.states[tree] == "running":
            self.states[tree] = self.ticks[tree]()

    def idle_round(self) -> None:
        for tree in range(len(self.ticks)):
            self.tick(tree)

    def news(self, trees: Sequence[int]) -> None:
        for tree in trees:
            self.tick(tree)

    def burst(self, trees: Sequence[int]) -> None:
        del trees  # news that ends nothing: a tick finds it, whether there is some or not
        self.idle_round()

    def results(self, trees: Sequence[int], action: str, ok: bool = True) -> None:
        for tree in trees:
            self.mails[tree].results[action] = ok
            self.tick(tree)

    def status(self, tree: int) -> str:
        return self.states[tree]

    def running(self, tree: int) -> frozenset[str]:
        return frozenset(self.mails[tree].running)

    def close(self) -> None:
        self.ticks.clear()
