"""From the rows of a training file to token sequences: one site's prompt, then several of its requests with their answers.

A sequence has the form of the product's prompt: the system part, then requests and answers, so that the later ones teach how to
read examples, and the long system part is paid for once. The loss is on the answers only.
"""

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

IGNORED: Final = -100
TURNS: Final = 7
"""Requests of a sequence, at most."""

Encode = Callable[[str], list[int]]


@dataclass(frozen=True, slots=True)
class Example:
    """Token ids and what is to be learned of them."""

    ids: list[int]
    labels: list[int]

    @property
    def learned(self) -> int:
        """Return how many tokens are learned."""
        return sum(label != IGNORED for label in self.labels)


def asked(request: str, note: str) -> str:
    """Return a request as a model is shown it: see `formiga_bt.llm.prompt.ask`, which this must agree with."""
    return f"<request>{request}</request>\n{note}".rstrip()


def chat_parts(system: str, turns: Sequence[tuple[str, str]]) -> list[tuple[str, bool]]:
    """Return the text of a conversation in ChatML, which both bases use, and which parts of it are learned."""
    found = [(f"<|im_start|>system\n{system}<|im_end|>\n", False)]
    for request, answer in turns:
        found.append((f"<|im_start|>user\n{request}<|im_end|>\n<|im_start|>assistant\n", False))
        found.append((f"{answer}<|im_end|>", True))
        found.append(("\n", False))
    return found


def sequence_of(encode: Encode, system: str, turns: Sequence[tuple[str, str]], most: int) -> Example | None:
    """Return a conversation as tokens, without the last turns if it is too long; None if not one fits."""
    ids: list[int] = []
    labels: list[int] = []
    fits = 0
    for text, learned in chat_parts(system, turns):
        part = encode(text)
        ids += part
        labels += part if learned else [IGNORED] * len(part)
        if len(ids) > most:
            break
        if learned:
            fits = len(ids)
    found = Example(ids[:fits], labels[:fits])
    return found if found.learned else None


def apart(pairs: Sequence[tuple[str, str]], rng: random.Random) -> list[list[tuple[str, str]]]:
    """Return pairs in rows of which none has two with one answer: a model would copy it instead of reading the request."""
    rows: list[list[tuple[str, str]]] = []
    for one in rng.sample(list(pairs), len(pairs)):
        free = next((row for row in rows if all(one[1] != other[1] for other in row)), None)
        if free is None:
            rows.append(free := [])
        free.append(one)
    return rows


def sequences(
    encode: Encode,
    by_site: Sequence[tuple[str, Sequence[tuple[str, str]]]],
    *,
    most: int,
    seed: int,
    turns: int = TURNS,
) -> list[Example]:
    """Return the sequences of one pass over the data, in an order of its own.

    Args:
        encode: text -> tokens, without any added.
        by_site: system prompt and (request, answer) of each site.
        most: tokens of a sequence.
        seed: of the order.
        turns: requests of a sequence.
    """
    rng = random.Random(seed)
    found: list[Example] = []
    for system, pairs in by_site:
        for row in apart(pairs, rng):
            for start in range(0, len(row), turns):
                one = sequence_of(encode, system, row[start : start + turns], most)
                if one is not None:
                    found.append(one)
    rng.shuffle(found)
    return found
