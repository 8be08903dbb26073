"""Reads what people fill in: the fields are those of the forms of the tasks that ask."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from formiga_bt.lang.model import Ask, Task
from formiga_bt.lang.scenario.book import Book
from formiga_bt.lang.scenario.entries import ScenarioAgent
from formiga_bt.lang.text.document import Entry
from formiga_bt.lang.walk import all_steps


def filled(book: Book, entry: Entry, asks: Iterable[Ask]) -> Mapping[str, Any]:
    """Return what is filled in, as runtime values; what no form asks for is reported."""
    fields = {one.name: one for ask in asks for one in ask.form}
    values = book.fields(entry, {name: one.kind for name, one in fields.items()}, "form", "asks for")
    for name, value in values.items():
        if fault := fields[name].fault(value):
            book.problems.add("E062", entry.value.mark, fault)
    return values


def with_forms(book: Book, agents: Sequence[ScenarioAgent], tasks: Iterable[Task]) -> tuple[ScenarioAgent, ...]:
    """Return the agents whose answers hold what is filled in; their tasks are known only after the agents."""
    asks = [step for task in tasks for step in all_steps(task) if isinstance(step, Ask)]

    def of(answer: Mapping[str, Any]) -> Mapping[str, Any]:
        entry = answer.get("form")
        return {**answer, "form": filled(book, entry, asks)} if isinstance(entry, Entry) else answer

    return tuple(replace(one, answers=tuple(map(of, one.answers))) for one in agents)
