"""Jobs in processes of their own: the server answers meanwhile, and a job that takes too long, or is given up, is killed.

The server's side is `JobProcesses`. The other side is `main`: one job comes in over stdin as a line of JSON, progress and the
result go out over stdout, a line each. A process does one job and ends; it has bounds of memory and processor time of its own,
so that it ends too if the server is no more.
"""

import json
import os
import resource
import subprocess
import sys
from contextlib import suppress
from typing import IO, Any, Final

import anyio
import anyio.abc
import msgspec

from formiga_bt.base.errors import FormigaError
from formiga_bt.llm.mcp.ground import ServerFiles, ground_of
from formiga_bt.llm.mcp.judge import JobResult, JudgeJob, done

AT_ONCE: Final = 2
"""Jobs that run at the same time; more wait."""
MOST_WAITING: Final = 8
LIMITS_S: Final = {"check": 30.0, "tree": 30.0, "fly": 120.0}
"""So long a job may take by the wall clock."""
MEMORY: Final = 2 << 30
"""Bytes of data of a job's process."""
LONGEST_LINE: Final = 8 << 20

_START: Final = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from formiga_bt.llm.mcp.worker import main; main()"
)
"""Started with -P: what lies in the current folder is never imported."""
_ENV: Final = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


class Busy(FormigaError):  # noqa: N818 - it names what is wrong
    """More is asked for than can wait."""


class WorkerLine(msgspec.Struct, omit_defaults=True):
    """What a job's process writes: progress, or the result."""

    progress: float = 0.0
    text: str = ""
    done: JobResult | None = None


class WorkerOrder(msgspec.Struct):
    """What it is told."""

    where: ServerFiles
    job: JudgeJob
    seconds: float


class JobProcesses:
    """Starts a process for each job.

    Args:
        where: the files that the server was started with.
        limits_s: wall time by kind of job.
    """

    def __init__(self, where: ServerFiles, limits_s: dict[str, float] | None = None) -> None:
        self._where = where
        self._limits = {**LIMITS_S, **(limits_s or {})}
        self._seats = anyio.Semaphore(AT_ONCE)
        self._open = 0

    async def do(self, job: JudgeJob, progress: Any = None) -> JobResult:
        """Do a job; `progress(seconds, text)` is awaited as it goes on. Cancelling ends its process.

        Raises:
            FormigaError: what is wrong with the task, or the job took too long.
        """
        if self._open >= AT_ONCE + MOST_WAITING:
            raise Busy(f"{AT_ONCE} jobs run and {MOST_WAITING} wait", help="wait for their answers, then ask again")
        self._open += 1
        try:
            async with self._seats:
                return await self._in_process(job, progress)
        finally:
            self._open -= 1

    async def _in_process(self, job: JudgeJob, progress: Any) -> JobResult:
        limit = self._limits[job.kind]
        order = msgspec.json.encode(WorkerOrder(self._where, job, limit)) + b"\n"
        result: JobResult | None = None
        process = await anyio.open_process(
            [sys.executable, "-P", "-c", _START, json.dumps(sys.path)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=None,
            env={**os.environ, **_ENV},
        )  # fmt: skip
        try:
            with anyio.move_on_after(limit) as scope:
                assert process.stdin is not None
                assert process.stdout is not None
                await process.stdin.send(order)
                await process.stdin.aclose()
                async for line in _lines(process.stdout):
                    told = msgspec.json.decode(line, type=WorkerLine)
                    if told.done is not None:
                        result = told.done
                    elif progress is not None:
                        await progress(told.progress, told.text)
        except (anyio.BrokenResourceError, msgspec.DecodeError):
            pass  # it ended before it had told anything
        finally:
            with anyio.CancelScope(shield=True):
                with suppress(ProcessLookupError):
                    process.kill()
                await process.wait()
                await process.aclose()
        if result is None and scope.cancelled_caught:
            raise FormigaError(
                f"given up after {limit:g} s of computing",
                help="make the task smaller, or fly fewer `hours`: loops without an end fly until the time is up",
            )
        if result is None:
            raise FormigaError("the process of this job ended early; it may have needed too much memory")
        if result.error:
            raise FormigaError(result.error)
        return result


async def _lines(stream: anyio.abc.ByteReceiveStream) -> Any:
    rest = b""
    async for chunk in stream:
        *whole, rest = (rest + chunk).split(b"\n")
        for line in whole:
            yield line
        if len(rest) > LONGEST_LINE:
            raise FormigaError("the result is too large to be told")


# --- the process -----------------------------------------------------------------------------------------------------


def main() -> None:
    """Do the job that comes in, and end."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever is printed meanwhile is no part of the answer
    order = msgspec.json.decode(sys.stdin.buffer.readline(), type=WorkerOrder)
    seconds = int(order.seconds) + 5
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        os.nice(5)
    with suppress(BrokenPipeError, KeyboardInterrupt):
        try:
            result = done(order.job, ground_of(order.where), lambda at, text: _tell(out, WorkerLine(at, text)))
        except FormigaError as error:
            result = JobResult(error=str(error))
        except (MemoryError, RecursionError) as error:
            result = JobResult(error=f"the task is too large to be worked at ({type(error).__name__}); make it smaller")
        _tell(out, WorkerLine(done=result))


def _tell(out: IO[bytes], line: WorkerLine) -> None:
    out.write(msgspec.json.encode(line) + b"\n")
    out.flush()
