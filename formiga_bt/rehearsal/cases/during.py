"""Reads the faults and orders of a case: those at a time of the clock, and those in the course of a goal.

faults: [{at: 40 s, agent: hwd_1, kind: freeze}, {during: drone.GoTo, nth: 2, at: 5 s, kind: kill, for: 1 min}]

What comes in the course of a goal comes then also when the task takes another time until there. Its `at` counts from the goal's
beginning, and a fault without an agent befalls who does it.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.keyed import read_keys
from formiga_bt.lang.model import Task
from formiga_bt.lang.scenario.book import Book
from formiga_bt.lang.scenario.entries import ScenarioFault, ScenarioOrder
from formiga_bt.lang.scenario.faults import read_faults
from formiga_bt.lang.scenario.orders import read_orders
from formiga_bt.lang.text.document import Entry, Mapping_, Scalar
from formiga_bt.rehearsal.cases.cases import DuringRule
from formiga_bt.rehearsal.cases.options import DURING
from formiga_bt.rehearsal.cases.rules import all_roles, read_order

_OF: Final = tuple(option.name for option in DURING)


@dataclass(slots=True)
class Befalls:
    """What befalls in a case."""

    faults: list[ScenarioFault] = field(default_factory=list)
    orders: list[ScenarioOrder] = field(default_factory=list)
    during: list[DuringRule] = field(default_factory=list)


def read_befalls(book: Book, task: Task) -> Befalls:
    """Return the faults and orders of a case, as they are written."""
    found = Befalls()
    at_times, in_goals = _apart(book.keys.mappings("faults", "fault"))
    found.faults = read_faults(book, at_times)
    for mapping in in_goals:
        if (one := _Goal.of(book, task, mapping)) is not None:
            rest, whose = one.rest(mapping, of_agents=True)
            found.during += [one.rule(entry, whose=whose) for entry in read_faults(book, [rest])]
    at_times, in_goals = _apart(book.keys.mappings("orders", "order"))
    found.orders = read_orders(book, [task.name], at_times)
    for mapping in in_goals:
        if (one := _Goal.of(book, task, mapping)) is not None:
            rest, _ = one.rest(mapping, of_agents=False)
            found.during += [one.rule(entry, whose=False) for entry in read_orders(book, [task.name], [rest])]
    return found


def _apart(mappings: Iterable[Mapping_]) -> tuple[list[Mapping_], list[Mapping_]]:
    every = list(mappings)
    return [one for one in every if one.get("during") is None], [one for one in every if one.get("during") is not None]


@dataclass(frozen=True, slots=True)
class _Goal:
    """The goal in the course of which something befalls."""

    mark: Mark
    at: Mark
    who: str
    action: str
    nth: int
    agents: tuple[str, ...]
    """Who could do it."""

    @classmethod
    def of(cls, book: Book, task: Task, mapping: Mapping_) -> "_Goal | None":
        """Read `during` and `nth`; None if it names no goal, which was reported."""
        mine = Mapping_(tuple(entry for entry in mapping.entries if entry.key.text in _OF), mapping.mark)
        keys = read_keys(mine, DURING, book.problems, "'during'")
        at = keys.text("during")
        order = read_order(book, task, at, "during") if at is not None else None
        if at is None or order is None:
            return None
        who, action = order
        role = all_roles(task).get(who)
        types = role.types if role is not None else ()
        agents = (who,) if who in book.types else tuple(one for one, of in book.types.items() if of in types)
        return cls(mapping.mark, at.mark, who, action, keys.whole("nth"), agents)

    def rest(self, mapping: Mapping_, *, of_agents: bool) -> tuple[Mapping_, bool]:
        """Return what else is written, at once if no time is; and whether it befalls who does the goal."""
        entries = [entry for entry in mapping.entries if entry.key.text not in _OF]
        if mapping.get("at") is None:
            entries.append(Entry(Scalar("at", self.at), Scalar("0 s", self.at)))
        whose = of_agents and mapping.get("agent") is None and bool(self.agents)
        if whose:
            entries.append(Entry(Scalar("agent", self.at), Scalar(self.agents[0], self.at)))
        return Mapping_(tuple(entries), mapping.mark), whose

    def rule(self, entry: ScenarioFault | ScenarioOrder, *, whose: bool) -> DuringRule:
        """Return the rule by which something befalls."""
        return DuringRule(self.mark, self.who, self.action, self.nth, entry, whose)
