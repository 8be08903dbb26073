"""The table of checks of `formiga doctor`. Adding a check is adding a row: a name, what it looks at, and the function."""

from typing import Final

from formiga_bt.cli.operator.checkup import engine, files, kept, machine, news, secured
from formiga_bt.cli.operator.checkup.finding import Check

CHECKS: Final = (
    Check("site", "the site file, its catalogues, and what a site in mode real needs", files.site),
    Check("tasks", "the task files beside the site", files.tasks),
    Check("files", "the files of the runtime folder: they can be used, and are their owner's alone", files.private),
    Check("keys", "keys of the engine, the router and the agents", secured.keys),
    Check("news", "channels of the news: their packages and their secrets", news.channels),
    Check("python", "versions of Python and of the libraries", machine.versions),
    Check("clock", "this machine's clock, and the engine's", machine.clock),
    Check("disk", "room on the disks, and how long they take to keep something", machine.disks),
    Check("journal", "the journal: it can be read, and whose start wrote it last", kept.journal),
    Check("ports", "ports of the API and of the agents' wire", engine.ports),
    Check(
        "engine",
        "the engine, if it runs",
        engine.health,
        "its process may stand still (Ctrl-Z, a debugger): look at it; kill -CONT PID lets it go on",
    ),
)
"""In the order in which they are told."""
