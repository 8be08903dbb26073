"""A cell in a process of its own: its memory is its own, and what it leaves behind goes with it.

The process reads one measure's name a line and answers with its number; they take turns, so that only one of them computes.
"""

import json
import subprocess
import sys
from pathlib import Path
from typing import IO

from benchmarks.peers.all_peers import all_peers
from benchmarks.peers.cell import Cell

ROOT = Path(__file__).parents[2]
ANSWER = "= "
"""Begins an answer: what else a peer may print is passed over."""


class Child:
    """The near end. `measure` and `built` as of `Cell`."""

    def __init__(self, peer: str, tree: str, count: int) -> None:
        command = [sys.executable, "-m", "benchmarks.peers.child", peer, tree, str(count)]
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT, bufsize=1
        )
        self.what = f"{peer}, {count} of {tree}"
        try:
            self.built: dict[str, float] = json.loads(self._answer())
        except BaseException:
            self.close()
            raise

    def _answer(self) -> str:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith(ANSWER):
                return line.removeprefix(ANSWER)
        raise RuntimeError(f"{self.what}: its process ended with {self.process.wait()}")

    def measure(self, what: str) -> float:
        """Return one measure by name."""
        assert self.process.stdin is not None
        self.process.stdin.write(what + "\n")
        self.process.stdin.flush()
        return float(json.loads(self._answer()))

    def close(self) -> None:
        """End the process."""
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None:
                pipe.close()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


def serve(cell: Cell, asked: IO[str], answers: IO[str]) -> None:
    """Answer until nobody asks any more: the far end."""
    answers.write(ANSWER + json.dumps(cell.built) + "\n")
    answers.flush()
    for line in asked:
        answers.write(ANSWER + json.dumps(cell.measure(line.strip())) + "\n")
        answers.flush()


def main() -> None:
    """Build the cell that is named and answer."""
    peer, tree, count = sys.argv[1:]
    serve(Cell(all_peers()[peer], tree, int(count)), sys.stdin, sys.stdout)
    import os

    sys.stdout.flush()
    os._exit(0)  # taking 10,000 trees apart one by one is of no interest


if __name__ == "__main__":
    main()
