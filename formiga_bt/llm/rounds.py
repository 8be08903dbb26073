"""Parts of a round of a draft: an answer that was tried and what it is worth, and the guards around its judging.

Called by `draft`. An answer may hold anything: whatever it makes of a program is one thing that is wrong with it, so that the
model is asked again and no draft is lost.
"""

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import TypeVar

from msgspec import structs

from formiga_bt.base.errors import FormigaError
from formiga_bt.llm.envelope import ModelAnswer, NoAnswer, read_answer
from formiga_bt.llm.errors import LlmError
from formiga_bt.llm.judging.agreeing import meaning
from formiga_bt.llm.judging.judge import Judged
from formiga_bt.llm.letters import whole
from formiga_bt.llm.records import ModelReply, Round, Shortfall

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Try:
    """One answer, and what it is worth."""

    errors: int
    answer: ModelAnswer | None
    judged: Judged | None
    reply: ModelReply
    round: Round

    @property
    def means(self) -> Hashable:
        """Return what the answer means; see `agreeing`."""
        assert self.answer is not None
        return meaning(self.answer, self.judged.flight if self.judged is not None else None)


def guarded(work: Callable[[], T], otherwise: Callable[[str], T]) -> T:
    """Return what comes of an answer; if that cannot be read, what is made of the name of the error.

    Raises:
        FormigaError: something else is wrong than the answer.
    """
    try:
        return work()
    except FormigaError:
        raise
    except Exception as error:  # noqa: BLE001 - see above
        return otherwise(type(error).__name__)


def unreadable(error: str, edited: tuple[str, ...] = ()) -> Judged:
    """Return what an answer is worth whose tree cannot be read."""
    wrong = f"a part of the tree is not of the form, so that it cannot be read ({error})"
    return Judged(None, "", (), (Shortfall("form", wrong, "$"),), None, edited)


def is_unreadable(judged: Judged) -> bool:
    """Return whether a tree could not be read at all, so that nothing in it can be edited either."""
    return any(one.code == "form" and one.where == "$" for one in judged.shortfalls)


def sound(reply: ModelReply) -> ModelReply:
    """Return a reply that can be kept: without halves of letters, which a chat of somebody's own may let through."""
    try:
        return structs.replace(reply, text=whole(reply.text), data=whole(reply.data))
    except RecursionError:
        return structs.replace(reply, text=whole(reply.text), data=None)


def version_of(answer: str) -> str:
    """Return the version of the task that is changed, which no model says in the short form."""
    try:
        tree = read_answer(None, answer).tree or {}
    except NoAnswer:
        return ""
    return str(tree.get("version") or "")


def missing(came: int, wanted: int, error: LlmError) -> Shortfall:
    """Return the warning that not all answers came that were asked for."""
    text = f"{came} of {wanted} answers came, then the model did not answer: {str(error).splitlines()[0]}"
    return Shortfall("answers_missing", text, severity="warning")


def at_odds(count: int) -> Shortfall:
    """Return the warning that answers which pass do different things."""
    text = f"the {count} answers of the model that pass do different things; this is the first of them"
    return Shortfall(
        "answers_differ", f"{text}: read its steps with care", help="say the request in other words", severity="warning"
    )
