"""How the services give the engine an order of a person; a refusal of the engine becomes one of the API."""

from collections.abc import Container
from typing import Protocol

from formiga_bt.base.errors import FormigaError, TaskError
from formiga_bt.engine.kernel.inputs import Input
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.services.http.proving import Proofs
from formiga_bt.services.refused import Refused
from formiga_bt.services.view import EngineView
from formiga_bt.services.words import hint_for


class OrderTaker(Protocol):
    """What is needed of the realtime driver."""

    def ask(self, given: Input, timeout_s: float = 10.0) -> Accepted | Done:
        """Hand in an order and wait for the reply."""
        ...


def ask(driver: OrderTaker, given: Input, target: str = "") -> Accepted | Done:
    """Hand in an order and wait for the reply.

    Args:
        driver: of the running engine.
        given: the order.
        target: whom it is for, in the hint of a refusal.

    Raises:
        Refused: the engine refused it, or has ended.
    """
    try:
        return driver.ask(given)
    except TaskError as error:
        raise Refused(error.code, error.text, hint_for(error.code, target), near=error.near) from error
    except FormigaError as error:
        raise Refused("stopped", error.text, "formiga up starts it again") from error


class PersonalOrders:
    """Gives orders for which a person may have to prove who they are.

    Args:
        driver: of the running engine.
        view: its read-only copy.
        proofs: compares the secrets that people say something with.
    """

    def __init__(self, driver: OrderTaker, view: EngineView, proofs: Proofs) -> None:
        self._driver = driver
        self._view = view
        self._proofs = proofs

    @property
    def needs_proof(self) -> bool:
        """Return whether people must say their secret here."""
        return self._proofs.needed

    def prove(self, person: str, secret: str, known: Container[str]) -> None:
        """Compare the secret of a person, of whom the engine would take the word; that of others it refuses.

        Raises:
            Refused: it is missing or wrong.
        """
        if person in known:
            self._proofs.check(person, secret)

    def give(self, given: Input, target: str = "") -> Accepted | Done:
        """Give an order; afterwards the view has what it did.

        Args:
            given: the order.
            target: whom it is for, in the hint of a refusal.

        Raises:
            Refused: the engine refused it, or has ended.
        """
        reply = ask(self._driver, given, target)
        self._view.catch_up()
        return reply
