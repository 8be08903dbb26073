"""Types of the records that the engine hands to expressions: answers, `error`, `abort`, results of actions.

The engine must fill exactly these fields; the loader types `save_as`, `result`, `error` and `abort` with them.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from formiga_bt.lang.forms import FormField
from formiga_bt.lang.model import ActionSpec, Expr, Fail, Step
from formiga_bt.lang.types import ANY, TEXT, TIME, Type, enum_of, list_of, record_of
from formiga_bt.lang.walk import steps_once

ERROR: Final[Type] = record_of(code=TEXT, reason=TEXT, step=TEXT, agent=TEXT)
"""`error`, in on_failure and in later fallback children; `agent` is "" when no agent was concerned."""


def carried(steps: Iterable[Step]) -> dict[str, list[Expr]]:
    """Return what the `fail` steps of these and of the subtrees that they call carry: the values of each field."""
    found: dict[str, list[Expr]] = {}
    for step in steps_once(steps):
        for name, value in step.data.items() if isinstance(step, Fail) else ():
            found.setdefault(name, []).append(value)
    return found


def error_of(values: Mapping[str, Sequence[Expr]]) -> Type:
    """Return the type of `error` after the failure of steps that carry these values; `data` is there if any do."""
    data = {name: next((one.type for one in of if one.type != ANY), ANY) for name, of in values.items()}
    return record_of(**ERROR.fields, data=record_of(**data)) if data else ERROR


ABORT: Final[Type] = record_of(reason=enum_of("operator", "preempted"))
"""`abort`, in on_abort."""


CHILD: Final[Type] = record_of(status=enum_of("PENDING", "SUCCEEDED", "FAILED", "CANCELED"), reason=TEXT, task_id=TEXT)
"""The result of `request`; PENDING when nothing waits for the end."""


def answer(options: tuple[str, ...], policy: str, form: Sequence[FormField] = ()) -> Type:
    """Return the type of an answer; with `policy: all` the answer may be `mixed`, and `.all` lists the answers.

    What the form holds are fields of each answer; those of several people stand in `.all` only.
    """
    one = record_of(answer=enum_of(*options), by=TEXT, at=TIME, **{field.name: field.kind for field in form})
    if policy == "all":
        return record_of(answer=enum_of(*options, "mixed"), by=TEXT, at=TIME, all=list_of(one))
    return one


def result(action: ActionSpec) -> Type:
    """Return the type of an action's result."""
    return record_of(**dict(action.result))
