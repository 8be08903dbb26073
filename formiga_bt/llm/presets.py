"""The providers that are known by name: where they are, which variable has the key, how they like to be asked.

Prices are list prices in US dollars per million tokens when this was written; FORMIGA_LLM_PRICE says better.
"""

import ipaddress
import os
from collections.abc import Mapping
from typing import Any, Final
from urllib.parse import urlsplit

from msgspec import Struct

from formiga_bt.llm.errors import LlmError, NoKey
from formiga_bt.llm.records import Rung, Usage

KEYRING: Final = "formiga-bt"
"""Service under which keys are looked up in the system's keyring; the user name there is the provider."""
OWN_KEY: Final = "FORMIGA_LLM_KEY"
"""The key for an endpoint that is no preset, and before the preset's own variable for one that is."""


class Price(Struct, frozen=True):
    """US dollars per million tokens."""

    prompt: float
    completion: float
    cached: float | None = None
    """None: as the prompt."""


class Preset(Struct, frozen=True, kw_only=True):
    """A provider."""

    name: str
    base_url: str = ""
    """"" = it must be given."""
    keys: tuple[str, ...] = ()
    """Variables of the environment that may have the key; none: no key is needed."""
    model: str = ""
    """Default; "" = the only one that the endpoint serves, or it must be given."""
    rung: Rung = "schema"
    """Where the ladder starts: what is known to work, and costs the fewest tokens."""
    limit_word: str = "max_tokens"
    """What the limit of the answer is called."""
    api_version: str = ""
    prices: Mapping[str, Price] = {}


PRESETS: Final[Mapping[str, Preset]] = {
    one.name: one
    for one in (
        Preset(
            name="groq",
            base_url="https://api.groq.com/openai/v1",
            keys=("GROQ_API_KEY",),
            model="openai/gpt-oss-120b",
            limit_word="max_completion_tokens",
            prices={
                "openai/gpt-oss-120b": Price(0.15, 0.60),
                "openai/gpt-oss-20b": Price(0.075, 0.30),
                "llama-3.3-70b-versatile": Price(0.59, 0.79),
            },
        ),
        Preset(
            name="openai",
            base_url="https://api.openai.com/v1",
            keys=("OPENAI_API_KEY",),
            model="gpt-4.1-mini",
            rung="strict",
            limit_word="max_completion_tokens",
            prices={"gpt-4.1-mini": Price(0.40, 1.60, 0.10), "gpt-4.1": Price(2.0, 8.0, 0.50)},
        ),
        Preset(
            name="azure",
            keys=("AZURE_OPENAI_API_KEY",),
            rung="strict",
            limit_word="max_completion_tokens",
            api_version="2024-10-21",
        ),
        Preset(
            name="hf",
            base_url="https://router.huggingface.co/v1",
            keys=("HF_TOKEN", "HUGGING_FACE_HUB_TOKEN"),
            model="Qwen/Qwen2.5-Coder-32B-Instruct",
        ),
        Preset(name="ollama", base_url="http://127.0.0.1:11434/v1"),
        Preset(name="vllm", base_url="http://127.0.0.1:8000/v1"),
        Preset(name="llamacpp", base_url="http://127.0.0.1:8080/v1"),
    )
}
LOCAL: Final = "local"
"""A model on this machine, started by us."""
OTHER: Final = "endpoint"
"""What an endpoint is called that is given by its address only."""
NAMES: Final = (*PRESETS, LOCAL)


