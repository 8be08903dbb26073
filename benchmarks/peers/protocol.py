"""What a peer must do to be compared."""

from collections.abc import Sequence
from typing import Protocol

from benchmarks.peers.trees import Node


class Mail:
    """What the outside has to say to one tree's actions, and which of them run."""

    __slots__ = ("results", "running")

    def __init__(self) -> None:
        self.results: dict[str, bool] = {}
        """By action: how it ended, once that is known. An attempt takes its result away."""
        self.running: set[str] = set()


class Fleet(Protocol):
    """Many instances of one tree, started: each runs until the results of its actions end it."""

    def idle_round(self) -> None:
        """Do what this engine must do now and then although nobody has news."""

    def news(self, trees: Sequence[int]) -> None:
        """Tell an action of each of these trees something that does not end it; let that tree look at it, one after another."""

    def results(self, trees: Sequence[int], action: str, ok: bool = True) -> None:
        """End a running action of each of these trees and let that tree go on, one after another."""

    def burst(self, trees: Sequence[int]) -> None:
        """Tell all of these trees news at once, nobody knowing which: what ticks must tick all."""

    def status(self, tree: int) -> str:
        """Return running, success or failure."""

    def running(self, tree: int) -> frozenset[str]:
        """Return the actions that run."""

    def close(self) -> None:
        """Let go of everything."""


class Peer(Protocol):
    """One engine."""

    name: str
    given: str
    """How it is used here, and what was given to it or left out."""
    lacks: tuple[str, ...]
    """Names of trees that it cannot build."""
    most: int
    """Never build more instances than so many."""

    def version(self) -> str:
        """Return the version that is installed; ImportError if none is."""

    def build(self, tree: Node, name: str, count: int) -> Fleet:
        """Return so many instances, started."""
