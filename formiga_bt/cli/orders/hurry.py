"""The orders of a hurry, and their plain command lines read without the library that reads the others.

A person who stops machines should not wait for imports. `quick` understands the usual words of hold, return, land, continue and
lockdown by itself, and leaves the rest (`--help`, mistakes) to the verbs.
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from formiga_bt.base.errors import FormigaError, UnusableFile
from formiga_bt.cli.order_words import give_order, lock_down
from formiga_bt.client import connect

ORDERS: Final = ("hold", "return", "land", "continue")
LOCKDOWN: Final = "lockdown"
HOWS: Final = ("--hold", "--return", "--land")
EXIT_NO, EXIT_USAGE = 1, 2


def quick(verb: str, words: Sequence[str]) -> int | None:
    """Carry out a plain command line of one of these orders; None if its verb is to read it.

    Args:
        verb: one of `ORDERS`, or `LOCKDOWN`.
        words: what follows it.
    """
    by, site, plain, flags = "", None, [], set()
    rest = iter(words)
    for word in rest:
        name, is_joined, value = word.partition("=")
        if name in ("--by", "--site"):
            said = value if is_joined else next(rest, "")
            if not said or said.startswith("-"):
                return None
            by, site = (said, site) if name == "--by" else (by, Path(said))
        elif word.startswith("-"):
            flags.add(word)
        else:
            plain.append(word)
    as_json = "--json" in flags
    flags.discard("--json")
    try:
        if verb == LOCKDOWN:
            if plain == ["release"] and not flags:
                how = "release"
            elif not plain and len(flags) <= 1 and flags <= set(HOWS):
                how = next(iter(flags), "--return").removeprefix("--")
            else:
                return None
            return lock_down(connect(site), how, by=by, as_json=as_json)
        if not flags <= {"--all"} or len(plain) + len(flags) != 1 or not all(plain):
            return None
        target = plain[0] if plain else ""
        return give_order(connect(site), verb, target, everything=bool(flags), by=by, as_json=as_json)
    except FormigaError as error:
        print(f"formiga: {error}", file=sys.stderr)
        return EXIT_USAGE if isinstance(error, UnusableFile) else EXIT_NO