def checked_url(url: str) -> str:
    """Return the address of an endpoint, if a key may be sent there.

    Raises:
        LlmError: it is no address, not encrypted, or has a name, password or query in it.
    """
    parts = urlsplit(url)
    bare = f"{parts.scheme}://{parts.hostname or ''}"
    if parts.scheme not in ("http", "https") or not parts.hostname:
        raise LlmError("the address of a model's endpoint begins with https:// and has a host, as https://host/v1")
    if parts.username is not None or parts.password is not None or parts.query or parts.fragment:
        raise LlmError(
            f"{bare}...: the address of an endpoint has no key, password or query in it",
            help=f"put the key into the environment as {OWN_KEY}",
        )
    if parts.scheme == "http" and not is_loopback(url):
        raise LlmError(
            f"{bare}: what is asked, and the key, would travel in the clear",
            help="use https://, or a tunnel to this machine (ssh -L 8000:localhost:8000 HOST), then http://localhost:8000/v1",
        )
    return url.rstrip("/")


def is_loopback(url: str) -> bool:
    """Return whether an address is on this machine."""
    host = urlsplit(url).hostname or ""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def key_of(preset: Preset, *, own_address: bool = False) -> str:
    """Return the key for a provider, from the environment or the system's keyring; "" if it needs none and there is none.

    Args:
        preset: the provider.
        own_address: the endpoint is not the provider's own: only FORMIGA_LLM_KEY is meant for it.

    Raises:
        NoKey: it needs one, and there is none.
    """
    variables = (OWN_KEY,) if own_address else (OWN_KEY, *preset.keys)
    for variable in variables:
        found = os.environ.get(variable, "").strip()
        if found:
            if not found.isascii() or not found.isprintable() or " " in found:
                raise NoKey(f"{variable} is no key: it has spaces or letters that no key has")
            return found
    kept = _in_keyring(preset.name)
    if kept or own_address or not preset.keys:
        return kept
    raise NoKey(
        f"{preset.name} needs a key, and there is none",
        help=f"export {preset.keys[0]}=..., or keep it in the system's keyring: keyring set {KEYRING} {preset.name}",
    )


def has_key(preset: Preset) -> bool:
    """Return whether the provider's own variable has a key."""
    return any(os.environ.get(variable, "").strip() for variable in preset.keys)


def _in_keyring(provider: str) -> str:
    try:
        import keyring  # type: ignore[import-not-found, import-untyped, unused-ignore]

        return str(keyring.get_password(KEYRING, provider) or "").strip()
    except Exception:  # noqa: BLE001 - no such package, no keyring service, a locked one: there is no key then
        return ""


def price_of(preset: Preset, model: str) -> Price | None:
    """Return what tokens cost: FORMIGA_LLM_PRICE (`prompt,completion` or `prompt,completion,cached`), or the list price.

    Raises:
        LlmError: FORMIGA_LLM_PRICE cannot be read.
    """
    said = os.environ.get("FORMIGA_LLM_PRICE", "")
    if not said:
        return preset.prices.get(model)
    try:
        numbers = [float(part) for part in said.split(",")]
        if len(numbers) not in (2, 3) or not all(0 <= number < 1e6 for number in numbers):
            raise ValueError(said)
        return Price(*numbers)
    except ValueError:
        raise LlmError(
            f"FORMIGA_LLM_PRICE is '{said}'; it is US dollars per million tokens: prompt,completion or "
            "prompt,completion,cached, as 0.59,0.79"
        ) from None


def cost_usd(price: Price, usage: Usage) -> float:
    """Return what the tokens cost, in US dollars."""
    cached = price.prompt if price.cached is None else price.cached
    fresh = max(0, usage.prompt - usage.cached)
    return (fresh * price.prompt + usage.cached * cached + usage.completion * price.completion) / 1e6


def azure_settings(preset: Preset) -> dict[str, Any]:
    """Return where the deployment is, as the environment says it: AZURE_OPENAI_ENDPOINT, _DEPLOYMENT, OPENAI_API_VERSION."""
    return {
        "base_url": os.environ.get("AZURE_OPENAI_ENDPOINT", ""),
        "model": os.environ.get("AZURE_OPENAI_DEPLOYMENT", ""),
        "api_version": os.environ.get("OPENAI_API_VERSION", "") or preset.api_version,
    }
