"""`formiga why`: explain why a task waits, is held, chose its agents, or failed; or why a machine does what it does."""

from collections.abc import Sequence
from typing import Annotated

import typer

from formiga_bt.cli.options import JsonOption, SiteOption, TokenFileOption, UrlOption
from formiga_bt.cli.past import AtOption, JournalOption
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.client import Client
from formiga_bt.show.facts import Because, Explanation

OVER = ("ENDING", "SUCCEEDED", "FAILED", "CANCELED")
"""To these nothing is to be said any more."""
OPEN = ("PENDING", "ASSIGNED", "ACTIVE")


def command(
    task: Annotated[
        str, typer.Argument(help="A task's id, for example PickUp-12, an agent's, or rule:NAME.", metavar="ID")
    ],
    as_json: JsonOption = False,
    site: SiteOption = None,
    url: UrlOption = "",
    token_file: TokenFileOption = None,
    journal: JournalOption = "",
    at: AtOption = "",
) -> None:
    """Explain a task in plain words: what it waits for, who holds it, why these agents, why it failed.

    What explains a line stands below it. Of an agent: who has it, which order stands on it, what it waits for, its task.
    Example: formiga why hwd_1
    """
    from formiga_bt.cli.inputs import UnusableFile
    from formiga_bt.cli.past import is_past, source_of
    from formiga_bt.show.why import text

    if not task:
        raise UnusableFile("why what? The id is empty; formiga tasks and formiga agents list them")
    source = source_of(site, url, token_file, journal=journal, at=at)
    is_live = isinstance(source, Client) and not is_past(source)
    if as_json and isinstance(source, Client) and is_live:
        print_json(source.explanation(task))
        return
    headline, lines = source.why(task)
    if as_json:
        print_json(of_past(headline, lines))
        return
    told = text.in_words(headline, lines)
    typer.echo(told)
    if is_live:
        show_next(*suggestions(headline, lines), said=told)


def of_past(headline: str, lines: Sequence[Because]) -> Explanation:
    """Return an explanation of a moment that is past as the API has one of now."""
    of, _, status = headline.removesuffix(" HELD").partition(" ")
    held = ("held",) if headline.endswith(" HELD") else ()
    return Explanation(of=of, status=status, held=held, because=tuple(lines))


def suggestions(headline: str, lines: Sequence[Because]) -> list[str]:
    """Return what may come next: the first order that a line proposes, or else what fits how it stands.

    What is ending already is not to be aborted.
    """
    hints = [line.hint for line in lines if line.hint.startswith("formiga ")]
    of, _, status = headline.removesuffix(" HELD").partition(" ")
    if hints:
        return hints[:1]
    if status in OVER:
        return ["formiga tasks"]
    return [f"formiga abort {of}"] if status in OPEN else ["formiga agents"]
