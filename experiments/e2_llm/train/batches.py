"""From the rows of a training file to token sequences: one site's prompt, then several of its requests with their answers.

Every request sees the site's prompt and itself, and no other request (`Example.turn` says which token is whose), just as the
product asks a tuned model: no examples. The prompt is paid for once, though. The loss is on the answers only.
"""

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

IGNORED: Final = -100
TURNS: Final = 9
"""Requests of a sequence, at most."""

Encode = Callable[[str], list[int]]


@dataclass(frozen=True, slots=True)
class Example:
    """Token ids and what is to be learned of them."""

    ids: list[int]
    labels: list[int]
    turn: list[int]
    """0 for the prompt, which all see; else the request (1, 2, ..) that the token belongs to."""

    @property
    def learned(self) -> int:
        """Return how many tokens are learned."""
        return sum(label != IGNORED for label in self.labels)

    @property
    def places(self) -> list[int]:
        """Return the position of each token, as if its request were the only one."""
        prompt = self.turn.count(0)
        found = list(range(prompt))
        for index in range(prompt, len(self.turn)):
            found.append(found[-1] + 1 if self.turn[index] == self.turn[index - 1] else prompt)
        return found


def asked(request: str, note: str) -> str:
    """Return a request as a model is shown it: see `formiga_bt.llm.prompt.ask`, which this must agree with."""
    return f"<request>{request}</request>\n{note}".rstrip()


def prompt_part(system: str) -> str:
    """Return the system part in ChatML, which the bases use."""
    return f"<|im_start|>system\n{system}<|im_end|>\n"


def turn_parts(request: str, answer: str) -> tuple[str, str]:
    """Return what is asked and what is to be learned of one request in ChatML."""
    return f"<|im_start|>user\n{request}<|im_end|>\n<|im_start|>assistant\n", f"{answer}<|im_end|>"


def sequence_of(encode: Encode, system: str, turns: Sequence[tuple[str, str]], most: int) -> Example | None:
    """Return requests beside each other as tokens, without the last if it is too long; None if not one fits."""
    ids = list(encode(prompt_part(system)))
    labels = [IGNORED] * len(ids)
    turn = [0] * len(ids)
    count = 0
    for request, answer in turns:
        question, learned = (encode(part) for part in turn_parts(request, answer))
        if len(ids) + len(question) + len(learned) > most:
            break
        count += 1
        ids += [*question, *learned]
        labels += [IGNORED] * len(question) + learned
        turn += [count] * (len(question) + len(learned))
    return Example(ids, labels, turn) if count else None


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
        row = rng.sample(list(pairs), len(pairs))
        for start in range(0, len(row), turns):
            one = sequence_of(encode, system, row[start : start + turns], most)
            if one is not None:
                found.append(one)
    rng.shuffle(found)
    return found
