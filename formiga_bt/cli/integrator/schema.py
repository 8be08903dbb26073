"""`formiga schema`: the JSON Schema of the language with the live catalogue, for editors or for language models."""

import json
from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.inputs import UnusableFile, read_world, rendered


def command(
    editor: Annotated[
        bool, typer.Option("--editor", help="For yaml-language-server; all files of the language.")
    ] = False,
    llm: Annotated[bool, typer.Option("--llm", help="For constrained decoding: the JSON form of a task.")] = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="With --llm: every key required, null where there is nothing.")
    ] = False,
    site: Annotated[
        Path | None,
        typer.Option(
            help="Site whose catalogues and places are known. Default: site.yaml of this folder, if any.",
            metavar="FILE",
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write it there instead of printing it.", metavar="FILE")] = None,
    actions: ActionsOption = None,
) -> None:
    """Print the JSON Schema of the language, with the types and actions of the catalogue.

    Exit code 1: the catalogue or the site has errors. 2: the command line cannot be used.
    """
    if editor == llm or (strict and not llm):
        raise UnusableFile("say which: --editor, or --llm (--strict goes with --llm)")
    here = Path("site.yaml")
    world = read_world(actions or (), site or (here if here.is_file() else None))
    if any(problem.severity == "error" for problem in world.diagnostics):
        typer.echo("\n\n".join(rendered(world.diagnostics, world.sources)), err=True)
        raise typer.Exit(1)
    if editor:
        from formiga_bt.editor.schema import editor_schema

        schema = editor_schema(world.catalogue, world.site)
    else:
        from formiga_bt.editor.llm_schema import llm_schema

        schema = llm_schema(world.catalogue, strict=strict)
    text = json.dumps(schema, indent=2)
    if out is None:
        typer.echo(text)
        return
    try:
        out.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise UnusableFile(f"cannot write {out}: {error.strerror or error}") from error
    typer.echo(f"wrote {out}")
