"""A person at a terminal: runs a command on a pseudo terminal, reads what it shows, and types."""

import os
import pty
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path


def at_terminal(
    folder: Path, *words: str, until: str, types: Callable[[str], str], then: Sequence[tuple[str, str]] = ()
) -> tuple[int, str]:
    """Run `formiga` with these words; once it shows `until`, type a line. Return its exit code and all that it showed.

    Args:
        folder: where it runs.
        words: of the command line.
        until: a pattern; when it is seen, the line is typed.
        types: makes the line of what is seen so far.
        then: more patterns, each looked for in what comes after the line before, and the line to type.
    """
    leader, follower = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "formiga_bt", *words], cwd=folder, stdin=follower, stdout=follower, stderr=follower,
        env={**os.environ, "TERM": "dumb", "COLUMNS": "200"}, close_fds=True,
        start_new_session=True,  # what asks for a secret must not find the terminal of who runs the tests
    )  # fmt: skip
    os.close(follower)
    shown, typed = "", 0
    lines = [(until, types), *((pattern, lambda _, line=line: line) for pattern, line in then)]
    try:
        while True:
            try:
                part = os.read(leader, 4096)
            except OSError:  # the other end is closed
                break
            if not part:
                break
            shown += part.decode().replace("\r\n", "\n")
            if lines and re.search(lines[0][0], shown[typed:]):
                _, line = lines.pop(0)
                typed = len(shown)
                os.write(leader, line(shown).encode() + b"\n")
        return process.wait(30), shown
    finally:
        os.close(leader)
        if process.poll() is None:
            process.kill()
            process.wait()
