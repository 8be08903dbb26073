"""What a task may wait for."""

from formiga_bt.engine.records import TaskRecord
from formiga_bt.engine.state import EngineState


def cause_of(state: EngineState, task: TaskRecord) -> str:
    """Return the cause of a task's wait, "" if there is none."""
    if task.held:
        return "held"
    if any(request.holder == task.id for request in state.requests.values()):
        return "agents"
    if any(g.task == task.id and not g.ended for g in state.goals.values()):
        return "goal"
    if any(q.task == task.id for q in state.questions.values()):
        return "question"
    if any(d.task == task.id for d in state.deadlines.values()):
        return "time"
    if any(state.agents[o.agent].task == task.id for o in state.orders.values()):
        return "order"
    return ""
