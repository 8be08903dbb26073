"""async-btree (extra `peers`): a tree is a coroutine, an action awaits its future. Without news nothing runs."""

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from importlib.metadata import version
from typing import Any

from benchmarks.peers.trees import Node

Step = Callable[[], Awaitable[Any]]
NEWS = "news"


class Act:
    """An action of one tree: awaits until what comes is a result."""

    def __init__(self) -> None:
        self.future: asyncio.Future[Any] | None = None

    async def __call__(self) -> bool:
        try:
            while True:
                self.future = asyncio.get_running_loop().create_future()
                if (got := await self.future) is not NEWS:
                    return bool(got)
        finally:
            self.future = None


class AsyncFleet:
    """Coroutines on one event loop, which runs only while something is asked of it."""

    def __init__(self, trees: Sequence[tuple[Step, dict[str, Act]]]) -> None:
        self.loop = asyncio.new_event_loop()
        self.acts = [acts for _, acts in trees]
        self.tasks = [self.loop.create_task(_run(tree)) for tree, _ in trees]
        self.loop.run_until_complete(_turns(6))  # a parallel's children are tasks of their own, started a turn later

    def _do(self, deed: Awaitable[None]) -> None:
        self.loop.run_until_complete(deed)

    def idle_round(self) -> None:
        """Nothing: a loop without news sleeps in `select`."""

    def news(self, trees: Sequence[int]) -> None:
        async def deed() -> None:
            for tree in trees:
                self._tell(tree, "", NEWS)
                await asyncio.sleep(0)

        self._do(deed())

    def burst(self, trees: Sequence[int]) -> None:
        async def deed() -> None:
            for tree in trees:
                self._tell(tree, "", NEWS)
            await asyncio.sleep(0)

        self._do(deed())

    def results(self, trees: Sequence[int], action: str, ok: bool = True) -> None:
        async def deed() -> None:
            for tree in trees:
                self._tell(tree, action, ok)
                await asyncio.sleep(0)
            await _turns(4)  # ends of parallels and of whole trees

        self._do(deed())

    def _tell(self, tree: int, action: str, what: Any) -> None:
        acts = self.acts[tree]
        act = acts[action] if action else next(a for a in acts.values() if a.future is not None)
        assert act.future is not None
        act.future.set_result(what)

    def status(self, tree: int) -> str:
        task = self.tasks[tree]
        return "running" if not task.done() else "success" if task.result() else "failure"

    def running(self, tree: int) -> frozenset[str]:
        return frozenset(name for name, act in self.acts[tree].items() if act.future is not None)

    def close(self) -> None:
        for task in self.tasks:
            task.cancel()
        self.loop.run_until_complete(asyncio.gather(*self.tasks, return_exceptions=True))
        self.loop.close()


async def _run(tree: Step) -> bool:
    return bool(await tree())


async def _turns(count: int) -> None:
    for _ in range(count):
        await asyncio.sleep(0)


class AsyncBtree:
    """async-btree."""

    name = "async-btree"
    given = "asyncio's own loop; told news by setting a future, which no user interface, journal or test can look into"
    lacks: tuple[str, ...] = ()
    most = 1_000_000

    def version(self) -> str:
        import async_btree

        del async_btree
        return version("async-btree")

    def build(self, tree: Node, name: str, count: int) -> AsyncFleet:
        del name
        import async_btree as bt

        made = []
        for _ in range(count):
            acts: dict[str, Act] = {}
            made.append((_built(bt, tree, acts), acts))
        return AsyncFleet(made)


def _built(bt: Any, node: Node, acts: dict[str, Act]) -> Any:
    below = [_built(bt, child, acts) for child in node.children]
    if node.kind == "act":
        acts[node.name] = act = Act()

        async def run() -> bool:
            return await act()

        return run
    if node.kind == "check":
        return _check
    if node.kind == "timeout":
        return bt.timeout_after(below[0], float(node.n))
    if node.kind == "retry":
        return bt.retry(below[0], node.n)
    return {"parallel": bt.parallele, "sequence": bt.sequence, "fallback": bt.fallback}[node.kind](below)


async def _check() -> bool:
    return True
