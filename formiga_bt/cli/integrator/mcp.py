"""`formiga mcp`: the server that an assistant starts and speaks with over stdin and stdout."""

import time
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from formiga_bt.base.extras import install
from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.inputs import UnusableFile, added_catalogues, is_demo, readable
from formiga_bt.cli.options import TokenFileOption, UrlOption
from formiga_bt.cli.printing import user

if TYPE_CHECKING:
    from formiga_bt.show.source import Source


def command(
    site: Annotated[
        Path | None,
        typer.Option(
            help="Site file. Default: site.yaml of this folder, else the demo site that ships with formiga.",
            metavar="FILE",
        ),
    ] = None,
    actions: ActionsOption = None,
    by: Annotated[str, typer.Option(help="For whom the assistant works. Default: you.", metavar="NAME")] = "",
    url: UrlOption = "",
    token_file: TokenFileOption = None,
) -> None:
    """Serve an assistant over the Model Context Protocol: look, check, dry-run, propose. Set-up: docs/mcp.md.

    An assistant starts it, and ends it by closing stdin. Nothing that an assistant does moves a machine: what it proposes waits
    for a person. Exit code 2: a file cannot be read, or the extra is not installed.
    """
    if find_spec("mcp") is None:
        raise UnusableFile("the server for assistants needs a package more", help=f"{install('mcp')}")
    here = Path("site.yaml")
    named = site if site is not None else here if here.is_file() else None
    file = None if named is None or is_demo(named) else str(readable(named).resolve())
    from formiga_bt.llm.mcp.ground import ServerFiles, ground_of
    from formiga_bt.llm.mcp.server import serve

    where = ServerFiles(file, tuple(str(path.resolve()) for path in added_catalogues(actions or ())))
    ground_of(where)

    def engine() -> "Source":
        from formiga_bt.cli.options import connect_source

        return connect_source(None if url or file is None else Path(file), url, token_file)

    serve(where, engine, lambda: time.time_ns() // 1_000_000, [by or user(), user()])
