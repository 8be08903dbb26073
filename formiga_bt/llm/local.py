"""A model on this machine: xllamacpp's server in a process of its own, reachable from this machine only, and with a key.

The process is started at the first question, stays for the next ones (it keeps the beginning of the prompt ready), and
ends with us: it reads a pipe that the system closes when we end, however that happens. Only one runs at a time for a user.
`serve` is what the process does; `xllamacpp` is imported there only.
"""

import fcntl
import json
import os
import select
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from secrets import token_urlsafe
from typing import IO, Any, Final

from formiga_bt.base.extras import install
from formiga_bt.llm.adapters import about
from formiga_bt.llm.endpoint import Endpoint
from formiga_bt.llm.errors import Cancelled, EndpointUnreachable, TooLong, UnusableModel
from formiga_bt.llm.folders import cache_folder
from formiga_bt.llm.ladder import Memory
from formiga_bt.llm.models import OnDisk
from formiga_bt.llm.presets import LOCAL, Preset
from formiga_bt.llm.records import Message, ModelReply, Rung
from formiga_bt.llm.wire import shown

LEAST_CONTEXT: Final = 8192
"""Tokens of question and answer for which room is made at first."""
STEP: Final = 4096
UNKNOWN_CONTEXT: Final = 32768
"""The most that is tried with a model of which we do not know what it can take."""
START_S: Final = 300.0
LOCK_S: Final = 15.0
"""How long another one is given to end."""
SECRETS: Final = ("KEY", "TOKEN", "SECRET", "PASSWORD", "CREDENTIAL")


