"""Types of the records that the engine hands to expressions: answers, `error`, `abort`, results of actions.

The engine must fill exactly these fields; the loader types `save_as`, `result`, `error` and `abort` with them.
"""

from collections.abc import Sequence
from typing import Final

from formiga_bt.lang.forms import FormField
from formiga_bt.lang.model import ActionSpec
from formiga_bt.lang.types import TEXT, TIME, Type, enum_of, list_of, record_of

ERROR: Final[Type] = record_of(code=TEXT, reason=TEXT, step=TEXT, agent=TEXT)
"""`error`, in on_failure and in later fallback children; `agent` is "" when no agent was concerned."""

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
