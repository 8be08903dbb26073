"""`formiga explain`: the page of a code of the checker, or what a reason code means."""

from typing import Annotated

import typer

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.lang.pages import CodePage, Reason, messages, pages, reasons, reasons_of


def command(
    code: Annotated[str, typer.Argument(help="A code of the checker (E030), or of a reason (no_clearance).")] = "",
    all_: Annotated[bool, typer.Option("--list", help="List all codes, a line each.")] = False,
) -> None:
    """Explain a code: what is wrong, why, an example wrong and right, all messages with what helps; or what a reason means.

    Exit code 2: there is no such code.
    """
    if all_:
        for page in pages().values():
            typer.echo(f"{page.code}  {page.wrong_is}")
        for reason in reasons():
            typer.echo(f"{', '.join(reason.codes)}  {reason.cells[0] if reason.cells else ''}")
        return
    if not code:
        raise UnusableFile("which code?", help="formiga explain E030, or formiga explain --list")
    found = pages().get(code.upper())
    if found is not None:
        typer.echo(_page(found))
        return
    meant = reasons_of(code)
    if not meant:
        from formiga_bt.lang.text.reading import did_you_mean

        known = [*pages(), *(one for reason in reasons() for one in reason.codes)]
        raise UnusableFile(f"there is no code '{code}'{did_you_mean(code, known)}", help="formiga explain --list")
    typer.echo("\n\n".join(map(_reason, meant)))


def _page(page: CodePage) -> str:
    body = page.text.replace("```yaml wrong", "Wrong:\n\n```yaml").replace("```yaml right", "\nRight:\n\n```yaml")
    lines = [f"{page.code}: {page.wrong_is}", *([f"help: {page.helps}"] if page.helps else []), ""]
    fenced = False
    for line in body.splitlines():
        if line.startswith("```"):
            fenced = not fenced
        else:
            lines.append(f"    {line}" if fenced and line else line)
    return "\n".join([*lines, *_messages(page.code)])


def _messages(code: str) -> list[str]:
    """Return the lines of all messages of a code."""
    lines = ["", f"Messages of {code}, each with what helps; names and numbers are those of examples."]
    where = ""
    for one in messages().get(code, ()):
        if one.where != where:
            lines += ["", f"{one.where}:", ""]
            where = one.where
        lines += [f"    {one.text}", *([f"        {one.helps}"] if one.helps else [])]
    return lines


def _reason(reason: Reason) -> str:
    head = f"{', '.join(reason.codes)}: {reason.cells[0] if reason.cells else ''}"
    more = [f"what to do: {reason.cells[1]}"] if len(reason.cells) > 1 else []
    return "\n".join([head, *more, f"({reason.group})"])
