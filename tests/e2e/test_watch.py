"""`formiga watch` in a real terminal (tmux), against a running engine: narrow, wide, resized, no colour."""

import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.e2e.test_service import ASK, Shell, shell, wait_for_agents

__all__ = ["shell"]
pytestmark = [
    pytest.mark.network,
    pytest.mark.external,
    pytest.mark.skipif(shutil.which("tmux") is None, reason="no tmux (apt install tmux)"),
]

COLOUR = re.compile(r"\x1b\[(?:[0-9;]*;)?(?:3[0-8]|4[0-8]|9[0-7]|10[0-7])[;m]")
TOP = re.compile(r"^(NO ENGINE: [^|]* \| )?(ENGINE [A-Z]+ \| )?AIRBORNE \d+ \| NEEDS YOU \d+( \(\d+:\d\d\))? \|")


def age_s(text: str) -> int:
    """Return for how many seconds, of the engine's, the watch says that Q1 waits."""
    found = re.search(r"Q1 (\d+):(\d\d)", text)
    assert found is not None, text
    return int(found[1]) * 60 + int(found[2])


class Terminal:
    """A terminal of a person: tmux with one pane, in which the watch runs."""

    def __init__(self, folder: Path, socket: Path) -> None:
        self.folder, self.socket = folder, socket

    def tmux(self, *words: str) -> str:
        done = subprocess.run(
            ["tmux", "-S", str(self.socket), *words], capture_output=True, text=True, check=True, timeout=20
        )
        return done.stdout

    def open(self, *words: str, size: tuple[int, int], **environment: str) -> None:
        """Start `formiga watch` in a terminal of a size."""
        program = shlex.join([sys.executable, "-m", "formiga_bt", "watch", *words])
        named = [part for name, value in environment.items() for part in ("-e", f"{name}={value}")]
        width, height = (str(number) for number in size)
        self.tmux(
            "-f", "/dev/null", "new-session", "-d", "-x", width, "-y", height, "-c", str(self.folder), *named,
            "-e", "COLUMNS=81", "-e", "LINES=25",
            f"{program}; echo LEFT WITH $?; exec cat",
        )  # fmt: skip

    def close(self) -> None:
        subprocess.run(["tmux", "-S", str(self.socket), "kill-server"], capture_output=True, check=False)

    def keys(self, *keys: str) -> None:
        self.tmux("send-keys", *keys)

    def resize(self, width: int, height: int) -> None:
        self.tmux("resize-window", "-x", str(width), "-y", str(height))

    @property
    def text(self) -> str:
        return self.tmux("capture-pane", "-p")

    @property
    def coloured(self) -> str:
        return self.tmux("capture-pane", "-p", "-e")

    def wait(self, *words: str, within_s: float = 40.0) -> str:
        """Wait until the screen shows all of these, line breaks apart; return it."""
        return self.until(lambda text: all(word in " ".join(text.split()) for word in words), str(words), within_s)

    def until(self, is_met: Callable[[str], object], what: str, within_s: float = 40.0) -> str:
        end = time.monotonic() + within_s
        while not is_met(text := self.text):
            assert time.monotonic() < end, f"waited in vain: {what}\n{text}"
            time.sleep(0.1)
        return text


@pytest.fixture
def terminal(shell: Shell, tmp_path: Path) -> Iterator[Terminal]:
    assert "TMUX" not in os.environ or shell
    made = Terminal(shell.folder, tmp_path / "tmux")
    yield made
    made.close()


def test_a_person_watches_answers_stops_and_resizes(shell: Shell, terminal: Terminal) -> None:
    (shell.folder / "trees" / "ask.yaml").write_text(ASK, encoding="utf-8")
    shell.up("--sim", "--desk", "watcher_1", "--speed", "5")
    wait_for_agents(shell, 5)
    shell.run("run", "Ask")

    terminal.open(size=(60, 16))
    text = terminal.wait("NEEDS YOU 1", "Ask-1 asks watcher_1", "Is it good?", "1 yes_it_is 2 no_not_yet")
    assert TOP.match(text)
    assert COLOUR.search(terminal.coloured)
    terminal.keys("n")
    terminal.until(lambda now: age_s(now) >= age_s(text) + 10, "it is on the screen for two seconds")
    terminal.keys("1")
    terminal.wait("Q1 is answered: yes_it_is by watcher_1", "nothing needs you")

    shell.run("run", "Hello", "--param", "target=66.5050,25.7060")
    terminal.keys("Escape", "t")
    terminal.wait("Hello-2", "AIRBORNE 1")
    terminal.resize(200, 50)
    text = terminal.wait("TASKS", "AGENTS", "EVENTS", "Hello-2 ACTIVE")
    assert TOP.match(text)
    terminal.keys("Home", "Enter")
    terminal.wait("TREE", "drone.TakeOff", "hello.yaml:", "GOALS", "VALUES", "target")
    terminal.wait("✓ drone.TakeOff", "► drone.GoTo")
    terminal.keys("h")
    terminal.wait("hold Hello-2: hold is ordered for 1 machine", "hovers", "HELD 1", "ACTIVE HELD")
    terminal.keys("w")
    terminal.wait("was interrupted")
    terminal.resize(60, 16)
    text = terminal.until(lambda text: "WHY" in text and max(map(len, text.splitlines())) <= 60, "it is narrow again")
    assert TOP.match(text)
    terminal.keys("c")
    terminal.wait("Continue Hello-2", "y: yes")
    terminal.keys("y")
    terminal.wait("Hello-2 goes on")
    terminal.keys("A")
    terminal.wait("Abort Hello-2")
    terminal.keys("n")
    terminal.wait("nothing was done")
    assert shell.json("tasks")["tasks"][0]["ended_at"] is None
    terminal.keys("A", "y")
    terminal.wait("abort Hello-2: Hello-2 ends")
    terminal.keys("!")
    terminal.wait("! once more within 2 s")
    terminal.wait("lockdown: no second key came; nothing was done")
    terminal.keys("!", "!")
    terminal.until(lambda text: text.startswith("LOCKDOWN "), "the site is locked down")
    terminal.keys("U", "y")
    terminal.until(TOP.match, "it is released")
    terminal.keys("q")
    terminal.wait("LEFT WITH 0")
    shell.run("down", "--yes")
    shell.ended()


def test_no_colour_ascii_and_an_engine_that_goes_and_comes_back(shell: Shell, terminal: Terminal) -> None:
    (shell.folder / "trees" / "ask.yaml").write_text(ASK, encoding="utf-8")
    shell.up("--desk", "watcher_1")
    shell.run("run", "Ask")

    terminal.open("Ask-1", "--ascii", "--read-only", size=(100, 30), NO_COLOR="1")
    text = terminal.wait("NEEDS YOU 1", "Is it good?", "Ask-1 * ACTIVE", "> `- > ask watcher")
    assert TOP.match(text)
    assert text.isascii()
    assert not COLOUR.search(terminal.coloured)
    terminal.keys("h")
    terminal.wait("read only: orders are off")
    terminal.keys("Escape", "Escape")
    terminal.wait("TASKS", "AGENTS")

    shell.run("down", "--yes")
    shell.ended()
    text = terminal.wait("NO ENGINE: what you see is 0:0")
    assert TOP.match(text)
    assert "Ask-1" in text
    shell.up("--desk", "watcher_1")
    terminal.until(lambda text: text.startswith("AIRBORNE 0 | NEEDS YOU 1"), "it is back, with the task that it had")
    terminal.wait("Is it good?", "ACTIVE")
    terminal.keys("q")
    terminal.wait("LEFT WITH 0")
    shell.run("down")
    shell.ended()
