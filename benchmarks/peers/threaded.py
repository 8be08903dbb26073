"""The form of the FORMIGA paper: each task is a thread that looks at its action's result, sleeps a little, and looks again."""

import contextlib
import threading
import time
from collections.abc import Callable, Sequence

from benchmarks.peers.protocol import Mail
from benchmarks.peers.trees import Node

MOST = 30
POLL_S = 0.1
PATIENCE_S = 10.0


class Stopped(Exception):  # noqa: N818 - no error: the benchmark is over
    """The task shall end."""


class ThreadFleet:
    """So many threads, each of which runs one tree's steps as plain code."""

    def __init__(self, tree: Node, count: int, poll_s: float) -> None:
        assert count <= MOST, f"{count} threads are too many"
        self.poll_s = poll_s
        self.mails = [Mail() for _ in range(count)]
        self.states = ["running"] * count
        self.over = False
        self.threads = [threading.Thread(target=self._task, args=(tree, i), daemon=True) for i in range(count)]
        for thread in self.threads:
            thread.start()
        self._until(lambda: all(mail.running for mail in self.mails))

    def _task(self, tree: Node, number: int) -> None:
        with contextlib.suppress(Stopped):
            self.states[number] = "success" if self._run(tree, self.mails[number]) else "failure"

    def _run(self, node: Node, mail: Mail) -> bool:
        if node.kind == "check":
            return True
        if node.kind == "act":
            return self._act(node.name, mail)
        if node.kind == "sequence":
            return all(self._run(child, mail) for child in node.children)
        if node.kind == "fallback":
            return any(self._run(child, mail) for child in node.children)
        if node.kind == "retry":
            return any(self._run(node.children[0], mail) for _ in range(node.n))
        assert node.kind == "timeout", node.kind
        return self._run(node.children[0], mail)  # no clock: it favours this form

    def _act(self, name: str, mail: Mail) -> bool:
        mail.running.add(name)
        while name not in mail.results:
            if self.over:
                raise Stopped
            time.sleep(self.poll_s)
        mail.running.discard(name)
        return mail.results.pop(name)

    def _until(self, done: Callable[[], bool]) -> None:
        end = time.monotonic() + PATIENCE_S
        while not done():
            assert time.monotonic() < end, "a thread does not come on"
            time.sleep(self.poll_s / 5)

    def idle_round(self) -> None:
        """Let as much time pass as there is between two looks of a thread."""
        time.sleep(self.poll_s)

    def news(self, trees: Sequence[int]) -> None:
        """Nothing: news that ends nothing is what all threads look for all the time."""

    burst = news

    def results(self, trees: Sequence[int], action: str, ok: bool = True) -> None:
        """Give all their results at once and let the threads find them."""
        for tree in trees:
            self.mails[tree].results[action] = ok
        self._until(lambda: not any(action in self.mails[tree].results for tree in trees))
        self._until(lambda: all(self.mails[tree].running or self.states[tree] != "running" for tree in trees))

    def status(self, tree: int) -> str:
        return self.states[tree]

    def running(self, tree: int) -> frozenset[str]:
        return frozenset(self.mails[tree].running)

    def close(self) -> None:
        self.over = True
        for thread in self.threads:
            thread.join(PATIENCE_S)


class Threaded:
    """A thread a task, as the paper has it."""

    name = "thread a task"
    given = "a polling function written by hand, without any tree, clock or cancel"
    lacks = ("wide",)
    most = MOST

    def __init__(self, poll_s: float = POLL_S) -> None:
        self.poll_s = poll_s

    def version(self) -> str:
        return f"a look each {self.poll_s:g} s"

    def build(self, tree: Node, name: str, count: int) -> ThreadFleet:
        del name
        return ThreadFleet(tree, count, self.poll_s)
