"""`formiga alarms`: what a person must act on, and the word that somebody takes care of it."""

from typing import Annotated

import typer

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.options import JsonOption, SiteOption, TokenFileOption, UrlOption, print_table, tell_clock
from formiga_bt.cli.printing import print_json, show_next, user
from formiga_bt.client import connect
from formiga_bt.show.facts import AlarmFact, AlarmList
from formiga_bt.show.why.words import span


def command(
    word: Annotated[str, typer.Argument(help="ack: you take care of it.", metavar="[ack]")] = "",
    alarm: Annotated[str, typer.Argument(help="The alarm, for example A7.", metavar="[ALARM]")] = "",
    note: Annotated[str, typer.Option(help="What you say of it.", metavar="TEXT")] = "",
    everything: Annotated[bool, typer.Option("--all", help="Also the newest that are cleared.")] = False,
    as_json: JsonOption = False,
    site: SiteOption = None,
    url: UrlOption = "",
    token_file: TokenFileOption = None,
) -> None:
    """List the alarms that are open: those first that nobody acknowledged.

    formiga alarms ack A7 says that you take care of it: it is yours, and its news go to nobody else. It is cleared when
    what is wrong is over, or at once where nothing lasts.
    """
    if (word or alarm) and (word != "ack" or not alarm):
        raise UnusableFile("say formiga alarms, or formiga alarms ack ALARM")
    client = connect(site, url, token_file)
    tell_clock(client)
    if word:
        said = client.acknowledge(alarm, by=user(), note=note)
        if as_json:
            print_json({"text": said})
            return
        typer.echo(said)
        show_next("formiga alarms")
        return
    found = client.alarms(cleared=everything)
    if as_json:
        print_json(found)
        return
    if not found.alarms:
        typer.echo("no alarm is open")
        return
    print_table([("ALARM", "", "STATE", "OF", "SINCE", "WHAT"), *(_row(one, found) for one in found.alarms)])
    raised = next((one for one in found.alarms if one.state == "raised"), None)
    show_next(*([f"formiga alarms ack {raised.id}"] if raised is not None else []))


def _row(one: AlarmFact, found: AlarmList) -> tuple[str, ...]:
    owner = f" by {one.owner}" if one.owner else ""
    note = next((f" ({turn.note})" for turn in reversed(one.history) if turn.note), "")
    times = f", {one.times} times" if one.times > 1 else ""
    of = " ".join(part for part in (one.agent, one.task, one.about) if part)
    what = f"{one.text} ({one.code}){note}"
    return one.id, one.severity, f"{one.state}{owner}", of, f"{span(found.at - one.raised_at)}{times}", what
