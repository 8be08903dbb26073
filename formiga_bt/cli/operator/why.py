"""`formiga why`: explain why a task waits, is held, chose its agents, or failed; or why a machine does what it does."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from formiga_bt.cli.client import JsonOption, SiteOption, TokenFileOption, UrlOption, print_json, segment, show_next
from formiga_bt.cli.past import AtOption, JournalOption

if TYPE_CHECKING:
    from formiga_bt.cli.calling import Client
    from formiga_bt.show.facts import Because

OVER = ("ENDING", "SUCCEEDED", "FAILED", "CANCELED")
"""To these nothing is to be said any more."""
OPEN = ("PENDING", "ASSIGNED", "ACTIVE")


def command(
    task: Annotated[str, typer.Argument(help="A task's id, for example PickUp-12, or an agent's.", metavar="ID")],
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
    from formiga_bt.cli.remote import RemoteSource
    from formiga_bt.show.why import text

    if not task:
        raise UnusableFile("why what? The id is empty; formiga tasks and formiga agents list them")
    source = source_of(site, url, token_file, journal=journal, at=at)
    is_live = isinstance(source, RemoteSource) and not is_past(source)
    if as_json and isinstance(source, RemoteSource) and is_live:
        print_json(_as_json(source.client, task))
        return
    headline, lines = source.why(task)
    if as_json:
        print_json(as_values(headline, lines))
        return
    told = text.in_words(headline, lines)
    typer.echo(told)
    if is_live:
        show_next(*suggestions(headline, lines), said=told)


def in_words(found: dict[str, Any]) -> str:
    """Return an answer of the API as people read it."""
    from formiga_bt.show.facts import Because
    from formiga_bt.show.why import text

    held = " HELD" if found["held"] else ""
    return text.in_words(f"{found['task']} {found['status']}{held}", [Because(**line) for line in found["because"]])


def as_values(headline: str, lines: "Sequence[Because]") -> dict[str, Any]:
    """Return an explanation as the API answers it."""
    import msgspec

    of, _, status = headline.removesuffix(" HELD").partition(" ")
    because = [{name: getattr(line, name) for name in line.__struct_fields__} for line in lines]
    held = ["held"] if headline.endswith(" HELD") else []
    return dict(msgspec.to_builtins({"task": of, "status": status, "held": held, "because": because}))


def _as_json(client: "Client", of: str) -> object:
    from formiga_bt.cli.calling import ApiError

    try:
        return client.get(f"/v1/tasks/{segment(of)}/why")
    except ApiError as unknown:
        if unknown.code != "unknown_task":
            raise
        try:
            return client.get(f"/v1/agents/{segment(of)}/why")
        except ApiError as error:
            raise unknown from error


def suggestions(headline: str, lines: "Sequence[Because]") -> list[str]:
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
