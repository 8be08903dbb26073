"""Steps that wait for time or for an event, and attempts that come again."""

from collections.abc import Iterator

from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.lang.model import WaitFor
from formiga_bt.nodes.memory import LoopMem, RetryMem, WaitForMem, WaitMem
from formiga_bt.show.facts import Because
from formiga_bt.show.why.places import running_leaves
from formiga_bt.show.why.scene import WhyScene
from formiga_bt.show.why.words import span


def waits(scene: WhyScene, task: TaskRecord) -> Iterator[Because]:
    """Tell what the steps of a task wait for, and the how-manieth attempt runs."""
    memory = scene.state.memory.get(task.id, {})
    for key in running_leaves(memory):
        mem = memory[key]
        ends = scene.node_ends(task, key)
        left = f", for another {span(ends - scene.now)}" if ends is not None else ""
        match mem:
            case WaitMem(since):
                yield Because("waits", f"{scene.place(task, key)} waits since {span(scene.now - since)}{left}")
            case WaitForMem(agent):
                step = scene.step(task, key)
                event = step.event if isinstance(step, WaitFor) else "an event"
                yield Because("waits", f"{scene.place(task, key)} waits for {agent} to report `{event}`", agent=agent)
            case LoopMem() if mem.waiting:
                text = f"{scene.place(task, key)} waits for its round {mem.round}{left}"
                yield Because("waits", text)
    for key, mem in memory.items():
        if isinstance(mem, RetryMem) and (mem.waiting or mem.attempt > 1):
            ends = scene.node_ends(task, key)
            begins = f" begins in {span(ends - scene.now)}" if mem.waiting and ends is not None else " runs"
            number = mem.attempt + 1 if mem.waiting else mem.attempt
            text = f"{scene.place(task, key)}: attempt {number} of {mem.attempts}{begins}"
            yield Because("attempt", text)
