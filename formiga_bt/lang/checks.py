"""Checks of a whole task, on the model: retries, time-outs, ignored failures, the state of flight."""

from formiga_bt.lang.model import Catalogue, Task
from formiga_bt.lang.reading import Problems


def check_task(task: Task, catalogue: Catalogue, problems: Problems) -> None:
    """Report what only the whole task shows."""
