"""From the rows of a training file to token sequences: one site's prompt, then several of its requests with their answers.

A sequence has the form of the product's prompt: the system part, then requests and answers, so that the later ones teach how to
read examples, and the long system part is paid for once. The loss is on the answers only.
"""

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

IGNORED: Final = -100
TURNS: Final = 5
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


def chat_parts(system: str, turns: Sequence[tuple[str, str]]) -> list[tuple[str, bool]]:
    """Return the text of a conversation in ChatML, which both bases use, and which parts of it are learned."""
    found = [(f"<|im_start|>system\n{system}<|im_end|>\n", False)]
    for request, answer in turns:
        found.append((f"<|im_start|>user\n<request>{request}</request><|im_end|>\n<|im_start|>assistant\n", False))
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
        shuffled = list(pairs)
        rng.shuffle(shuffled)
        for start in range(0, len(shuffled), turns):
            one = sequence_of(encode, system, shuffled[start : start + turns], most)
            if one is not None:
                found.append(one)
    rng.shuffle(found)
    return found
