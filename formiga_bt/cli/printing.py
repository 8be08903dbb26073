"""What verbs print besides facts: JSON, and what comes next. Nothing here imports the command line library."""

import json
import os
import pwd
import socket
import sys
from collections.abc import Iterable
from contextlib import suppress
from typing import Any, Final

MOST_NEXT: Final = 3
"""So many commands are suggested."""


def user() -> str:
    """Return who gives orders from this terminal."""
    name = os.environ.get("USER") or os.environ.get("LOGNAME") or ""
    if not name:
        with suppress(KeyError, OSError):  # a service or a container may have a number only
            name = pwd.getpwuid(os.getuid()).pw_name
    return f"{name}@{socket.gethostname()}" if name else "cli"


def show_next(*commands: str, said: str = "") -> None:
    """Suggest what comes next, each command once, and none that the answer has proposed already.

    Args:
        commands: what may come next, best first.
        said: the answer; what stands behind `->` in it is not said again.
    """
    fresh = following(commands, said)
    if fresh:
        print(f"next: {fresh}", file=sys.stderr)


def following(commands: Iterable[str], said: str = "") -> str:
    """Return some commands as one line; see `show_next`."""
    hints = [line.partition("-> ")[2] for line in said.splitlines() if line.lstrip().startswith("-> ")]
    known = {one for hint in hints for one in hint.split(" | ")}
    fresh = [one for one in dict.fromkeys(commands) if one not in known]
    return "    or: ".join(fresh[:MOST_NEXT]) + ("    ..." if len(fresh) > MOST_NEXT else "")


def print_json(value: Any) -> None:
    """Print facts, or what JSON holds, as JSON."""
    from msgspec import to_builtins

    print(json.dumps(to_builtins(value), indent=2, ensure_ascii=False))
