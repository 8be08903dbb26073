"""`formiga news`: the channels by which news leave the engine, and a test of one."""

from typing import Annotated

import typer

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.options import JsonOption, SiteOption, TokenFileOption, UrlOption, print_table
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.client import connect
from formiga_bt.show.facts import ChannelFact


def command(
    word: Annotated[str, typer.Argument(help="test: send one, and see what comes back.", metavar="[test]")] = "",
    channel: Annotated[str, typer.Argument(help="The channel, as site.yaml names it.", metavar="[CHANNEL]")] = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
    url: UrlOption = "",
    token_file: TokenFileOption = None,
) -> None:
    """List the channels of the site's news, and how each stands.

    formiga news test CHANNEL sends one message that only says that it comes, and tells what came back. Channels stand in
    site.yaml under news.
    """
    if (word or channel) and (word != "test" or not channel):
        raise UnusableFile("say formiga news, or formiga news test CHANNEL")
    client = connect(site, url, token_file)
    if word:
        tried = client.test_news(channel)
        if as_json:
            print_json(tried)
        else:
            typer.echo(
                f"{channel}: {'delivered' if tried.delivered else 'NOT delivered'}: {tried.text} ({tried.took_s:.2f} s)"
            )
        if not tried.delivered:
            raise typer.Exit(1)
        return
    found = client.news()
    if as_json:
        print_json(found)
        return
    if not found.channels:
        typer.echo("the site tells nobody elsewhere: news: in site.yaml names channels")
        return
    print_table([("CHANNEL", "WAY", "NEWS", "STATE", "SENT", "LAST"), *map(_row, found.channels)])
    failing = next((one for one in found.channels if one.state == "failing"), found.channels[0])
    show_next(f"formiga news test {failing.name}")


def _row(one: ChannelFact) -> tuple[str, ...]:
    over = f", {one.passed_over} passed over" if one.passed_over else ""
    return one.name, one.way, f"{', '.join(one.what)} from {one.severity} on", one.state, f"{one.sent}{over}", one.text
