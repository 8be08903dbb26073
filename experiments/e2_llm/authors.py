"""Who writes a task for a request: the drafting loop of the product over a chat, and what came of it as plain values."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, Protocol

from msgspec import Struct

from experiments.e2_llm.columns import HIDDEN_VERBS, NEAR_EXAMPLES, Column, PaperChat, has_hidden

if TYPE_CHECKING:
    from formiga_bt.llm.client import Chat
    from formiga_bt.llm.records import Draft, Round


class Attempt(Struct, frozen=True, kw_only=True):
    """One answer of a model."""

    yaml: str = ""
    """"" = the answer holds no task."""
    values: dict[str, str] = {}
    passed: bool = False
    """Whether checker, dry run and comparison had nothing against it."""
    problems: tuple[str, ...] = ()
    """Their codes."""
    mends: tuple[str, ...] = ()
    """What the program put right by itself."""
    prompt_tokens: int = 0
    cached_tokens: int = 0
    tokens: int = 0
    seconds: float = 0.0


class Written(Struct, frozen=True, kw_only=True):
    """What came of a request."""

    kind: Literal["task", "question", "impossible", "failed"]
    attempts: tuple[Attempt, ...] = ()
    """In order; a model that asks back or refuses has one without a task."""
    yaml: str = ""
    values: dict[str, str] = {}
    say: str = ""
    seconds: float = 0.0

    @property
    def seconds_checks(self) -> float:
        """Return the time that was not the model's: checker, dry runs, comparison, of all rounds."""
        return max(0.0, self.seconds - sum(one.seconds for one in self.attempts))


class Author(Protocol):
    """Writes tasks."""

    def write(self, task: str, words: str) -> Written:
        """Write a task for a request; `task` is the experiment's name for it (T6, second set: "")."""


class DraftAuthor:
    """The drafting loop over a model.

    Args:
        chat: the model.
        column: what it is shown.
        make: the loop; by default `formiga_bt.llm.draft.draft`.
        world: of the loop; None = the demo site.
    """

    def __init__(
        self,
        chat: "Chat",
        column: Column,
        *,
        make: "Callable[..., Draft] | None" = None,
        world: Any = None,
        seed: int = 1,
    ) -> None:
        from formiga_bt.llm.draft import Options, draft
        from formiga_bt.llm.world import world_of

        self._chat, self._column, self._make = chat, column, make or draft
        self._world = world if world is not None else world_of()
        self._options = Options
        self._seed = seed

    def write(self, task: str, words: str) -> Written:
        """Draft a task for a request."""
        hidden = has_hidden(self._column)
        chat: Any = PaperChat(self._chat, task) if hidden else self._chat
        without = () if self._column == "shipped" else NEAR_EXAMPLES
        options = (
            self._options(examples=0, seed=self._seed, without_verbs=HIDDEN_VERBS)
            if hidden
            else self._options(without=without, seed=self._seed)
        )
        return written_of(self._make(words, self._world, chat, options=options))


def written_of(draft: "Draft") -> Written:
    """Return what matters of a draft."""
    return Written(
        kind=draft.kind,
        attempts=tuple(_attempt(one, draft) for one in draft.rounds),
        yaml=draft.yaml,
        values={one.name: one.text for one in draft.values},
        say=draft.say,
        seconds=draft.seconds,
    )


def _attempt(one: "Round", draft: "Draft") -> Attempt:
    wrong = tuple(found.code for found in one.shortfalls if found.severity == "error")
    return Attempt(
        yaml=one.yaml,
        values={value.name: value.text for value in draft.values} if one.yaml == draft.yaml else _run(one.reply.data),
        passed=bool(one.yaml) and not wrong,
        problems=wrong,
        mends=tuple(getattr(one, "mends", ())),
        prompt_tokens=one.reply.usage.prompt,
        cached_tokens=one.reply.usage.cached,
        tokens=one.reply.usage.completion,
        seconds=one.reply.seconds,
    )


def _run(data: Any) -> dict[str, str]:
    """Return the values that an answer in the full form gives."""
    answer = data.get("answer", data) if isinstance(data, dict) else {}
    rows = answer.get("run") if isinstance(answer, dict) else None
    return {
        str(one["name"]): str(one["value"])
        for one in rows or ()
        if isinstance(one, dict) and {"name", "value"} <= set(one)
    }
