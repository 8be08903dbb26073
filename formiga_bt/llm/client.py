"""What a draft is written over: `Chat`; and `open_chat`, which chooses a provider and a model."""

import os
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from msgspec.structs import replace

from formiga_bt.llm.choosing import Choice, choose
from formiga_bt.llm.endpoint import Endpoint
from formiga_bt.llm.errors import LlmError
from formiga_bt.llm.models import usable
from formiga_bt.llm.presets import LOCAL, OTHER, PRESETS, Preset, azure_settings, checked_url, key_of, price_of
from formiga_bt.llm.records import Message, ModelReply
from formiga_bt.llm.wire import shown


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
    ) -> ModelReply:
        """Ask, and return what the model answered. Blocks until then.

        Args:
            messages: the talk so far; the last one is the question.
            schema: JSON Schema of the answer. The answer is held to it as well as the provider can, and is not validated
                here: the caller checks `ModelReply.data`. None: the answer is text.
            max_tokens: of the answer; at that length it is cut off, and `finish` says so.
            temperature: 0 takes the most likely answer.
            seed: for providers that draw; some ignore it.
            on_progress: called with the number of tokens so far, from the thread that asks.
            cancel: set it from another thread to stop waiting.

        Raises:
            LlmError: there is no answer (Unreachable, Refused, TooLong, NoKey, Cancelled, UnusableModel).
        """

    def close(self) -> None:
        """Let go of connections, and end the process of a local model. May be called twice."""


def open_chat(
    provider: str = "", model: str = "", *, base_url: str = "", adapter: str = "", is_change: bool = False
) -> Chat:
    """Choose a provider and a model, and return a chat with it.

    Args:
        provider: a name of `presets`; "" = FORMIGA_LLM_PROVIDER, then the default of `formiga model use`, then the provider
            whose key is in the environment, then a local model that was fetched.
        model: as the provider calls it; "" = FORMIGA_LLM_MODEL, the configured one, or the provider's default.
        base_url: an endpoint that speaks the protocol of OpenAI; https, except on this machine. "" = FORMIGA_LLM_BASE_URL, or
            the provider's.
        adapter: a GGUF file with a LoRA adapter, for a local model; "" = the one that ships for it, if there is one;
            `none` = the model alone.
        is_change: a task is to be changed; adapters were not trained on that.

    Raises:
        LlmError: nothing can be chosen; the text lists the ways.
    """
    choice = choose(provider, model, base_url=base_url, adapter=adapter, is_change=is_change)
    return _local(choice) if choice.provider == LOCAL else _endpoint(choice)


def _endpoint(choice: Choice) -> Chat:
    if choice.adapter:
        raise LlmError(
            f"{choice.provider} takes no adapter: that is for a model on this machine", help="--provider local"
        )
    preset = PRESETS.get(choice.provider) or Preset(name=OTHER)
    base_url, model = choice.base_url or preset.base_url, choice.model or preset.model
    if preset.name == "azure":
        said = azure_settings(preset)
        base_url, model = base_url or said["base_url"], model or said["model"]
        preset = replace(preset, api_version=said["api_version"])
        if not base_url or not model:
            raise LlmError(
                "azure needs the address of your resource, and the name of your deployment",
                help="AZURE_OPENAI_ENDPOINT=https://NAME.openai.azure.com and AZURE_OPENAI_DEPLOYMENT=DEPLOYMENT, "
                "or --base-url and --model",
            )
    if not base_url:
        raise LlmError("an endpoint has an address: --base-url https://host/v1")
    base_url = checked_url(base_url)
    is_own = bool(preset.base_url) and base_url != checked_url(preset.base_url)
    key = key_of(preset, own_address=is_own or preset.name == OTHER)
    chat = Endpoint(preset, base_url, model, key=key, price=price_of(preset, model), whole_s=_whole_s())
    if not model:
        chat.model = _only(chat)
    return chat


def _only(chat: Endpoint) -> str:
    """Return the one model that the endpoint serves."""
    try:
        served = chat.models()
        if len(served) == 1:
            return served[0]
    except LlmError:
        chat.close()
        raise
    chat.close()
    names = ", ".join(shown(name) for name in served[:12]) + (", ..." if len(served) > 12 else "")
    what = f"serves {names}" if served else "serves no model"
    raise LlmError(f"{chat.base_url} {what}", help="name one with --model, or FORMIGA_LLM_MODEL")


def _local(choice: Choice) -> Chat:
    from formiga_bt.llm.adapters import NONE, absent, shipped
    from formiga_bt.llm.local import LocalChat

    model = usable(choice.model)
    own = Path(choice.adapter) if choice.adapter and choice.adapter != NONE else None
    chat = LocalChat(model, adapter=None if choice.adapter == NONE else own or shipped(model))
    chat.note = "" if choice.adapter else absent(model.name)
    return chat


def _whole_s() -> float:
    said = os.environ.get("FORMIGA_LLM_TIMEOUT", "")
    if not said:
        return 300.0
    try:
        seconds = float(said)
    except ValueError:
        seconds = 0.0
    if not 1 <= seconds <= 86400:
        raise LlmError(f"FORMIGA_LLM_TIMEOUT is '{said}'; it is seconds, 1 to 86400")
    return seconds
