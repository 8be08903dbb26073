"""The columns of the experiment: what a model is shown. They are never mixed in one figure.

`paper`: as the paper had it: T1 to T5 as examples, and no helper that leaks T6 to T10. `paper` with T10+ adds T6 to T9.
`helpers`: the product as it ships, without the examples that are near T6 to T10. `shipped`: all examples. `tuned`: as
`helpers`, with a model whose training is told of in the record. `paper-form`: no trees, but Python against the paper's API
(`paper_form`), as a baseline.
"""

import json
import re
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

from formiga_bt.llm.records import Message, ModelReply

if TYPE_CHECKING:
    from formiga_bt.llm.client import Chat

Column = Literal["paper", "helpers", "tuned", "shipped", "paper-form"]
COLUMNS: Final[tuple[Column, ...]] = get_args(Column)

HIDDEN: Final = ("circle", "triangle", "zigzag", "FlyAndLand", "FlyAlong")
"""Helpers and subtrees that the column `paper` hides: they are T6, T7, T8 and the landings of T9 and T10 in one word."""
HIDDEN_VERBS: Final = HIDDEN[3:]
"""Those of them that are subtrees: the loop does without them, too, when it mends a tree."""
NEAR_EXAMPLES: Final = ("ring", "stand", "zigzag", "circle_pair", "after")
"""Ids of the shipped examples that are near T6, T7, T8, T9 and T10; the columns `helpers` and `tuned` leave them out."""
_HIDDEN_USE: Final = re.compile(rf"\b(?:circle|triangle|zigzag)\s*\(|\b(?:{'|'.join(HIDDEN[3:])})\b")
_INSTEAD: Final = (
    "line(FROM, TO, COUNT) is a list of places. "
    "After LandIn a drone needs TakeOff before ReturnHome. FlyTo takes off by itself."
)


def hidden_in(text: str) -> tuple[str, ...]:
    """Return the hidden helpers that a text uses."""
    return tuple(dict.fromkeys(found.rstrip("( ") for found in _HIDDEN_USE.findall(text)))


def has_hidden(column: str) -> bool:
    """Return whether a column hides helpers."""
    return column == "paper"


@cache
def _examples() -> Mapping[str, Sequence[Mapping[str, Any]]]:
    found: dict[str, list[Mapping[str, Any]]] = {}
    for one in json.loads((Path(__file__).parent / "paper_examples.json").read_text(encoding="utf-8")):
        found.setdefault(one["task"], []).append(one)
    return found


def examples_for(task: str) -> list[tuple[str, str]]:
    """Return the examples of the column `paper` as (request, answer): T1 to T5, and for T10+ also T6 to T9."""
    names = ["T1", "T2", "T3", "T4", "T5", *(["T6", "T7", "T8", "T9"] if task == "T10+" else [])]
    return [
        (one["request"], json.dumps({"plan": one["plan"], "answer": one["answer"]}, ensure_ascii=False))
        for name in names
        for one in _examples()[name]
    ]


class LeakError(AssertionError):
    """A prompt of the column `paper` tells of a hidden helper."""


class PaperChat:
    """A chat whose model sees the examples of the paper and no hidden helper, in prompt and schema."""

    def __init__(self, chat: "Chat", task: str) -> None:
        self._chat = chat
        self._examples = examples_for(task)

    @property
    def name(self) -> str:
        """Return the provider."""
        return self._chat.name

    @property
    def model(self) -> str:
        """Return the model."""
        return self._chat.model

    def complete(
        self,
        messages: Sequence[Message],
        schema: Mapping[str, Any] | None,
        *,
        max_tokens: int,
        temperature: float = 0.0,
        seed: int | None = None,
        on_progress: Callable[[int], None] | None = None,
        cancel: threading.Event | None = None,
    ) -> ModelReply:
        """Ask with what the column shows."""
        return self._chat.complete(
            self.shown(messages),
            _narrowed(schema),
            max_tokens=max_tokens,
            temperature=temperature,
            seed=seed,
            on_progress=on_progress,
            cancel=cancel,
        )

    def close(self) -> None:
        """Close the chat within."""
        self._chat.close()

    def shown(self, messages: Sequence[Message]) -> list[Message]:
        """Return the messages as the model sees them.

        Raises:
            LeakError: a hidden helper is still in what the program says.
        """
        system = Message("system", without_hidden(messages[0].text))
        marked = messages[1].text
        told = [system]
        for request, answer in self._examples:
            told += [Message("user", f"<request>{request}</request>"), Message("assistant", answer)]
        for one in told:
            if hidden_in(one.text):
                raise LeakError(
                    f"the prompt of the column paper tells of {', '.join(hidden_in(one.text))}: {one.text[:300]}"
                )
        rest = [
            one if one.role == "assistant" else Message(one.role, without_hidden(one.text, add=False))
            for one in messages[2:]
        ]
        return [*told, Message("user", marked), *rest]


def without_hidden(text: str, *, add: bool = True) -> str:
    """Return a prompt without the sentences that tell of hidden helpers; what they said besides is said anew."""
    lines = []
    for line in text.split("\n"):
        kept = [part for part in re.split(r"(?<=[.;])\s+", line) if not _HIDDEN_USE.search(part)]
        if kept or not line:
            lines.append(" ".join(kept))
    return "\n".join([*lines, _INSTEAD] if add and "\n".join(lines) != text else lines)


def _narrowed(schema: Mapping[str, Any] | None) -> Mapping[str, Any] | None:
    if schema is None:
        return None
    gone = {f"#/$defs/do_{name}" for name in HIDDEN}
    new = _pruned(schema, gone)
    for name in HIDDEN:
        new.get("$defs", {}).pop(f"do_{name}", None)
    found: Mapping[str, Any] = new
    return found


def _pruned(value: Any, gone: set[str]) -> Any:
    if isinstance(value, Mapping):
        return {key: _pruned(one, gone) for key, one in value.items()}
    if isinstance(value, list):
        return [_pruned(one, gone) for one in value if not (isinstance(one, Mapping) and one.get("$ref") in gone)]
    return value
