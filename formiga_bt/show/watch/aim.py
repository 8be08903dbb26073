"""From a key and the row that is chosen to an order, or to words that say why there is none. Nothing here knows a screen."""

from typing import Final, Literal

from msgspec import Struct

from formiga_bt.show.facts import Now
from formiga_bt.show.watch.needs import choices, find_question, name_of
from formiga_bt.show.watch.orders import Kind, Verb, WatchOrder

ORDERS: Final[dict[str, Verb]] = {"h": "hold", "r": "return", "l": "land", "c": "continue"}
FOR_ALL: Final[dict[str, Verb]] = {"H": "hold", "R": "return", "L": "land", "!": "lockdown", "U": "release"}
FOR_MACHINES: Final[dict[str, Verb]] = {"x": "cut", "C": "clear", "b": "handback"}
ABORT: Final = "A"
NUMBERS: Final = "123456789"


class Aim(Struct, frozen=True):
    """What is chosen at the moment of a key."""

    kind: Literal["task", "agent", "need", "nothing"]
    id: str = ""
    """Empty: no row is chosen."""
    gone: str = ""
    """The row that was chosen, and is no longer there."""

    def target(self, now: Now) -> tuple[Kind | None, str]:
        """Return the machine or task that it is about, if it is about one."""
        if self.kind in ("task", "agent") and self.id:
            return ("task" if self.kind == "task" else "agent"), self.id
        if self.kind != "need":
            return None, ""
        question = find_question(self.id, now)
        if question is not None:
            return "task", question.task
        word, _, name = self.id.partition(":")
        if word in ("agent", "task"):
            return ("agent" if word == "agent" else "task"), name
        return None, ""

    def task(self, now: Now) -> str:
        """Return the task that it is about; of a machine the one that has it."""
        kind, target = self.target(now)
        if kind == "agent":
            return next((agent.task for agent in now.agents if agent.id == target), "")
        return target


def order_of(character: str, aim: Aim, now: Now) -> WatchOrder | str:
    """Return the order of a key, or what is wrong with it; "" for a key that is none."""
    if character in FOR_ALL:
        return WatchOrder(verb=FOR_ALL[character], kind="all")
    if not character or character not in {*ORDERS, *FOR_MACHINES, *NUMBERS, ABORT}:
        return ""
    if not aim.id:
        return (
            f"{name_of(aim.gone)} is no longer here: choose again; nothing was sent"
            if aim.gone
            else "choose a row first"
        )
    if character in NUMBERS:
        return _numbered(int(character), aim, now)
    kind, target = aim.target(now)
    if kind is None:
        return "this row takes no orders"
    if character in ORDERS:
        return WatchOrder(verb=ORDERS[character], kind=kind, target=target)
    if character == ABORT:
        wrong = "abort is for a task: choose one among the tasks (t)"
        return WatchOrder(verb="abort", kind="task", target=target) if kind == "task" else wrong
    if kind != "agent":
        return f"{FOR_MACHINES[character]} is for a machine: choose one among the agents (a)"
    return WatchOrder(verb=FOR_MACHINES[character], kind="agent", target=target)


def _numbered(number: int, aim: Aim, now: Now) -> WatchOrder | str:
    if aim.kind == "need":
        row = aim.id
    else:
        kind, target = aim.target(now)
        asked = [question.number for question in now.questions if kind == "task" and question.task == target]
        if len(asked) > 1:
            return f"{target} has {len(asked)} open questions: choose one (n)"
        row = asked[0] if asked else f"{kind}:{target}"
    found = choices(row, now)
    if number > len(found):
        return f"there is no answer {number} here" if found else "nothing is asked here"
    return found[number - 1]
