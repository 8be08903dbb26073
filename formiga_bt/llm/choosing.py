"""Chooses whom to ask: by the command line, the environment, `formiga model use`, a key, or a model that was fetched."""

import os
from pathlib import Path
from typing import Any, Final

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.llm.adapters import shipped
from formiga_bt.llm.errors import LlmError
from formiga_bt.llm.folders import config_folder, read_object, write_object
from formiga_bt.llm.models import OnDisk, fetched, is_local_name
from formiga_bt.llm.presets import LOCAL, NAMES, OTHER, PRESETS, has_key

NOTHING: Final = """\
no language model is set up. Ways to one:
  a model on this machine, offline:  formiga model fetch qwen2.5-coder-0.5b   (491 MB)
  a service, with a key:             export GROQ_API_KEY=...   (or OPENAI_API_KEY, HF_TOKEN, AZURE_OPENAI_API_KEY)
  a server of your own:              --provider ollama | vllm | llamacpp, or --base-url http://localhost:8000/v1
  help: docs/models.md; formiga model use NAME makes one the default"""


class Choice(Struct, frozen=True, kw_only=True):
    """Whom to ask."""

    provider: str
    model: str = ""
    base_url: str = ""
    adapter: str = ""
    why: str = ""
    """Where the choice comes from, for people."""


def choose(
    provider: str = "", model: str = "", *, base_url: str = "", adapter: str = "", is_change: bool = False
) -> Choice:
    """Return whom `client.open_chat` asks; its arguments are described there.

    Raises:
        LlmError: nothing can be chosen; the text lists the ways.
    """
    if not (provider or base_url) and is_local_name(model):
        provider = LOCAL
    if provider or base_url:
        return _named(provider, model, base_url, adapter, "the command line", is_change)
    model, adapter = model or _said("MODEL"), adapter or _said("ADAPTER")
    if _said("PROVIDER") or _said("BASE_URL"):
        return _named(_said("PROVIDER"), model, _said("BASE_URL"), adapter, "the environment", is_change)
    kept = default()
    if kept is not None:
        return replace(kept, model=model or kept.model, adapter=adapter or kept.adapter)
    for preset in PRESETS.values():
        if preset.keys and has_key(preset):
            return Choice(provider=preset.name, model=model, why=f"{' or '.join(preset.keys)} is set")
    there = fetched()
    if there:
        name = model or _best(there, adapter, is_change)
        return Choice(provider=LOCAL, model=name, adapter=adapter, why="it is on this machine")
    raise LlmError(NOTHING)


def _said(what: str) -> str:
    return os.environ.get(f"FORMIGA_LLM_{what}", "").strip()


def _best(there: list[OnDisk], adapter: str, is_change: bool) -> str:
    """Return which of the models on this machine is asked: one that was trained for this, else the largest.

    An adapter was trained on requests, not on changes of tasks: for these it is the largest.
    """
    tuned = [] if adapter or is_change else [one for one in there if shipped(one) is not None]
    return (tuned or there)[0].name


def _named(provider: str, model: str, base_url: str, adapter: str, why: str, is_change: bool) -> Choice:
    """Return the choice of a provider by its name, or by the name of a local model."""
    if is_local_name(provider):
        provider, model = LOCAL, provider
    name = provider or OTHER
    if name not in (*NAMES, OTHER):
        raise LlmError(f"there is no provider '{name}'", help=f"{', '.join(NAMES)}; or --base-url for another endpoint")
    if name == LOCAL and not model:
        there = fetched()
        if not there:
            raise LlmError("no model is on this machine", help="formiga model fetch qwen2.5-coder-0.5b")
        model = _best(there, adapter, is_change)
    return Choice(provider=name, model=model, base_url=base_url, adapter=adapter, why=why)


def default_file() -> Path:
    """Return the file with the default."""
    return config_folder() / "llm.json"


def default() -> Choice | None:
    """Return what `formiga model use` made the default, or None."""
    kept = read_object(default_file())
    words: dict[str, Any] = {key: kept.get(key, "") for key in ("provider", "model", "base_url", "adapter")}
    if not all(isinstance(value, str) for value in words.values()) or words["provider"] not in (*NAMES, OTHER):
        return None
    return Choice(**words, why=f"formiga model use ({default_file()})")


def make_default(choice: Choice | None) -> None:
    """Keep a choice as the default; None: there is none.

    Raises:
        LlmError: it cannot be written.
    """
    path = default_file()
    try:
        if choice is None:
            path.unlink(missing_ok=True)
            return
        words = {
            "provider": choice.provider,
            "model": choice.model,
            "base_url": choice.base_url,
            "adapter": choice.adapter,
        }
        write_object(path, {key: value for key, value in words.items() if value})
    except OSError as error:
        raise LlmError(f"cannot write {path}: {error.strerror or error}") from error
