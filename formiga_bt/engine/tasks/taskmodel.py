"""What a task's model says, evaluated for one task: its root values at admission, its time-outs, its sections."""

from typing import Any, Final

from formiga_bt.base.clock import Micros, micros
from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.engine.tasks.env import TaskEnv
from formiga_bt.lang.model import Env, EvalError, Expr, Step, Task, UnknownState, Unset, why_not_computed

CANNOT_COMPUTE: Final = (EvalError, Unset, UnknownState, ArithmeticError, LookupError, ValueError, TypeError)
"""What an expression may raise at run time."""


def root_values(core: Core, model: Task, task: TaskRecord) -> dict[str, Any]:
    """Return the values of a task's params and vars at its admission, and again when it begins anew.

    Raises:
        TaskError: one is unknown, missing or cannot be computed.
    """
    params = task.request.params
    unknown = [name for name in params if name not in model.params]
    if unknown:
        raise TaskError("unknown_param", f"{model.name} has no parameter '{unknown[0]}'")
    values = dict(params)
    env = TaskEnv(core, task, values)
    name = ""
    try:
        for name, param in model.params.items():
            if values.get(name) is None and param.default is not None:
                values[name] = param.default.run(env)
            if values.get(name) is None and not param.optional:
                raise TaskError("missing_param", f"{model.name} needs the parameter '{name}'")
        for name, expr in model.vars.items():
            values[name] = expr.run(env)
    except CANNOT_COMPUTE as error:
        raise TaskError("bad_var", f"{model.name}: '{name}' cannot be computed: {why_not_computed(error)}") from error
    return {name: value for name, value in values.items() if value is not None}


def duration_us(expr: Expr, env: Env) -> Micros | str:
    """Return a duration in microseconds, or why it cannot be computed."""
    try:
        return micros(expr.run(env))
    except CANNOT_COMPUTE as error:
        return why_not_computed(error)


def section_steps(model: Task | None, section: str) -> tuple[Step, ...]:
    """Return the steps of a section of a task; the system task Recover has no model."""
    if model is None:
        return ()
    return {
        "steps": model.steps,
        "on_failure": model.on_failure,
        "on_abort": model.on_abort,
        "finally": model.finally_,
    }[section]
