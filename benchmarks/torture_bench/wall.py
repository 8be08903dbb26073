"""The wall clock of an engine's process, which may jump; clocks that never go back stay as they are.

Python runs `sitecustomize` of the first folder of its path before anything else. Ours puts another wall clock in place of
`time.time`, `time.time_ns` and `time.clock_gettime*` of `CLOCK_REALTIME`, the only ones that the engine reads. A library
such as libfaketime reaches further down, but `time.sleep` fails under the version that Debian has (0.9.10).
"""

import os
from pathlib import Path
from typing import Final

PUT_IN: Final = """
import os, time
file, real = os.environ["TORTURE_WALL"], (time.time_ns, time.clock_gettime_ns)
def offset():
    try:
        return int(open(file).read()) * 1_000_000_000
    except (OSError, ValueError):
        return 0
def clock_gettime_ns(clock):
    return real[1](clock) + (offset() if clock == time.CLOCK_REALTIME else 0)
time.time_ns = lambda: real[0]() + offset()
time.time = lambda: time.time_ns() / 1e9
time.clock_gettime_ns = clock_gettime_ns
time.clock_gettime = lambda clock: clock_gettime_ns(clock) / 1e9
"""


class Wall:
    """The wall clock of the engines of a site.

    Args:
        folder: of its own; it is made.
    """

    def __init__(self, folder: Path) -> None:
        self._file, self._offset_s = folder / "offset", 0
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "sitecustomize.py").write_text(PUT_IN, encoding="utf-8")
        self._write()

    def environment(self) -> dict[str, str]:
        """Return the environment of a process that lives by it."""
        path = [str(self._file.parent), *os.environ.get("PYTHONPATH", "").split(":")]
        return {"PYTHONPATH": ":".join(filter(None, path)), "TORTURE_WALL": str(self._file)}

    def jump(self, seconds: int) -> None:
        """Let it jump."""
        self._offset_s += seconds
        self._write()

    def _write(self) -> None:
        new = self._file.with_name("offset.new")
        new.write_text(f"{self._offset_s}\n", encoding="utf-8")
        new.replace(self._file)
