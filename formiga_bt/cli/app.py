"""Reads the command line, loads the one verb that it names, and turns our errors into text and an exit code.

Called by `formiga_bt.cli.main`. Exit codes: 0 done; 1 the verb says no (a task has errors, a run failed); 2 the command
line or a file named in it cannot be used; 130 interrupted. A typer app is built per call with only the verb in use, so
that other verbs' imports cost nothing. typer itself is imported when it is needed: `check` and the orders that stop machines
mostly do without.
"""

import errno
import functools
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Any

from formiga_bt import __version__
from formiga_bt.base.errors import FormigaError, TreeError, UnusableFile
from formiga_bt.cli.verbs import Verb, verbs

if TYPE_CHECKING:
    import typer

SUMMARY = (
    "A task engine for teams of robots and people. Tasks are YAML behaviour trees, checked like a compiled language."
)
NOT_WRITTEN = frozenset({errno.ENOSPC, errno.EIO, errno.EPIPE, errno.EDQUOT, errno.EFBIG})
"""Errors of writing to stdout."""
HURRIED = frozenset({"hold", "return", "land", "continue", "lockdown"})
"""Verbs whose plain command lines are read by `hurry`, without typer."""
EXIT_NO, EXIT_USAGE, EXIT_INTERRUPTED = 1, 2, 130


def run(argv: Sequence[str]) -> int:
    """Carry out one command line and return its exit code.

    Args:
        argv: the arguments without the program's name.
    """
    try:
        code = _carry_out(argv)
        if sys.stdout is not None:  # who closes it wants to read nothing
            sys.stdout.flush()
    except OSError as error:
        if error.errno not in NOT_WRITTEN or error.filename is not None:
            raise
        with suppress(OSError, ValueError):  # or Python would try once more at its end, and complain
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if error.errno != errno.EPIPE:
            with suppress(OSError):
                print(f"formiga: cannot write what it has to say: {error.strerror}", file=sys.stderr)
        return EXIT_NO
    return code


def _carry_out(argv: Sequence[str]) -> int:
    first = argv[0] if argv else "--help"
    if first in HURRIED:
        from formiga_bt.cli.orders.hurry import quick as ordered

        try:
            code = ordered(first, argv[1:])
        except KeyboardInterrupt:
            return EXIT_INTERRUPTED
        if code is not None:
            return code
    known = verbs()
    if first in {"--version", "-V", "version"}:
        print(f"formiga {__version__}")
        return 0
    if first == "help":
        argv = [*argv[1:2], "--help"]
        first = argv[0]
    if not first.startswith("-") and first not in known:
        return _unknown(first, known)
    try:
        if first == "check":
            from formiga_bt.cli.author.checking import quick

            code = quick(argv[1:])
            if code is not None:
                return code
        app = _app(known, first)
        app(args=list(argv) or ["--help"], prog_name="formiga")
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(bool(end.code))
    return 0


def _app(known: dict[str, Verb], first: str) -> "typer.Typer":
    import typer

    app = typer.Typer(help=SUMMARY, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)

    @app.callback()
    def root(
        version: bool = typer.Option(False, "--version", "-V", help="Print the version and exit."),
    ) -> None: ...

    for verb in known.values():
        command: Callable[..., Any] = import_module(verb.path).command if verb.name == first else _not_loaded
        app.command(verb.name, help=None if verb.name == first else verb.help)(_guarded(command))
    return app


def _not_loaded() -> None:
    raise AssertionError("a verb that was not named was called")


def _unknown(word: str, known: dict[str, Verb]) -> int:
    from difflib import get_close_matches

    close = get_close_matches(word, known, n=1, cutoff=0.5)
    hint = f"; did you mean '{close[0]}'?" if close else ""
    print(f"formiga has no verb '{word}'{hint}\nVerbs: {', '.join(known)}. Help: formiga --help", file=sys.stderr)
    return EXIT_USAGE


def _guarded(command: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a verb so that an error of ours ends in a few words on stderr, never in a traceback."""
    import typer

    from formiga_bt.cli.inputs import rendered

    @functools.wraps(command)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            return command(*args, **kwargs)
        except UnusableFile as error:
            print(f"formiga: {error}", file=sys.stderr)
            raise typer.Exit(EXIT_USAGE) from error
        except TreeError as error:
            print("\n\n".join([*rendered(error.diagnostics), f"formiga: {error}"]), file=sys.stderr)
            raise typer.Exit(EXIT_NO) from error
        except FormigaError as error:
            print(f"formiga: {error}", file=sys.stderr)
            raise typer.Exit(EXIT_NO) from error
        except KeyboardInterrupt as error:
            raise typer.Exit(EXIT_INTERRUPTED) from error

    return call
