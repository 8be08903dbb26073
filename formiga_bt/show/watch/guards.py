"""What is asked before an order leaves: nothing, a second key, the same key twice, or the machine's id typed.

| order | guard |
|---|---|
| hold | none |
| return | none; of all machines: a second key |
| land | none on the ground; else a second key |
| continue, abort, hand-back, clear, release | a second key |
| lockdown | its key twice within 2 s |
| cut | the machine's id, typed |
| answer | none; where it says that people stand clear of a machine: a second key |

`Gate` is the machine that asks. While it asks, the order it asks about is fixed, whatever happens on the screen.
"""

from typing import Final, Literal

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.show.facts import AgentFact, Now, QuestionFact
from formiga_bt.show.watch.orders import HANDBACKS, WatchOrder
from formiga_bt.show.watch.text import clean, span

TWICE_S: Final = 2.0
"""Lockdown: the second press must come within."""
PATIENCE_S: Final = 20.0
"""A question to the person at the keyboard lapses after."""
LOCKDOWN_KEY: Final = "!"


class OrderGuard(Struct, frozen=True):
    """What must be done before an order leaves."""

    kind: Literal["none", "yes", "twice", "typed", "choose"]
    text: str = ""
    options: tuple[str, ...] = ()
    """Of `choose`: who answers, or what becomes of a machine's task."""


NONE: Final = OrderGuard("none")


def guard_of(order: WatchOrder, now: Now) -> OrderGuard:
    """Return what an order must be asked first, as the site stands."""
    target = order.target
    match order.verb:
        case "hold" | "ack":
            return NONE
        case "return":
            return NONE if order.kind != "all" else OrderGuard("yes", "Return ALL machines to their ports?")
        case "land":
            return _land(order, now)
        case "continue":
            return OrderGuard("yes", f"Continue {target}: interrupted steps are sent again?")
        case "abort":
            return OrderGuard("yes", f"Abort {target}: its cleanup runs, what flies comes home?")
        case "clear":
            return OrderGuard("yes", f"{target} was looked at, and may be used again?")
        case "handback" if not order.how:
            return OrderGuard("choose", f"Hand {target} back to the engine; its task?", HANDBACKS)
        case "handback":
            then = {
                "continue": "its interrupted step is sent again",
                "return": "it flies to its port, its task stays HELD",
                "end": "its interrupted step fails",
            }
            return OrderGuard("yes", f"Hand {target} back to the engine: {then[order.how]}?")
        case "release":
            return OrderGuard("yes", "Release the lockdown: what was not interrupted goes on?")
        case "lockdown":
            return OrderGuard(
                "twice", f"LOCKDOWN: everything that flies comes home. {LOCKDOWN_KEY} once more within 2 s"
            )
        case "cut":
            return OrderGuard("typed", f"CUT stops the motors of {target} at once; in the air IT FALLS. Type its name")
        case "answer":
            return _answer(order, now)


def _land(order: WatchOrder, now: Now) -> OrderGuard:
    if order.kind == "all":
        return OrderGuard("yes", "Land ALL machines where they are?")
    machines = _machines(order, now)
    if machines and all(one.landed == "grounded" for one in machines):
        return NONE
    return OrderGuard("yes", f"Land {order.target} where it is, not at home? Nobody there is asked")


def _machines(order: WatchOrder, now: Now) -> list[AgentFact]:
    if order.kind == "agent":
        return [agent for agent in now.agents if agent.id == order.target]
    return [agent for agent in now.agents if agent.task == order.target and not agent.human]


def _answer(order: WatchOrder, now: Now) -> OrderGuard:
    question = next((q for q in now.questions if q.number == order.target), None)
    if question is None:
        return OrderGuard("yes", f"{order.target} is not shown any more; answer '{clean(order.how)}' all the same?")
    if not order.by and len(question.here) > 1:
        return OrderGuard("choose", f"Who answers {question.number}?", question.here)
    if question.kind == "clearance" or order.how in question.clears_on:
        asked = f"{question.number}, asked {span(now.at - question.asked_at)} ago: {clean(question.text)}"
        return OrderGuard("yes", f"{asked} Answer '{clean(order.how)}'?")
    return NONE


