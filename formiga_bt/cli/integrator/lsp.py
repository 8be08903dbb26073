"""`formiga lsp`: the language server, which an editor starts and speaks with over stdin and stdout."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.base.extras import install
from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.inputs import UnusableFile, readable, site_file


def command(
    site: Annotated[
        Path | None,
        typer.Option(help="Site file; without it, a site.yaml beside or above each task.", metavar="FILE"),
    ] = None,
    actions: ActionsOption = None,
    stdio: Annotated[bool, typer.Option("--stdio", help="Over stdin and stdout, as always.")] = False,
) -> None:
    """Serve an editor: problems as you type, completion, hover, definitions, rename. Set-up: docs/editors.md.

    Exit code 2: a file cannot be read, or the extra is not installed.
    """
    del stdio
    if find_spec("pygls") is None:
        raise UnusableFile("the language server needs a package more", help=f"{install('lsp')}")
    files = [readable(path) for path in actions or ()]
    the_site = readable(site_file(site)) if site is not None else None
    from formiga_bt.editor.server import serve

    serve(files, the_site)
