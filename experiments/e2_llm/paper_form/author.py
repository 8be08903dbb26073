"""Asks a model once for a program, as the paper does: one answer, no repair."""

from typing import TYPE_CHECKING, Final

from experiments.e2_llm.authors import Attempt, Written
from experiments.e2_llm.fly import World
from experiments.e2_llm.paper_form.prompt import messages, program_in

if TYPE_CHECKING:
    from formiga_bt.llm.client import Chat

MAX_TOKENS: Final = 2000


class PaperFormAuthor:
    """Writes programs in the paper's form. What is `yaml` elsewhere is Python here."""

    def __init__(self, chat: "Chat", world: World, *, seed: int = 1) -> None:
        self._chat, self._world, self._seed = chat, world, seed

    def write(self, task: str, words: str) -> Written:
        """Write a program for a request."""
        told = messages(task, words, self._world)
        reply = self._chat.complete(told, None, max_tokens=MAX_TOKENS, temperature=0.0, seed=self._seed)
        is_whole = reply.finish != "length"
        code = program_in(reply.text) if is_whole else ""
        attempt = Attempt(
            yaml=code,
            prompt_tokens=reply.usage.prompt,
            cached_tokens=reply.usage.cached,
            tokens=reply.usage.completion,
            seconds=reply.seconds,
        )
        return Written(
            kind="task" if code else "failed",
            attempts=(attempt,),
            yaml=code,
            say="" if is_whole else "the answer was cut off",
            seconds=reply.seconds,
        )
