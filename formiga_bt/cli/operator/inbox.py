"""`formiga inbox`: the questions that wait for a person."""

from typing import Annotated, Any

import typer

from formiga_bt.cli.client import (
    JsonOption,
    SiteOption,
    TokenFileOption,
    UrlOption,
    connect,
    lasted,
    print_json,
    show_next,
    tell_clock,
)
from formiga_bt.show.why.unanswered import then


def command(
    person: Annotated[str, typer.Option("--of", help="Only what this person is asked.", metavar="PERSON")] = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
    url: UrlOption = "",
    token_file: TokenFileOption = None,
) -> None:
    """List open questions, oldest first, with their options and who may answer."""
    client = connect(site, url, token_file)
    tell_clock(client)
    found = client.get("/v1/inbox", person=person)
    if as_json:
        print_json(found)
        return
    if not found["questions"]:
        typer.echo("nobody is asked anything now")
        show_next("formiga tasks")
        return
    for question in found["questions"]:
        typer.echo(in_words(question))
    mine = [q for q in found["questions"] if q["here"]] or found["questions"]
    show_next(answer_command(mine[0], "|".join(mine[0]["options"])))


def answer_command(question: dict[str, Any], option: str) -> str:
    """Return the command that answers a question; it says who answers where several people here are asked."""
    waiting = [person for person in question["here"] if person not in question["answers"]]
    by = f" --by {waiting[0]}" if len(waiting) > 1 else ""
    return f"formiga answer {question['number']} {option}{by}"


def in_words(question: dict[str, Any]) -> str:
    """Return a question as people read it."""
    lines = [f"{question['number']}  {question['text']}"]
    lines.append(
        f"    options: {', '.join(question['options'])}" + (f"   ({question['note']})" if question["note"] else "")
    )
    who = ", ".join(question["asked"]) or "nobody"
    here = "" if question["here"] else ", with their own apps"
    lapses = question["lapses_in_s"]
    after = then(question["kind"], question["if_no_answer"])
    end = "" if lapses is None else f"; lapses in {lasted(lapses)}{after}"
    lines.append(f"    asked: {who}{here}; for {question['task']}, since {lasted(question['waiting_s'])}{end}")
    return "\n".join(lines)