class LocalChat:
    """A chat with a model on this machine."""

    def __init__(
        self,
        model: OnDisk,
        *,
        adapter: Path | None = None,
        context: int = 0,
        whole_s: float = 1800.0,
        on_start: Callable[[str], None] | None = None,
    ) -> None:
        """Make a chat; nothing is started yet.

        Args:
            model: from `models.usable`.
            adapter: a GGUF file with a LoRA adapter that was made for this model.
            context: tokens of question and answer together; 0: as much as the questions need.
            whole_s: the longest time for one answer.
            on_start: told a line when the model is loaded: how long that took, how much memory it has.

        Raises:
            UnusableModel: xllamacpp is missing, the adapter is no GGUF file, or there is too little memory.
        """
        self.name, self.model = LOCAL, model.name
        self.prompt = about(adapter).get("formiga.prompt", "") if adapter is not None else ""
        """The prompt that the adapter was trained with; "" = the usual one."""
        self.is_plain = False
        """Set: the model is asked without its adapter."""
        self.about = ""
        """How the model was started: seconds, memory, threads, context; "" = it was not."""
        self.note = ""
        """What a person should know before it is asked; "" = nothing."""
        self._on_disk, self._adapter = model, adapter
        self._fixed, self._context = context, context
        self._whole_s, self._on_start = whole_s, on_start
        self._child: _Child | None = None
        self._endpoint: Endpoint | None = None
        if find_spec("xllamacpp") is None:
            raise UnusableModel("a model on this machine needs packages more", help=f"{install('local-llm')}")

    def complete(
        self,
        messages: Sequence[Message],
        schema: Mapping[str, Any] | None,
        *,
        max_tokens: int,
        temperature: float = 0.0,
        seed: int | None = None,
        on_progress: Callable[[int], None] | None = None,
        cancel: threading.Event | None = None,
    ) -> ModelReply:
        """Ask; see `client.Chat`. The first question also waits until the model is loaded."""
        began = time.monotonic()
        cancel = cancel or threading.Event()
        need = sum(len(one.text) for one in messages) // 3 + max_tokens + 256
        for _ in range(3):
            endpoint = self._running(need, cancel)
            endpoint.more = {"lora": [{"id": 0, "scale": 0.0 if self.is_plain else 1.0}]} if self._adapter else {}
            try:
                reply = endpoint.complete(
                    messages,
                    schema,
                    max_tokens=max_tokens,
                    temperature=temperature,
                    seed=seed,
                    on_progress=on_progress,
                    cancel=cancel,
                )
            except TooLong:
                if self._fixed or self._context >= self._most():
                    raise
                need = 2 * self._context
                continue
            except EndpointUnreachable as error:
                why = self._child.ended() if self._child is not None else ""
                if not why:
                    raise
                self.close()
                raise UnusableModel(
                    f"the process of {self.model} ended: {why}", help="try once more, or a smaller model"
                ) from error
            used = reply.usage.prompt + reply.usage.completion
            if reply.finish == "length" and reply.usage.completion < max_tokens and used >= self._context - 8:
                if self._fixed or self._context >= self._most():
                    return reply
                need = 2 * self._context
                continue
            return _with_seconds(reply, time.monotonic() - began)
        return reply

    def close(self) -> None:
        """End the process. May be called twice."""
        child, self._child = self._child, None
        endpoint, self._endpoint = self._endpoint, None
        if endpoint is not None:
            endpoint.close()
        if child is not None:
            child.end()

    def __enter__(self) -> "LocalChat":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _most(self) -> int:
        return self._on_disk.context or UNKNOWN_CONTEXT

    def _running(self, need: int, cancel: threading.Event) -> Endpoint:
        """Return the endpoint of the process, which has room for so many tokens if that can be had."""
        wanted = self._fixed or min(self._most(), max(LEAST_CONTEXT, -(-need // STEP) * STEP))
        if (
            self._endpoint is not None
            and self._child is not None
            and not self._child.ended()
            and wanted <= self._context
        ):
            return self._endpoint
        self.close()
        self._context = wanted
        _check_memory(self._on_disk)
        began = time.monotonic()
        token, threads = token_urlsafe(32), _threads()
        child = _Child(
            {
                "model": str(self._on_disk.file),
                "name": self.model,
                "adapter": str(self._adapter or ""),
                "context": wanted,
                "threads": threads,
                "token": token,
                "lock": str(cache_folder() / "local.lock"),
                "lock_s": LOCK_S,
            }
        )
        try:
            port = child.port(began + START_S, cancel)
        except BaseException:
            child.end()
            raise
        self._child = child
        preset = Preset(name=LOCAL)
        self._endpoint = Endpoint(
            preset, f"http://127.0.0.1:{port}/v1", self.model, key=token, whole_s=self._whole_s, memory=_NoMemory()
        )
        memory = child.memory_bytes()
        held = f", {memory / 1e9:.1f} GB of memory" if memory else ""
        took = time.monotonic() - began
        busy = f"{threads} thread{'s' if threads > 1 else ''}"
        self.about = f"{self.model} loaded in {took:.1f} s{held}, {busy}, room for {wanted} tokens"
        if self._on_start is not None:
            self._on_start(self.about)
        return self._endpoint


class _NoMemory(Memory):
    """Of an endpoint that is another one each time, there is nothing to remember."""

    def recall(self, base_url: str, model: str) -> Rung | None:  # noqa: ARG002
        return None

    def keep(self, base_url: str, model: str, rung: Rung) -> None: ...


def _with_seconds(reply: ModelReply, seconds: float) -> ModelReply:
    from msgspec.structs import replace

    return replace(reply, seconds=seconds)


def _threads() -> int:
    """Return how many threads compute: FORMIGA_LLM_THREADS, or the cores that are idle.

    They wait for each other after every layer: with more threads than idle cores, each token takes ten times as long.
    """
    said = os.environ.get("FORMIGA_LLM_THREADS", "")
    if said.isdecimal() and 1 <= int(said) <= 1024:
        return int(said)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, cores - int(os.getloadavg()[0]))


def _check_memory(model: OnDisk) -> None:
    """Refuse to load what would push all else out of memory."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        free_mb = next(int(line.split()[1]) // 1000 for line in lines if line.startswith("MemAvailable:"))
    except (OSError, StopIteration, ValueError, IndexError):
        return
    if free_mb < model.memory_mb:
        raise UnusableModel(
            f"{model.name} needs about {model.memory_mb} MB of memory, and {free_mb} MB are free",
            help="end something, or a smaller model: formiga model list",
        )


class _Child:
    """The process that serves the model."""

    def __init__(self, spec: Mapping[str, Any]) -> None:
        self._said: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - closed in `end`
        env = {key: value for key, value in os.environ.items() if not any(word in key.upper() for word in SECRETS)}
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", __name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            env=env,
            start_new_session=True,  # Ctrl-C in the terminal is for us; we tell the process
        )
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps(spec).encode() + b"\n")
            self._process.stdin.flush()

    def port(self, until: float, cancel: threading.Event) -> int:
        """Return the port, once the model is loaded."""
        out = self._process.stdout
        assert out is not None
        while not select.select([out], [], [], 0.05)[0]:
            if cancel.is_set():
                raise Cancelled("stopped while the model was loaded")
            if time.monotonic() > until:
                raise UnusableModel(f"the model was not loaded within {START_S:g} s", help="a smaller model")
        line = out.readline()
        try:
            told = json.loads(line)
            if "error" not in told:
                return int(told["port"])
            words = str(told["error"])
        except (ValueError, KeyError, TypeError):
            self._process.wait()
            words = f"the model cannot be loaded: {self.ended()}"
        raise UnusableModel(words)

    def ended(self) -> str:
        """Return why the process ended, in words; "" = it runs."""
        code = self._process.poll()
        if code is None:
            return ""
        self._said.seek(0)
        lines = self._said.read()[-4000:].decode("utf-8", "replace").splitlines()
        last = shown(
            next((line for line in reversed(lines) if " E " in line or "rror" in line), lines[-1] if lines else "")
        )
        how = f"signal {-code}" + (" (too little memory?)" if code == -9 else "") if code < 0 else f"exit code {code}"
        return f"{how}{': ' if last else ''}{last}"

    def memory_bytes(self) -> int:
        """Return how much memory the process has; 0: the system does not say."""
        try:
            status = Path(f"/proc/{self._process.pid}/status").read_text(encoding="ascii")
            return int(status.split("VmRSS:")[1].split()[0]) * 1024
        except (OSError, IndexError, ValueError):
            return 0

    def end(self) -> None:
        """End it, and wait until it has."""
        process = self._process
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with suppress(OSError):
                    pipe.close()
        try:
            process.wait(timeout=2.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        self._said.close()


def serve() -> None:
    """Serve a model until stdin ends. What to serve comes as a line of JSON; the port goes back as one."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # the library's own words are no answer
    spec = json.loads(sys.stdin.buffer.readline() or b"{}")
    threading.Thread(target=_end_with_parent, daemon=True).start()

    def answer(**words: Any) -> None:
        answers.write(json.dumps(words) + "\n")
        answers.flush()

    lock = _locked(Path(spec["lock"]), spec["lock_s"])
    if lock is None:
        answer(
            error="a local model runs already for another command of yours, and two would be slow\n"
            "  help: wait until it has ended, or end it"
        )
        return
    server = _served(spec)
    answer(port=int(server.listening_address.rsplit(":", 1)[1]))
    threading.Event().wait()


def _served(spec: Mapping[str, Any]) -> Any:
    import xllamacpp  # type: ignore[import-not-found, import-untyped, unused-ignore]

    params = xllamacpp.CommonParams()
    params.model.path = spec["model"]
    params.model_alias = {spec["name"]}
    params.n_ctx = spec["context"]
    params.n_parallel = 1
    params.cpuparams.n_threads = params.cpuparams_batch.n_threads = spec["threads"]
    params.hostnames, params.port = ["127.0.0.1"], 0
    params.api_keys = [spec["token"]]
    params.ui = params.endpoint_slots = params.endpoint_props = params.endpoint_metrics = False
    params.cache_ram_mib = 256
    params.verbosity = 1
    if spec["adapter"]:
        params.lora_adapters = [xllamacpp.CommonAdapterLoraInfo(spec["adapter"], 1.0)]
    return xllamacpp.Server(params)


def _locked(path: Path, within_s: float) -> IO[str] | None:
    path.parent.mkdir(parents=True, exist_ok=True)
    file = path.open("w")
    until = time.monotonic() + within_s
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return file
        except OSError:
            if time.monotonic() > until:
                return None
            time.sleep(0.1)


def _end_with_parent() -> None:
    while os.read(0, 65536):  # not of sys.stdin: Python would wait for its lock at the end
        pass
    os._exit(0)


if __name__ == "__main__":
    serve()
