"""Faults that need more than an ordinary user: a disk of its own (mount), a network of its own (namespaces)."""

import os
import shutil
import subprocess
import time
from pathlib import Path
from typing import Final

PRIVILEGES: Final = ("mount", "netns")


def available() -> frozenset[str]:
    """Return which of `PRIVILEGES` this user and machine have."""
    found = set()
    if os.geteuid() == 0:
        if _works("unshare", "-m", "sh", "-c", "mount -t tmpfs tmpfs /mnt"):
            found.add("mount")
        if (
            shutil.which("ip")
            and shutil.which("nsenter")
            and _works("unshare", "-n", "ip", "link", "add", "name", "tva", "type", "veth", "peer", "name", "tvb")
        ):
            found.add("netns")
    return frozenset(found)


def _works(*words: str) -> bool:
    return subprocess.run(words, capture_output=True, check=False).returncode == 0


def _do(*words: str) -> None:
    subprocess.run(words, check=True, capture_output=True)


class Disk:
    """A small file system of its own for the runtime folder of a site, which may be full, or read-only at a start."""

    def __init__(self, folder: Path, megabytes: int = 64) -> None:
        self._at = folder / ".formiga"
        self._at.mkdir(parents=True, exist_ok=True)
        _do("mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", str(self._at))

    def read_only(self, on: bool) -> None:
        """Take writing away, or give it back; nobody may have a file open to write."""
        for _ in range(20):
            ran = subprocess.run(
                ["mount", "-o", f"remount,{'ro' if on else 'rw'}", str(self._at)], capture_output=True, check=False
            )
            if not ran.returncode:
                return
            time.sleep(0.1)

    def fill(self) -> None:
        """Take all room."""
        subprocess.run(["dd", "if=/dev/zero", f"of={self._at}/filling", "bs=64k"], capture_output=True, check=False)

    def free(self) -> None:
        """Give the room back; for that it must be writable, whatever else was broken meanwhile."""
        self.read_only(False)
        (self._at / "filling").unlink(missing_ok=True)

    def close(self) -> None:
        """Keep what is on it, and take it away."""
        kept = self._at.with_name("kept")
        shutil.rmtree(kept, ignore_errors=True)
        self.free()
        shutil.copytree(self._at, kept, symlinks=True, ignore=_sockets)
        _do("umount", "-l", str(self._at))
        shutil.rmtree(self._at, ignore_errors=True)
        kept.rename(self._at)


def _sockets(folder: str, names: list[str]) -> list[str]:
    """The local door of an engine cannot be copied."""
    return [name for name in names if (Path(folder) / name).is_socket()]


class Net:
    """A network of its own for the agents, joined to the engine's by a wire that can be cut."""

    _made = 0

    def __init__(self) -> None:
        self._number = (os.getpid() * 7 + Net._made * 31) % 60_000 % 250
        Net._made += 1
        self._name = f"tort{os.getpid()}x{Net._made}"[:14]
        self._near, self._far = f"ta{os.getpid() % 100000}x{Net._made}", f"tb{os.getpid() % 100000}x{Net._made}"
        near, far = f"10.231.{self._number}.1", f"10.231.{self._number}.2"
        _do("ip", "netns", "add", self._name)
        _do("ip", "link", "add", "name", self._near, "type", "veth", "peer", "name", self._far, "netns", self._name)
        _do("ip", "addr", "add", f"{near}/24", "dev", self._near)
        _do("ip", "link", "set", self._near, "up")
        for words in (
            ("addr", "add", f"{far}/24", "dev", self._far),
            ("link", "set", self._far, "up"),
            ("link", "set", "lo", "up"),
        ):
            _do("ip", "-n", self._name, *words)
        self.endpoint = f"tcp/{near}:{17_000 + self._number}"
        self.prefix = ("nsenter", f"--net=/var/run/netns/{self._name}")

    def cut(self, on: bool) -> None:
        """Cut the wire, or join it again."""
        _do("ip", "link", "set", self._near, "down" if on else "up")

    def close(self) -> None:
        """Take it away."""
        subprocess.run(["ip", "link", "del", self._near], capture_output=True, check=False)
        subprocess.run(["ip", "netns", "del", self._name], capture_output=True, check=False)
