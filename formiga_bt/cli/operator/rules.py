"""`formiga rules`: the standing rules of a site, and a person's word on what waits for them."""

from typing import Annotated

import typer

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.options import JsonOption, SiteOption, TokenFileOption, UrlOption, print_table, tell_clock
from formiga_bt.cli.printing import print_json, show_next, user
from formiga_bt.client import connect
from formiga_bt.show.facts import RuleFact, RuleList
from formiga_bt.show.why.words import span


def command(
    word: Annotated[str, typer.Argument(help="start or dismiss: your word on what waits.", metavar="[WORD]")] = "",
    rule: Annotated[str, typer.Argument(help="The rule, for example sos.", metavar="[RULE]")] = "",
    agent: Annotated[str, typer.Option(help="To whom it happened, if several wait.", metavar="AGENT")] = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
    url: UrlOption = "",
    token_file: TokenFileOption = None,
) -> None:
    """List the standing rules of the site: what each is on, what it requests, what runs, and what waits for a person.

    What happens in lockdown, or cannot start, waits: formiga rules start RULE requests its task now, formiga rules dismiss
    RULE does not. Example: formiga rules start sos --agent picker_1
    """
    if (word or rule) and (word not in ("start", "dismiss") or not rule):
        raise UnusableFile("say formiga rules, formiga rules start RULE, or formiga rules dismiss RULE")
    client = connect(site, url, token_file)
    tell_clock(client)
    if word:
        said = client.rule_word(rule, word, agent=agent, by=user())
        if as_json:
            print_json({"text": said})
            return
        typer.echo(said)
        show_next(f"formiga why rule:{rule}")
        return
    found = client.rules()
    if as_json:
        print_json(found)
        return
    if not found.rules:
        typer.echo("the site has no standing rules: rules: in site.yaml, or files in rules/ beside it")
        return
    print_table([("RULE", "ON", "REQUESTS", "HAPPENED", "RUNNING", ""), *(_row(one, found) for one in found.rules)])
    waiting = next((one for one in found.rules if one.waits), None)
    unapproved = ["formiga approve rules --by NAME"] if not all(one.approved for one in found.rules) else []
    show_next(*unapproved, f"formiga why rule:{(waiting or found.rules[0]).name}")


def _row(one: RuleFact, found: RuleList) -> tuple[str, ...]:
    after = f" for {span(one.after_us)}" if one.after_us else ""
    of = f" of {', '.join(one.of)}" if one.of else ""
    waits = [f"{wait.agent} {wait.what} {span(found.at - wait.at)} ago waits: {wait.code}" for wait in one.waits]
    notes = "; ".join([*([] if one.approved else ["not approved"]), *waits])
    return one.name, f"{one.on}{after}{of}", one.task, str(one.fired), " ".join(one.running), notes
