"""What verbs that talk to a running engine share for the command line library: their options, tables, and Ctrl-C."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import click
import typer

from formiga_bt.client import Client, connect

SiteOption = Annotated[
    Path | None,
    typer.Option(
        help="The site file of the engine to talk to. Default: the engine of this folder, or of one above it.",
        metavar="FILE",
    ),
]
UrlOption = Annotated[
    str,
    typer.Option(
        help="Address of the engine to talk to, for example http://10.0.0.5:8420; its token in FORMIGA_TOKEN.",
        metavar="URL",
    ),
]
TokenFileOption = Annotated[
    Path | None, typer.Option(help="File with the token for --url, instead of FORMIGA_TOKEN.", metavar="FILE")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")]


def lasted(seconds: float) -> str:
    """Return a length of time as people say it: `41 s`, `12 min`, `3.5 h`."""
    from formiga_bt.show.why.words import span

    return span(round(seconds * 1e6))


def tell_clock(client: Client) -> None:
    """Have a verb that shows times say at its end how far their clock is from the wall clock, if it is."""
    context = click.get_current_context(silent=True)
    if context is not None:
        context.call_on_close(lambda: _tell_clock(client.ahead_us))


def _tell_clock(ahead_us: int) -> None:
    from formiga_bt.show.offset import offset_words

    if words := offset_words(ahead_us):
        typer.echo(f"note: all times are engine time, {words}", err=True)


def print_table(rows: list[tuple[str, ...]]) -> None:
    """Print rows in columns; the first is the head."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        typer.echo("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())


@contextmanager
def interrupts() -> Iterator[list[int]]:
    """Collect Ctrl-C in a list instead of breaking off; the second one breaks off."""
    seen: list[int] = []

    def note(number: int, frame: Any) -> None:  # noqa: ARG001
        seen.append(number)
        if len(seen) > 1:
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, note)
    try:
        yield seen
    finally:
        signal.signal(signal.SIGINT, before)


def connect_source(site: Path | None = None, url: str = "", token_file: Path | None = None) -> Client:
    """Return a client as a source of pictures, which says at the verb's end how far the engine's clock is off; see `connect`.

    Raises:
        NoEngine: none runs.
        UnusableFile: the address or the token cannot be used.
    """
    client = connect(site, url, token_file)
    tell_clock(client)
    return client
