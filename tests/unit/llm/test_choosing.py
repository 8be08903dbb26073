"""Whom to ask: the order of the ways, the keys, the addresses."""

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from formiga_bt.llm import choosing
from formiga_bt.llm.choosing import NOTHING, choose, default, default_file, make_default
from formiga_bt.llm.client import open_chat
from formiga_bt.llm.errors import LlmError, NoKey
from formiga_bt.llm.models import add
from formiga_bt.llm.presets import PRESETS, Price, checked_url, cost_usd, key_of, price_of
from formiga_bt.llm.records import Usage
from tests.golden import Wording


def test_the_ways_come_in_order(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def chosen(provider: str = "", model: str = "", base_url: str = "") -> tuple[str, str, str]:
        found = choose(provider, model, base_url=base_url)
        return found.provider, found.model, found.base_url

    with pytest.raises(LlmError) as nothing:
        choose()
    assert str(nothing.value) == NOTHING

    file = tmp_path / "tiny.gguf"
    file.write_bytes(b"GGUF")
    add(file)
    assert chosen() == ("local", "tiny", "")
    monkeypatch.setenv("HF_TOKEN", "k")
    assert chosen() == ("hf", "", "")
    monkeypatch.setenv("GROQ_API_KEY", "k")
    assert chosen() == ("groq", "", "")
    make_default(choose("ollama", "qwen"))
    assert chosen() == ("ollama", "qwen", "")
    assert chosen(model="llama") == ("ollama", "llama", "")
    monkeypatch.setenv("FORMIGA_LLM_PROVIDER", "vllm")
    assert chosen() == ("vllm", "", "")
    assert chosen("openai") == ("openai", "", "")
    assert chosen(base_url="https://x/v1") == ("endpoint", "", "https://x/v1")
    assert chosen("tiny") == chosen("local") == chosen(model="tiny") == ("local", "tiny", "")


def test_of_two_models_here_the_one_with_an_adapter_writes_and_the_larger_one_changes(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name, size in (("small", 4), ("large", 40)):
        (tmp_path / f"{name}.gguf").write_bytes(b"GGUF" + bytes(size))
        add(tmp_path / f"{name}.gguf")
    assert choose().model == choose("local").model == "large"

    monkeypatch.setattr(choosing, "shipped", lambda model: tmp_path if model.name == "small" else None)
    assert choose().model == choose("local").model == "small"
    assert choose(is_change=True).model == choose("local", is_change=True).model == "large"
    assert choose(adapter="none").model == "large"
    assert choose(model="large").model == "large"


def test_the_default_is_kept_without_secrets_and_a_broken_file_is_none(
    monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setenv("GROQ_API_KEY", "canary")
    make_default(choose("groq", "m"))
    wording(default_file().read_text(encoding="utf-8"))
    for broken in ("{", "[]", '{"provider": 1}', '{"provider": "nobody"}'):
        default_file().write_text(broken, encoding="utf-8")
        assert default() is None
    make_default(None)
    assert not default_file().exists()


def test_a_provider_that_there_is_not(wording: Wording) -> None:
    with pytest.raises(LlmError) as caught:
        choose("gorq")
    wording(str(caught.value))
    with pytest.raises(LlmError) as refused:
        choose("local")
    wording(refused.value)


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("example.org/v1", "begins with https://"),
        ("ftp://example.org/v1", "begins with https://"),
        ("http://example.org/v1", "would travel in the clear"),
        ("http://127.0.0.1.example.org/v1", "would travel in the clear"),
        ("http://10.0.0.7/v1", "would travel in the clear"),
        ("https://me:canary@example.org/v1", "has no key, password or query in it"),
        ("https://example.org/v1?key=canary", "has no key, password or query in it"),
    ],
)
def test_addresses_that_are_refused(url: str, words: str) -> None:
    with pytest.raises(LlmError, match=words) as caught:
        open_chat(base_url=url, model="m")
    assert "canary" not in str(caught.value)


@pytest.mark.parametrize("url", ["https://x/v1", "http://localhost:1/v1", "http://127.9.9.9/v1", "http://[::1]:8/v1"])
def test_addresses_that_are_taken(url: str) -> None:
    assert checked_url(f"{url}/") == url


def test_where_keys_come_from(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    groq = PRESETS["groq"]
    monkeypatch.setitem(sys.modules, "keyring", None)
    with pytest.raises(NoKey) as caught:
        key_of(groq)
    wording(str(caught.value))
    kept = {("formiga-bt", "groq"): "from the ring"}
    monkeypatch.setitem(sys.modules, "keyring", SimpleNamespace(get_password=lambda *names: kept.get(names)))
    assert key_of(groq) == "from the ring"
    monkeypatch.setenv("GROQ_API_KEY", " groqs\n")
    assert key_of(groq) == "groqs"
    assert key_of(groq, own_address=True) != "groqs"
    monkeypatch.setenv("FORMIGA_LLM_KEY", "own")
    assert key_of(groq) == key_of(groq, own_address=True) == "own"
    monkeypatch.setenv("FORMIGA_LLM_KEY", "two words canary")
    with pytest.raises(NoKey) as odd:
        key_of(groq)
    wording(odd.value)
    assert "canary" not in str(odd.value)


def test_a_providers_key_is_not_sent_to_another_address(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "keyring", None)
    monkeypatch.setenv("OPENAI_API_KEY", "canary")
    chat = open_chat("openai", "m", base_url="https://elsewhere.example/v1")
    assert "canary" not in repr(vars(chat))


def test_what_tokens_cost(monkeypatch: pytest.MonkeyPatch) -> None:
    groq = PRESETS["groq"]
    assert price_of(groq, "no such model") is None
    monkeypatch.setenv("FORMIGA_LLM_PRICE", "1,2,0.5")
    assert price_of(groq, "no such model") == Price(1.0, 2.0, 0.5)
    assert cost_usd(Price(1.0, 2.0), Usage(prompt=1_000_000, cached=400_000, completion=500_000)) == 2.0
    for odd in ("1", "a,b", "1,2,3,4", "-1,2", "nan,1"):
        monkeypatch.setenv("FORMIGA_LLM_PRICE", odd)
        with pytest.raises(LlmError, match="FORMIGA_LLM_PRICE is"):
            price_of(groq, "m")


def test_an_adapter_is_for_local_models_only(wording: Wording) -> None:
    with pytest.raises(LlmError) as refused:
        open_chat("ollama", "m", adapter="a.gguf")
    wording(refused.value)


def test_azure_needs_an_address_and_a_deployment(wording: Wording) -> None:
    with pytest.raises(LlmError) as refused:
        open_chat("azure")
    wording(refused.value)


def test_a_patience_that_is_no_number(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    monkeypatch.setenv("FORMIGA_LLM_TIMEOUT", "long")
    with pytest.raises(LlmError) as refused:
        open_chat("ollama", "m")
    wording(refused.value)
