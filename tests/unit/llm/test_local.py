"""The process of a local model: started once, asked with a key, ended with us. A fake takes the place of xllamacpp."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from formiga_bt.base.extras import install
from formiga_bt.llm import local
from formiga_bt.llm.errors import Cancelled, UnusableModel
from formiga_bt.llm.local import LocalChat
from formiga_bt.llm.models import OnDisk, add
from formiga_bt.llm.records import Message
from tests.golden import Wording
from tests.unit.llm.test_adapters import gguf

pytestmark = pytest.mark.network

ROOT = Path(__file__).parents[3]
FAKE = """
import json, os, sys
from types import SimpleNamespace
from tests.unit.llm.fake_endpoint import Answer, FakeEndpoint

class CommonParams:
    def __init__(self):
        self.model, self.cpuparams, self.cpuparams_batch = SimpleNamespace(), SimpleNamespace(), SimpleNamespace()

class CommonAdapterLoraInfo:
    def __init__(self, path, scale):
        self.path = path

class Server:
    def __init__(self, params):
        print("words of the library", flush=True)
        if "broken" in params.model.path:
            print("0.1 E cannot read the tensors", file=sys.stderr)
            sys.exit(3)
        if "slow" in params.model.path:
            import threading
            threading.Event().wait()
        told = {"pid": os.getpid(), "context": params.n_ctx, "hosts": params.hostnames, "argv": sys.argv,
                "lora": [one.path for one in getattr(params, "lora_adapters", [])], "secret": "GROQ_API_KEY" in os.environ}
        def answer(body):
            if "die" in str(body["messages"]):
                os._exit(9)
            if params.n_ctx == 8192 and "long" in str(body["messages"]):
                return Answer(status=400, error="request (9031 tokens) exceeds the available context size (8192 tokens)")
            return told | {"asked": body.get("lora")}
        self.endpoint = FakeEndpoint([answer] * 100, key=params.api_keys[0])
        self.endpoint.__enter__()
        self.listening_address = self.endpoint.base_url.removesuffix("/v1")
