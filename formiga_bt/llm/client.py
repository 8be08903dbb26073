"""Speaks with a language model: `Chat` is what a draft is written over, `open_chat` chooses and opens one.

`openai` is imported here only, and only when a model is asked.
"""

import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from formiga_bt.llm.errors import LlmError
from formiga_bt.llm.records import Message, Reply


class Chat(Protocol):
    """A model that answers messages. One question at a time."""

    @property
    def name(self) -> str:
        """The provider: `groq`, `local`, ..."""

    @property
    def model(self) -> str:
        """The model's name, as the provider calls it."""

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
    ) -> Reply:
        """Ask, and return what the model answered. Blocks until then.

        Args:
            messages: the talk so far; the last one is the question.
            schema: JSON Schema of the answer. The answer is held to it as well as the provider can, and is not validated
                here: the caller checks `Reply.data`. None: the answer is text.
            max_tokens: of the answer; at that length it is cut off, and `finish` says so.
            temperature: 0 takes the most likely answer.
            seed: for providers that draw; some ignore it.
            on_progress: called with the number of tokens so far, from the thread that asks.
            cancel: set it from another thread to stop waiting.

        Raises:
            LlmError: there is no answer (Unreachable, Refused, NoKey, Cancelled, UnusableModel).
        """

    def close(self) -> None:
        """Let go of connections, and end the process of a local model. May be called twice."""


def open_chat(provider: str = "", model: str = "", *, base_url: str = "") -> Chat:
    """Choose a provider and a model, and return a chat with it.

    Args:
        provider: a name of `presets`; "" = FORMIGA_LLM_PROVIDER, then the default of `formiga model use`, then the provider
            whose key is in the environment, then a local model that was fetched.
        model: as the provider calls it; "" = FORMIGA_LLM_MODEL, the configured one, or the provider's default.
        base_url: an endpoint that speaks the protocol of OpenAI; https, except on this machine.

    Raises:
        LlmError: nothing can be chosen; the text lists the ways.
    """
    raise LlmError("not yet")
