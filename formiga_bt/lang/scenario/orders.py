"""Reads the orders of people in a scenario: stops, continue, handback, restart, clear, removed; lockdown; abort."""

from collections.abc import Iterable, Mapping
from typing import Literal

from formiga_bt.base.clock import micros
from formiga_bt.lang.keyed import Keys, read_keys
from formiga_bt.lang.scenario.book import Book
from formiga_bt.lang.scenario.entries import OrderWord, ScenarioOrder
from formiga_bt.lang.scenario.options import ABORT, HANDBACK, LOCKDOWN, ORDER, ORDERS
from formiga_bt.lang.text.document import Mapping_, Scalar
from formiga_bt.lang.text.reading import read_word

Target = Literal["agent", "task", "all", "site"]

_WORDS: Mapping[str, OrderWord] = {one: one for one in ORDERS}  # type: ignore[misc]  # its keys are the words


def read_orders(book: Book, tasks: Iterable[str], mappings: Iterable[Mapping_] | None = None) -> list[ScenarioOrder]:
    """Return orders as they are written, these or all of a scenario; `tasks` are the names of those it requests."""
    every = book.keys.mappings("orders", "order") if mappings is None else mappings
    return _Orders(book, tuple(dict.fromkeys(tasks))).read(every)


class _Orders:
    """Reads the orders of one scenario."""

    def __init__(self, book: Book, tasks: tuple[str, ...]) -> None:
        self.book = book
        self.problems = book.problems
        self.tasks = tasks

    def read(self, mappings: Iterable[Mapping_]) -> list[ScenarioOrder]:
        """Read all of them."""
        found = []
        for mapping in mappings:
            if mapping.get("lockdown") is not None:
                order = self._lockdown(mapping)
            elif mapping.get("abort") is not None:
                order = self._abort(mapping)
            else:
                order = self._order(mapping)
            if order is not None:
                found.append(order)
        return found

    def _order(self, mapping: Mapping_) -> ScenarioOrder | None:
        entry = mapping.get("order")
        word = read_word(entry.value, self.problems, "order", tuple(ORDERS)) if entry is not None else ""
        options = (*ORDER, HANDBACK) if word in ("handback", "") else ORDER
        keys = read_keys(mapping, options, self.problems, f"the order '{word}'" if word else "an order")
        by = self._by(keys)
        at = keys.name("target")
        if not word or at is None:
            return None
        of = self._target(at, word, ORDERS[word])
        if of is None:
            return None
        how = keys.word("how") if word == "handback" else ""
        return ScenarioOrder(micros(keys.number("at")), _WORDS[word], "" if of == "all" else at.text, of, how, by)

    def _lockdown(self, mapping: Mapping_) -> ScenarioOrder | None:
        keys = read_keys(mapping, LOCKDOWN, self.problems, "a lockdown")
        how, by = keys.word("lockdown"), self._by(keys)
        return ScenarioOrder(micros(keys.number("at")), "lockdown", of="site", how=how, by=by) if how else None

    def _abort(self, mapping: Mapping_) -> ScenarioOrder | None:
        keys = read_keys(mapping, ABORT, self.problems, "an abort")
        at, by, how = keys.name("abort"), self._by(keys), keys.word("how")
        if at is None or self._target(at, "abort", ("task",)) is None:
            return None
        return ScenarioOrder(micros(keys.number("at")), "abort", at.text, "task", how, by)

    def _target(self, at: Scalar, word: str, may: tuple[str, ...]) -> Target | None:
        """Return what a target is, or None if the order cannot be given for it (reported)."""
        name = at.text
        of: Target | None = None
        if name == "all":
            of = "all"
        elif name in self.book.types:
            of = "agent"
        elif name in self.tasks:
            of = "task"
        agents = [agent for agent in self.book.types if not self.book.is_human(agent)]
        known = [*(agents if "agent" in may else ()), *(self.tasks if "task" in may else ())]
        if of is None:
            self.book.nobody(
                at, [*known, *(["all"] if "all" in may else [])], " or ".join(m for m in may if m != "all")
            )
            return None
        if of not in may:
            self.problems.add(
                "E013", at.mark, f"'{word}' is for one {' or '.join(may)}, '{name}' is {_WHAT[of]}", _known(known)
            )
            return None
        if of == "agent" and self.book.is_human(name):
            self.problems.add("E013", at.mark, f"'{name}' is a person: orders are for machines", _known(known))
            return None
        return of

    def _by(self, keys: Keys) -> str:
        at = keys.name("by")
        if at is None:
            return "operator"
        people = [agent for agent in self.book.types if self.book.is_human(agent)]
        if at.text not in people and at.text != "operator":
            if at.text in self.book.types:
                self.problems.add("E013", at.mark, f"'{at.text}' is no person: it orders nothing", _known(people))
            else:
                self.book.nobody(at, [*people, "operator"], "person")
        return at.text


_WHAT: Mapping[Target, str] = {"agent": "an agent", "task": "a task", "all": "everything", "site": "the site"}


def _known(names: Iterable[str]) -> str:
    return f"known: {', '.join(names) or 'none'}"
