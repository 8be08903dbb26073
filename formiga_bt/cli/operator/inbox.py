"""`formiga inbox`: the questions that wait for a person."""

from typing import Annotated

import typer

from formiga_bt.base.clock import Micros
from formiga_bt.cli.options import JsonOption, SiteOption, TokenFileOption, UrlOption, tell_clock
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.client import connect
from formiga_bt.show.facts import QuestionFact
from formiga_bt.show.why.unanswered import then
from formiga_bt.show.why.words import span


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
    found = client.questions(person)
    if as_json:
        print_json(found)
        return
    if not found.questions:
        typer.echo("nobody is asked anything now")
        show_next("formiga tasks")
        return
    for question in found.questions:
        typer.echo(in_words(question, found.at))
    mine = [q for q in found.questions if q.here] or found.questions
    show_next(answer_command(mine[0], "|".join(mine[0].options)))


def answer_command(question: QuestionFact, option: str) -> str:
    """Return the command that answers a question; it says who answers where several people here are asked."""
    by = f" --by {question.here[0]}" if len(question.here) > 1 else ""
    form = "".join(f" -f {one.name}={'|'.join(one.values) or one.type.upper()}" for one in question.form)
    return f"formiga answer {question.number} {option}{by}{form}"


def in_words(question: QuestionFact, now: Micros) -> str:
    """Return a question as people read it."""
    lines = [f"{question.number}  {question.text}"]
    lines.append(f"    options: {', '.join(question.options)}" + (f"   ({question.note})" if question.note else ""))
    lines += [f"    fill in: {one.told}" + (f"   {one.help}" if one.help else "") for one in question.form]
    who = ", ".join(question.asked) or "nobody"
    here = "" if question.here else ", with their own apps"
    after = then(question.kind, question.if_no_answer)
    end = "" if question.lapses_at is None else f"; lapses in {span(max(0, question.lapses_at - now))}{after}"
    lines.append(f"    asked: {who}{here}; for {question.task}, since {span(now - question.asked_at)}{end}")
    lines += [f"    file: {one.name} ({one.media_type}), by {one.agent}" for one in question.files]
    if question.files:
        lines.append(f"    fetch them: formiga files {question.task} --save FOLDER")
    return "\n".join(lines)
