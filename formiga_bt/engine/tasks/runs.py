"""The runs of all tasks whose trees are there: started, stopped and let go of section by section."""

from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.goals.people import People
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.tasks.children import Children
from formiga_bt.engine.tasks.requests import Requests
from formiga_bt.engine.tasks.taskrun import TaskRun
from formiga_bt.engine.tasks.treerun import TreesFactory
from formiga_bt.lang.model import Step


class Runs:
    """One run for each task, made when it is first needed."""

    def __init__(
        self,
        core: Core,
        goals: Goals,
        people: People,
        requests: Requests,
        children: Children,
        factory: TreesFactory,
    ) -> None:
        self._core = core
        self._goals = goals
        self._people = people
        self._requests = requests
        self._children = children
        self._factory = factory
        self.open: dict[str, TaskRun] = {}
        """Those that are made, by task."""
        self._left: list[TaskRun] = []

    def of(self, task_id: str) -> TaskRun:
        """Return the run of a task."""
        run = self.open.get(task_id)
        if run is None:
            run = self.open[task_id] = TaskRun(
                self._core, self._goals, self._people, self._requests, self._children, task_id, self._factory
            )
        return run

    def leave(self, task_id: str) -> None:
        """Let go of a task's run, once its nodes surely do not run any more (`close_left`)."""
        run = self.open.pop(task_id, None)
        if run is not None:
            self._left.append(run)  # its nodes may be running this very moment

    def close_left(self) -> None:
        """Let go of the runs of tasks that have ended. Called before the next one is looked at."""
        while self._left:
            self._left.pop().close()

    def start(self, task_id: str, section: str, steps: tuple[Step, ...], scope: str = "") -> None:
        """Start a section."""
        self.of(task_id).trees.start(section, steps, scope)
        self._core.touch(task_id)

    def stop(self, task_id: str, section: str, *, cleanup: bool = True) -> None:
        """Stop a section; what ends with it joins the task's drain set, and (`tidy`) each `finally` of its sequences."""
        core = self._core
        run = self.of(task_id)
        run.cleanups.skip = not cleanup
        ends = run.trees.halt(section)
        run.cleanups.skip = False
        for end in ends:
            run.adopt(end, "!task")
        task = core.task(task_id)
        core.put_part(task_id, "ending", stopping=True, drain=(*task.ending.drain, *ends))
        core.touch(task_id)
