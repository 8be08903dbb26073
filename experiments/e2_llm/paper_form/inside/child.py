"""The child process: takes a program on its standard input, goes to jail, runs it, and asks the fleet by lines of JSON."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[4]))

import encodings.idna  # noqa: F401  (nothing can be imported later)
import json
import math
import threading
from typing import Any

from experiments.e2_llm.paper_form.inside import api, jail, turns
from experiments.e2_llm.paper_form.inside.names import MODULES, TURN, compiled, plain_builtins, problems


class ToldError(Exception):
    """The fleet says that something cannot be."""


class Program:
    """One program, and its talk with the fleet."""

    def __init__(self, code: str) -> None:
        self._code = code
        self._done: dict[str, dict[str, Any]] = {}
        self._turns = turns.Turns(self._advance)
        self._modules: dict[str, Any] = {
            "math": math,
            "time": turns.fake_time(self._turns),
            "threading": turns.fake_threading(self._turns),
        }

    def run(self) -> tuple[str, str]:
        """Run it; return how it ended, and why."""
        found = problems(self._code)
        if found:
            return "refused", "; ".join(found[:5])
        try:
            exec(compiled(self._code), self._names())
            self._turns.finish()
        except BaseException as error:  # noqa: BLE001
            return "error", _told(error)
        if self._turns.errors:
            return "error", f"in a thread: {_told(self._turns.errors[0])}"
        return "done", ""

    def _names(self) -> dict[str, Any]:
        kept = {
            **plain_builtins(),
            "print": lambda *_, **__: None,
            "getattr": lambda value, name, *rest: getattr(value, _open_name(name), *rest),
            "hasattr": lambda value, name: hasattr(value, _open_name(name)),
            "__import__": self._import,
        }
        given = api.names(self._ask, self._turns, self._done)
        return {"__builtins__": kept, "__name__": "__main__", TURN: self._turns.turn, **self._modules, **given}

    def _import(self, name: str, *_: Any) -> Any:
        if name not in MODULES:
            raise ImportError(f"there is no module {name}")
        return self._modules[name]

    def _ask(self, question: dict[str, Any]) -> dict[str, Any]:
        tell(question)
        said = hear()
        if "error" in said:
            raise ToldError(said["error"])
        return said

    def _advance(self, until_s: float | None) -> float:
        said = self._ask({"do": "wait", "until_s": until_s})
        self._done.update(said["done"])
        return float(said["now_s"])


def _open_name(name: str) -> str:
    if type(name) is not str or name.startswith("__"):
        raise AttributeError("names with __ are not for tasks")
    return name


def _told(error: BaseException) -> str:
    line, trace = 0, error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == "<task>":
            line = trace.tb_lineno
        trace = trace.tb_next
    return f"line {line}: {type(error).__name__}: {error}"[:300]


def tell(value: dict[str, Any]) -> None:
    """Say a line."""
    sys.stdout.buffer.write(json.dumps(value).encode() + b"\n")
    sys.stdout.buffer.flush()


def hear() -> dict[str, Any]:
    """Hear a line."""
    found: dict[str, Any] = json.loads(sys.stdin.buffer.readline())
    return found


def main() -> None:
    """Live and end."""
    threading.stack_size(512 << 10)
    given = hear()
    try:
        jail.lock_up(cpu_s=given["cpu_s"], memory_mb=given["memory_mb"])
    except jail.NoJailError as error:
        tell({"do": "no_jail", "text": str(error)})
        return
    how, why = Program(given["code"]).run()
    tell({"do": "end", "how": how, "text": why})


if __name__ == "__main__":
    main()