def cannot_answer(question: QuestionFact) -> str:
    """Return why a question cannot be answered here, or empty."""
    if question.here and question.form:
        return f"{question.number} has a form: formiga inbox shows the command that answers it"
    if question.here:
        return ""
    who = ", ".join(question.asked) or "nobody"
    return f"{question.number} is answered by {who} with their own app, not here"


class Gate:
    """Asks before an order leaves. `begin` and `press` return the order that may leave now, if one may."""

    def __init__(self) -> None:
        self.order: WatchOrder | None = None
        """The one that is asked about."""
        self.guard = NONE
        self.typed = ""
        self.said = ""
        """How the last asking ended, if no order left."""
        self._until_s = 0.0
        self._now: Now | None = None

    @property
    def is_open(self) -> bool:
        """Return whether something is asked now."""
        return self.order is not None

    @property
    def text(self) -> str:
        """Return what is asked, with the keys that answer."""
        match self.guard.kind:
            case "yes":
                return f"{self.guard.text}  y: yes   any other key: no"
            case "choose":
                options = "   ".join(f"{i}: {name}" for i, name in enumerate(self.guard.options, 1))
                return f"{self.guard.text}  {options}   any other key: nothing is done"
            case "typed":
                return f"{self.guard.text}, then Enter (Esc: nothing is done): {self.typed}"
            case _:
                return self.guard.text

    def begin(self, order: WatchOrder, now: Now, at_s: float) -> WatchOrder | None:
        """Take an order; return it if nothing is to be asked."""
        self.said = ""
        self.guard = guard_of(order, now)
        if self.guard.kind == "none":
            self.order = None
            return order
        self.order, self.typed, self._now = order, "", now
        self._until_s = at_s + (TWICE_S if self.guard.kind == "twice" else PATIENCE_S)
        return None

    def lapse(self, at_s: float) -> bool:
        """Forget what is asked if its time is over; return whether it was."""
        if self.order is None or at_s <= self._until_s:
            return False
        self._close(f"{self.order.words}: no second key came; nothing was done")
        return True

    def press(self, key: str, character: str, at_s: float) -> WatchOrder | None:
        """Take a key while something is asked; return the order if it may leave now."""
        order = self.order
        if order is None or self.lapse(at_s):
            return None
        if self.guard.kind == "typed":
            return self._type(order, key, character)
        if self.guard.kind == "choose":
            return self._choose(order, character, at_s)
        wanted = LOCKDOWN_KEY if self.guard.kind == "twice" else "y"
        if character == wanted:
            self._close("")
            return order
        self._close(f"{order.words}: nothing was done")
        return None

    def _choose(self, order: WatchOrder, character: str, at_s: float) -> WatchOrder | None:
        options, now = self.guard.options, self._now
        if now is not None and character.isdecimal() and 1 <= int(character) <= len(options):
            chosen = options[int(character) - 1]
            order = replace(order, how=chosen) if order.verb == "handback" else replace(order, by=chosen)
            return self.begin(order, now, at_s)
        self._close(f"{order.words}: nothing was done")
        return None

    def _type(self, order: WatchOrder, key: str, character: str) -> WatchOrder | None:
        if key == "enter":
            typed = self.typed
            if typed == order.target:
                self._close("")
                return replace(order, confirmed=typed)
            self._close(f"'{typed}' is not {order.target}; nothing was done")
        elif key == "escape":
            self._close(f"{order.words}: nothing was done")
        elif key == "backspace":
            self.typed = self.typed[:-1]
        elif character.isprintable():
            self.typed += character
        return None

    def _close(self, said: str) -> None:
        self.order, self.typed, self.said, self._now = None, "", said, None
