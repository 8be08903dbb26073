"""Tasks that cannot be resumed: their steps are given up, and their machines come home.

Of a tree that cannot be rebuilt nothing is run any more, no cleanup either. What its goals do is canceled, and each machine
that may be airborne is brought home by its type's recover subtree, as at every release.
"""

from msgspec.structs import replace

from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.goals.people import People
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.engine.tasks.recovery import UNDER_WAY
from formiga_bt.engine.tasks.runs import Runs
from formiga_bt.engine.tasks.tasks import Tasks
from formiga_bt.nodes.ends import Drain, End, GoalEnd


class Rescue:
    """Sends tasks to their part `recover`."""

    def __init__(self, core: Core, goals: Goals, people: People, runs: Runs, tasks: Tasks) -> None:
        self._core = core
        self._goals = goals
        self._people = people
        self._runs = runs
        self._tasks = tasks

    def give_up(self, task_id: str, code: str, reason: str) -> None:
        """End a task without its tree.

        Args:
            task_id: has not ended.
            code: its reason code, `exception` or `upgrade`.
            reason: in words.
        """
        core = self._core
        task = core.task(task_id)
        if task.status == "PENDING":
            self._tasks.refuse(task_id, code, reason)
            return
        drain = self._forget_tree(task_id)
        task = core.task(task_id)  # what its goals waited for is gone with them, and with that a cause of HELD
        outcome = task.outcome
        if not (outcome.status and task.system.agent):
            outcome = replace(outcome, status="FAILED", code=code, reason=reason)
        homes = tuple(replace(r, state="failed") if r.state in UNDER_WAY else r for r in task.agents.recovering)
        core.put_task(
            task_id,
            section="finally" if task.section == "recover" else task.section,  # its way home is begun anew
            ending=replace(task.ending, stopping=True, drain=drain, cleanups=(), abort_now=True),
            agents=replace(task.agents, releasing={}, served={}, recovering=homes),
            hold=replace(task.hold, clock=replace(task.hold.clock, paused=())),
            restart=replace(task.restart, why=""),
            outcome=outcome,
        )
        core.effect(Alarm("not_resumed", f"{task_id} is not resumed, its machines come home: {reason}", task_id))
        core.touch(task_id)

    def _forget_tree(self, task_id: str) -> Drain:
        """Drop all that a task's tree stood for; return the goals whose end must be waited for."""
        core = self._core
        drain: list[End] = []
        self._runs.open.pop(task_id, None)
        for goal in [g for g in core.state.goals.values() if g.task == task_id and g.owner != "!question"]:
            if goal.ended:
                core.emit(ch.GoalDrop(goal.id))
            elif self._goals.cancel(goal.id):
                core.put_goal(goal.id, owner="!task")
                drain.append(GoalEnd(goal.id))
        for question in core.index.questions_of(task_id):
            self._people.close(question)
        for timer in core.index.deadlines_of(task_id):
            core.clear_deadline(timer)
        for key, request in list(core.state.requests.items()):
            if request.holder == task_id:
                core.emit(ch.RequestPut(key, None))
        for path in list(core.state.memory.get(task_id, ())):
            core.emit(ch.NodeMem(task_id, path, None))
        for scope in list(core.state.scopes.get(task_id, ())):
            if scope:
                core.emit(ch.ScopePut(task_id, scope, None))
        return tuple(drain)
