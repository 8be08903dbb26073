"""What `formiga check` costs as a whole process, beside `python -c pass` and beside importing PyYAML alone; for a file of 2,000
steps too. And what evaluating a compiled condition costs.

Wall time is what an author waits; processor time hardly depends on what else the machine does.

python benchmarks/bench_check.py [--rounds N]
"""

import argparse
import os
import statistics
import subprocess
import sys
import time
import timeit
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place, Position
from formiga_bt.base.packaged import folder
from formiga_bt.lang.expressions import Scope, compile_cond
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.types import INT, AgentRef, Type

STEPS = 2_000
CONDITIONS = ("drone.battery > 30 %", "n < 3 and not drone.airborne", "distance(ground(drone.position), base) < 100 m")


def big_file(folder_: Path) -> Path:
    """Write a task of 2,000 steps of the usual kinds."""
    rows = [
        f"""  - do: drone.GoTo
    with:
      to: ${{above(offset(target, east={number} m), 60 m)}}
  - ask: Question {number}?
    of: [watcher]
    timeout: 10 min
    expect: result.answer == 'yes'
  - notify: Here is {number}
    when: drone.battery > 30 %
  - check: drone.battery > 20 %
"""
        for number in range((STEPS - 2) // 4)
    ]
    head = "formiga: 1\ntask: Big\nimports: [lib/flying.yaml]\nparams:\n  target: place\n"
    head += "agents:\n  drone: {type: lwd}\n  watcher: {type: watcher}\nsteps:\n  - do: drone.TakeOff\n"
    path = folder_ / "big.yaml"
    path.write_text(head + "".join(rows) + "  - call: ReturnHome\n    with:\n      drone: ${drone}\n")
    return path


class _Env:
    """A blackboard with one drone."""

    def name(self, name: str) -> Any:
        return {"drone": AgentRef("lwd_1"), "n": 2, "base": Place(0.0, 0.0)}[name]

    def agent_field(self, agent: AgentRef, name: str) -> Any:  # noqa: ARG002
        return {"battery": 60.0, "airborne": True, "position": Position(3.0, 4.0, 60.0)}[name]


def condition_us(source: str, times: int = 200_000) -> float:
    """Return the time of one evaluation in microseconds, the best of five."""
    scope = Scope({"drone": Type("agent", of=("lwd",)), "n": INT})
    expr, found = compile_cond(Scalar(source, Mark("bench", 1, 1)), scope)
    assert not found, found
    env: Any = _Env()
    return min(timeit.repeat(lambda: expr.run(env), number=times, repeat=5)) / times * 1e6


COMMANDS = {
    "python -c pass": ["-c", "pass"],
    "python -c 'import yaml'": ["-c", "import yaml"],
    "formiga check pick_up.yaml": ["-m", "formiga_bt", "check", str(folder("trees") / "pick_up.yaml")],
}


def cost_ms(words: list[str]) -> tuple[float, float]:
    """Return the wall time and the processor time of one process in milliseconds."""
    start, before = time.perf_counter(), os.times()
    subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
    wall, after = time.perf_counter() - start, os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return wall * 1e3, used * 1e3


def main() -> None:
    """Measure in turn, print medians and the ratio to an empty interpreter."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    with TemporaryDirectory() as folder_:
        commands = {
            **COMMANDS,
            "formiga check, 2000 steps": ["-m", "formiga_bt", "check", str(big_file(Path(folder_)))],
        }
        found: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
        for _ in range(rounds):
            for name, words in commands.items():
                found[name].append(cost_ms(words))
    empty = statistics.median(wall for wall, _ in found["python -c pass"])
    for name, times in found.items():
        wall, used = (statistics.median(column) for column in zip(*times, strict=True))
        print(f"{name:32} {wall:7.0f} ms  {wall / empty:5.1f} x an empty interpreter  {used:7.0f} ms of processor time")
    for source in CONDITIONS:
        print(f"{source:50} {condition_us(source):6.2f} us")


if __name__ == "__main__":
    main()
