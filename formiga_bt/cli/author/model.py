"""`formiga model`: the language models that drafts are written with."""

import os
import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from formiga_bt.cli.inputs import UnusableFile

if TYPE_CHECKING:
    from formiga_bt.llm.choosing import Choice

MODEL = typer.Option("--model", help="With use, try: the model, as the provider calls it.", metavar="NAME")


class ModelCommand(StrEnum):
    """What is done."""

    LIST = "list"
    FETCH = "fetch"
    ADD = "add"
    USE = "use"
    TRY = "try"
    REMOVE = "remove"


def command(
    what: Annotated[
        ModelCommand, typer.Argument(help="list, fetch, add, use, try or remove.", show_default=False)
    ] = ModelCommand.LIST,
    subject: Annotated[
        str, typer.Argument(help="A model's name; with add a GGUF file; with use, try also a provider.", metavar="NAME")
    ] = "",
    name: Annotated[str, typer.Option(help="With add: what to call it.", metavar="NAME")] = "",
    model: Annotated[str, MODEL] = "",
    base_url: Annotated[
        str, typer.Option("--base-url", help="With use, try: an endpoint of your own.", metavar="URL")
    ] = "",
    adapter: Annotated[
        Path | None,
        typer.Option(
            help="With use, try: a LoRA adapter for a local model; none: without the one of the project.",
            metavar="FILE",
        ),
    ] = None,
) -> None:
    """Show, fetch and choose the language models that write drafts: on this machine, or a provider. See docs/models.md.

    Exit code 1: it cannot be done. 2: the command line cannot be used.
    """
    if what in (ModelCommand.FETCH, ModelCommand.ADD, ModelCommand.REMOVE) and not subject:
        raise UnusableFile(
            f"formiga model {what} needs {'a FILE' if what is ModelCommand.ADD else 'the NAME of a model'}"
        )
    if what is ModelCommand.LIST:
        _list()
    elif what is ModelCommand.FETCH:
        _fetch(subject)
    elif what is ModelCommand.ADD:
        _add(Path(subject), name)
    elif what is ModelCommand.REMOVE:
        _remove(subject)
    elif what is ModelCommand.USE and subject == "none":
        from formiga_bt.llm.choosing import make_default

        make_default(None)
        print("no model is the default")
    else:
        if what is ModelCommand.USE and not (subject or base_url):
            raise UnusableFile("formiga model use needs a model, a provider, --base-url URL, or the word none")
        _choose(what, subject, model, base_url, adapter)


def _list() -> None:
    from formiga_bt.llm.choosing import choose
    from formiga_bt.llm.errors import LlmError
    from formiga_bt.llm.models import KNOWN, fetched
    from formiga_bt.llm.presets import PRESETS, has_key

    there = {one.name: one for one in fetched()}
    print("on this machine:")
    rows = [(one.name, one.size, one.memory_mb, one.name in there, one.good_for, one.source) for one in KNOWN]
    rows += [
        (one.name, one.size, one.memory_mb, True, "", str(one.file))
        for one in there.values()
        if all(one.name != known.name for known in KNOWN)
    ]
    for name, size, memory, is_here, good_for, source in rows:
        state = "here" if is_here else "-"
        print(f"  {name:20} {state:5} {size / 1e6:7.0f} MB, {memory} MB of memory{f'; {good_for}' if good_for else ''}")
        print(f"  {'':26} {source}")
    print("providers:")
    for preset in PRESETS.values():
        if not preset.keys:
            how = f"at {preset.base_url}"
        else:
            how = "key found" if has_key(preset) else f"needs {preset.keys[0]}"
        print(f"  {preset.name:20} {how}{f'; {preset.model}' if preset.model else ''}")
    try:
        chosen = choose()
        print(f"used: {_words(chosen)} ({chosen.why})")
    except LlmError:
        print("used: none yet; formiga model fetch NAME, or formiga model use NAME")


