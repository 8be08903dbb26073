"""From a key to an order to the engine's reply: what is asked first, what left, what came back. Nothing here knows a screen."""

from typing import Final

from formiga_bt.base.errors import FormigaError
from formiga_bt.show.facts import Now
from formiga_bt.show.watch.background import Away
from formiga_bt.show.watch.guards import Gate, cannot_answer
from formiga_bt.show.watch.needs import find_question
from formiga_bt.show.watch.orders import Actor, WatchOrder, WatchReply
from formiga_bt.show.watch.text import Tone, clean

NEW_S: Final = 1.0
"""A question younger than this on the screen is not answered: the key was meant for what was there before."""
TOLD_S: Final = 30.0
"""A reply is shown for so long."""
READ_ONLY: Final = "read only: orders are off"


class Ordering:
    """The orders of one person who watches.

    Args:
        actor: carries them; None: there are none to give.
        away: makes the call.
    """

    def __init__(self, actor: Actor | None, away: Away) -> None:
        self.gate = Gate()
        self._actor = actor
        self._away = away
        self._first_seen: dict[str, float] = {}
        self._said: tuple[str, Tone, float] | None = None
        self.under_way = 0
        """Orders that have left and have no reply yet."""

    @property
    def is_off(self) -> bool:
        """Return whether no orders can be given."""
        return self._actor is None

    def see(self, now: Now, at_s: float) -> None:
        """Take the site as it is shown now."""
        before = self._first_seen
        self._first_seen = {q.number: before.get(q.number, at_s) for q in now.questions}

    def ask(self, order: WatchOrder, now: Now, at_s: float) -> WatchOrder | None:
        """Take an order of a key; return it if it may leave at once."""
        if self._actor is None:
            self.say(READ_ONLY, "warn", at_s)
            return None
        if order.verb == "answer":
            question = find_question(order.target, now)
            wrong = cannot_answer(question) if question is not None else ""
            if not wrong and at_s - self._first_seen.get(order.target, at_s) < NEW_S:
                wrong = f"{order.target} has only just come: read it, then press the key again; nothing was sent"
            if wrong:
                self.say(wrong, "warn", at_s)
                return None
        self._said = None
        return self.gate.begin(order, now, at_s)

    def press(self, key: str, character: str, at_s: float) -> WatchOrder | None:
        """Take a key while something is asked; return the order if it may leave now."""
        order = self.gate.press(key, character, at_s)
        if order is None and not self.gate.is_open and self.gate.said:
            self.say(self.gate.said, "plain", at_s)
        return order

    def lapse(self, at_s: float) -> None:
        """Forget what is asked or told for too long."""
        if self.gate.lapse(at_s):
            self.say(self.gate.said, "plain", at_s)
        if self._said is not None and not self.under_way and at_s - self._said[2] > TOLD_S:
            self._said = None

    async def send(self, order: WatchOrder, at_s: float) -> None:
        """Send an order, and keep what the engine says."""
        assert self._actor is not None
        actor = self._actor
        self.say(f"sending: {order.words} ...", "warn", at_s)
        self.under_way += 1
        try:
            reply: WatchReply = await self._away(lambda: actor.send(order))
        except (FormigaError, OSError) as error:
            self.say(f"{order.words}: NO ANSWER, the engine may have got it or not: {error}", "alarm", at_s)
        else:
            self.say(f"{order.words}: {reply.text}", "plain" if reply.good else "alarm", at_s)
        finally:
            self.under_way -= 1

    def say(self, text: str, tone: Tone, at_s: float) -> None:
        """Show a text below."""
        self._said = text, tone, at_s

    def forget(self) -> bool:
        """Stop showing what was said; return whether something was."""
        had, self._said = self._said is not None, None
        return had

    @property
    def shown(self) -> tuple[list[str], Tone]:
        """Return what is to be shown: what is asked, or what was said."""
        if self.gate.is_open:
            return [clean(self.gate.text)], "warn_bar"
        if self._said is None:
            return [], "plain"
        return [clean(part) for part in self._said[0].splitlines()], self._said[1]
