"""From a running node's key to the step in the task's file: title and `file:line`."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, Final

from formiga_bt.lang.model import Do, Step, Task
from formiga_bt.nodes.memory import Mem

_SEG: Final = re.compile(r"[a-z_]+\[\d+\]")
Key = tuple[str, ...]


class StepPlaces:
    """The steps of one task by the segments of their path."""

    def __init__(self, task: Task) -> None:
        self._steps: dict[Key, Step] = {}
        for section, steps in (
            ("steps", task.steps),
            ("on_failure", task.on_failure),
            ("on_abort", task.on_abort),
            ("finally", task.finally_),
        ):
            self._walk((section,), steps, 0)

    def _walk(self, at: Key, value: Any, depth: int) -> None:
        for step in _steps_in(value):
            key = (*at, step.seg)
            self._steps[key] = step
            if depth < 40:
                for field in fields(step):
                    self._walk(key, getattr(step, field.name), depth + 1)

    def of(self, key: str) -> Step | None:
        """Return the step of a node's key, for example `steps/steps[1].for#7.steps[0]@2`."""
        section, _, rest = key.partition("/")
        return self._steps.get((section, *_SEG.findall(rest)))


def _steps_in(value: Any) -> Iterator[Step]:
    if isinstance(value, Step):
        yield value
    elif isinstance(value, tuple | list):
        for item in value:
            yield from _steps_in(item)
    elif isinstance(value, Mapping):
        yield from _steps_in(list(value.values()))
    elif is_dataclass(value) and hasattr(value, "steps"):
        yield from _steps_in(value.steps)


def title(step: Step) -> str:
    """Return what a step is called: its name, or what it does."""
    if isinstance(step, Do) and not step.name:
        return f"{step.who.name}.{step.action}"
    return step.title


def running_leaves(memory: Mapping[str, Mem]) -> list[str]:
    """Return the keys of the innermost running nodes, in the order of their start."""
    bare = [key for key in memory if ":" not in key.partition("/")[2]]
    return [key for key in bare if "/" in key and not any(other.startswith(f"{key}.") for other in bare)]
