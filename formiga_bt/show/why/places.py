"""From a running node's key to the step in the task's file: title and `file:line`."""

from collections.abc import Mapping

from formiga_bt.lang.model import Do, Step, Task
from formiga_bt.lang.places import steps_around
from formiga_bt.nodes.memory import Mem


class StepPlaces:
    """The steps of one task by the keys of its nodes."""

    def __init__(self, task: Task) -> None:
        self.task = task

    def of(self, key: str) -> Step | None:
        """Return the step of a node's key, for example `steps/steps[1].for#7.steps[0]@2`."""
        around = steps_around(self.task, key)
        return around[-1] if around else None

    def place(self, key: str) -> str:
        """Return what people call the node with this key, and where it stands; an unknown key as it is."""
        step = self.of(key)
        return f"{title(step)} at {step.mark.file}:{step.mark.line}" if step is not None else key


def title(step: Step) -> str:
    """Return what a step is called: its name, or what it does."""
    if isinstance(step, Do) and not step.name:
        return f"{step.who.name}.{step.action}"
    return step.title


def running_leaves(memory: Mapping[str, Mem]) -> list[str]:
    """Return the keys of the innermost running nodes, in the order of their start."""
    bare = [key for key in memory if ":" not in key.partition("/")[2]]
    return [key for key in bare if "/" in key and not any(other.startswith(f"{key}.") for other in bare)]