def _words(choice: "Choice") -> str:
    words = " ".join(word for word in (choice.provider, choice.model, choice.base_url) if word)
    return f"{words} with {choice.adapter}" if choice.adapter else words


def _fetch(name: str) -> None:
    from formiga_bt.llm.adapters import absent
    from formiga_bt.llm.fetching import fetch
    from formiga_bt.llm.models import KNOWN, known

    found = known(name)
    if found is None:
        names = ", ".join(one.name for one in KNOWN)
        raise UnusableFile(f"'{name}' cannot be fetched", help=f"{names}; or formiga model add FILE")
    there = fetch(found, lambda line: print(line, flush=True))
    print(f"{there.name}: {there.file}\n  SHA-256 {there.sha256}, as {found.source}")
    if note := absent(there.name):
        print(f"note: {note}", file=sys.stderr)


def _add(file: Path, name: str) -> None:
    from formiga_bt.llm.models import add

    added = add(file, name)
    print(f"{added.name}: {added.file}\n  SHA-256 {added.sha256}; it stays where it is")


def _remove(name: str) -> None:
    from formiga_bt.llm.choosing import default, make_default
    from formiga_bt.llm.models import remove
    from formiga_bt.llm.presets import LOCAL

    freed = remove(name)
    print(f"{name} is gone; {freed / 1e6:.0f} MB are free again")
    kept = default()
    if kept is not None and kept.provider == LOCAL and kept.model == name:
        make_default(None)
        print("it was the default; there is none now")


def _choose(what: ModelCommand, subject: str, model: str, base_url: str, adapter: Path | None) -> None:
    from formiga_bt.llm.adapters import NONE
    from formiga_bt.llm.choosing import choose, make_default
    from formiga_bt.llm.models import usable
    from formiga_bt.llm.presets import LOCAL, checked_url

    tuned = "" if adapter is None else NONE if str(adapter) == NONE else str(adapter.expanduser().absolute())
    chosen = choose(subject, model, base_url=base_url, adapter=tuned)
    if chosen.base_url:
        checked_url(chosen.base_url)
    if chosen.provider == LOCAL:
        usable(chosen.model)
    if what is ModelCommand.USE:
        make_default(chosen)
        print(f"the default is {_words(chosen)}")
        named = [word for word in ("PROVIDER", "BASE_URL", "MODEL") if os.environ.get(f"FORMIGA_LLM_{word}")]
        if named:
            print(f"note: FORMIGA_LLM_{named[0]} is set, and goes before it", file=sys.stderr)
        return
    _try(chosen)


def _try(chosen: "Choice") -> None:
    """Ask a small question, and tell how that went."""
    from formiga_bt.llm.client import open_chat
    from formiga_bt.llm.records import Message

    schema = {
        "type": "object",
        "properties": {"colour": {"enum": ["red", "green", "blue"]}, "number": {"type": "integer"}},
        "required": ["colour", "number"],
        "additionalProperties": False,
    }
    asked = [
        Message("system", 'You answer with JSON: {"colour": "red", "green" or "blue", "number": an integer}.'),
        Message("user", "What colour has the grass, and how many legs has a horse?"),
    ]
    chat = open_chat(chosen.provider, chosen.model, base_url=chosen.base_url, adapter=chosen.adapter)
    print(f"asking {chat.name} {chat.model}", flush=True)
    try:
        reply = chat.complete(asked, schema, max_tokens=2000)
    finally:
        chat.close()
    about = getattr(chat, "about", "")
    if about:
        print(about)
    usage = reply.usage
    cost = f", {usage.cost_usd:.6f} US dollars" if usage.cost_usd is not None else ""
    print(f"{' '.join(reply.text.split())}")
    tokens = f"{usage.prompt} tokens asked, {usage.completion} answered"
    print(f"{reply.seconds:.1f} s; {tokens}{cost}; held to the form by: {reply.rung}")
    if reply.finish == "length" or reply.data is None:
        print("formiga: that is no answer in the form that was asked for; drafts will fail", file=sys.stderr)
        raise typer.Exit(1)