"""
SCHEMA = {"type": "object"}


def asks(chat: LocalChat, words: str = "hi") -> dict[str, object]:
    found = chat.complete([Message("user", words)], SCHEMA, max_tokens=50).data
    assert isinstance(found, dict)
    return found


def is_running(pid: object) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").split()[2] != "Z"
    except OSError:
        return False


@pytest.fixture
def model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> OnDisk:
    (tmp_path / "fakes").mkdir()
    (tmp_path / "fakes" / "xllamacpp.py").write_text(textwrap.dedent(FAKE), encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path / "fakes"), str(ROOT)]))
    monkeypatch.setattr(local, "find_spec", lambda name: object())
    return named("tiny", tmp_path)


def named(name: str, folder: Path) -> OnDisk:
    file = folder / f"{name}.gguf"
    file.write_bytes(b"GGUF")
    return add(file)


@pytest.fixture
def chat(model: OnDisk) -> Iterator[LocalChat]:
    with LocalChat(model) as made:
        yield made


def test_one_process_answers_all_questions_and_ends(chat: LocalChat, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GROQ_API_KEY", "canary")
    assert chat.about == ""
    first, second = asks(chat), asks(chat)
    assert first == second
    assert (first["context"], first["hosts"], first["lora"], first["secret"]) == (8192, ["127.0.0.1"], [], False)
    assert chat.about.startswith("tiny loaded in ")
    assert is_running(first["pid"])
    chat.close()
    chat.close()
    assert not is_running(first["pid"])


def test_nobody_without_the_key_is_answered(chat: LocalChat) -> None:
    told = asks(chat)
    assert chat._endpoint is not None
    key = chat._endpoint._key
    assert len(key) > 30
    assert key not in repr(told["argv"]) + repr(chat._endpoint)
    with pytest.raises(urllib.error.HTTPError, match="401") as refused:
        urllib.request.urlopen(f"{chat._endpoint.base_url}/models")
    refused.value.close()


def test_a_question_that_is_longer_gets_more_room(chat: LocalChat) -> None:
    first = asks(chat)
    grown = asks(chat, "long")
    assert (first["context"], grown["context"]) == (8192, 16384)
    assert asks(chat, "x" * 60_000)["context"] == 20480
    assert not is_running(first["pid"])


def test_a_process_that_dies_is_told_and_started_anew(chat: LocalChat, wording: Wording) -> None:
    first = asks(chat)
    with pytest.raises(UnusableModel) as refused:
        asks(chat, "die")
    wording(refused.value)
    assert asks(chat)["pid"] != first["pid"]


def test_a_model_that_cannot_be_loaded(model: OnDisk, tmp_path: Path, wording: Wording) -> None:
    with LocalChat(named("broken", tmp_path)) as chat, pytest.raises(UnusableModel) as caught:
        asks(chat)
    wording(str(caught.value))


def test_loading_is_stopped(model: OnDisk, tmp_path: Path, wording: Wording) -> None:
    cancel = threading.Event()
    cancel.set()
    with LocalChat(named("slow", tmp_path)) as chat, pytest.raises(Cancelled) as refused:
        chat.complete([Message("user", "hi")], None, max_tokens=5, cancel=cancel)
    wording(refused.value)


def test_two_at_a_time_are_refused(
    chat: LocalChat, model: OnDisk, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    asks(chat)
    monkeypatch.setattr(local, "LOCK_S", 0.0)
    with LocalChat(model) as second, pytest.raises(UnusableModel) as refused:
        asks(second)
    wording(refused.value)


def test_the_adapter_is_loaded_and_must_be_one(model: OnDisk, tmp_path: Path, wording: Wording) -> None:
    adapter = tmp_path / "adapter.gguf"
    adapter.write_bytes(gguf({"adapter.type": "lora", "formiga.prompt": "brief-1"}))
    with LocalChat(model, adapter=adapter) as chat:
        assert chat.prompt == "brief-1"
        said = asks(chat)
        assert (said["lora"], said["asked"]) == ([str(adapter)], [{"id": 0, "scale": 1.0}])
        chat.is_plain = True
        assert asks(chat)["asked"] == [{"id": 0, "scale": 0.0}]
    adapter.write_bytes(b"no")
    with pytest.raises(UnusableModel) as refused:
        LocalChat(model, adapter=adapter)
    wording(refused.value)


def test_the_process_ends_when_we_are_killed(model: OnDisk) -> None:
    script = f"""
import sys
from pathlib import Path
from formiga_bt.llm import local
from formiga_bt.llm.models import usable
from formiga_bt.llm.records import Message
from tests.unit.llm.test_adapters import gguf
local.find_spec = lambda name: object()
chat = local.LocalChat(usable({model.name!r}))
print(chat.complete([Message("user", "hi")], {{"type": "object"}}, max_tokens=50).text, flush=True)
sys.stdin.read()
"""
    with subprocess.Popen(
        [sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        pid = json.loads(parent.stdout.readline())["pid"]
        assert is_running(pid)
        handle = os.pidfd_open(pid)
        parent.send_signal(signal.SIGKILL)
        parent.wait()
    import select

    assert select.select([handle], [], [], 20)[0], "it runs on"
    os.close(handle)


def test_without_the_package_and_without_memory(
    model: OnDisk, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    from msgspec.structs import replace

    with LocalChat(replace(model, memory_mb=10**9)) as chat, pytest.raises(UnusableModel) as refused:
        asks(chat)
    wording(str(refused.value).rpartition(", and")[0])
    monkeypatch.setattr(local, "find_spec", lambda name: None)
    with pytest.raises(UnusableModel) as caught:
        LocalChat(model)
    assert str(caught.value).endswith(install("local-llm"))


@pytest.mark.parametrize(("load", "threads"), [(0.2, 4), (1.7, 3), (9.0, 1)])
def test_no_more_threads_than_idle_cores(load: float, threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {0, 1, 2, 3})
    monkeypatch.setattr(os, "getloadavg", lambda: (load, 0.0, 0.0))
    assert local._threads() == threads
    monkeypatch.setenv("FORMIGA_LLM_THREADS", "7")
    assert local._threads() == 7
