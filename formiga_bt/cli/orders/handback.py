"""`formiga handback`: give a machine back to the engine that a pilot had taken over."""

from typing import Annotated

import typer

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.options import JsonOption, SiteOption
from formiga_bt.cli.ordering import ByOption, tell
from formiga_bt.cli.printing import user
from formiga_bt.client import connect


def command(
    agent: Annotated[str, typer.Argument(help="The machine, for example hwd_1.", metavar="AGENT")],
    continue_: Annotated[bool, typer.Option("--continue", help="Its interrupted step is sent again.")] = False,
    return_: Annotated[bool, typer.Option("--return", help="It flies to its port; its task stays HELD.")] = False,
    end: Annotated[bool, typer.Option("--end", help="Its interrupted step fails (taken_over).")] = False,
    by: ByOption = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Give a machine back to the engine, once its pilot has given it back, and say what becomes of its task.

    Until then the engine sends it nothing, whatever it reports. Example: formiga handback hwd_1 --continue
    """
    chosen = [how for how, given in (("continue", continue_), ("return", return_), ("end", end)) if given]
    if len(chosen) != 1:
        raise UnusableFile(f"say what becomes of its task: formiga handback {agent} --continue, --return or --end")
    tell(connect(site).hand_back(agent, chosen[0], by=by or user()), as_json=as_json)
