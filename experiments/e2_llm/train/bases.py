"""The models that can be tuned: the files that `formiga model fetch` brings, and which layers get an adapter."""

import hashlib
from pathlib import Path
from typing import Final

from msgspec import Struct

from formiga_bt.llm.models import known, models_folder


class Base(Struct, frozen=True, kw_only=True):
    """A model and how it is tuned."""

    name: str
    """As `formiga model fetch` knows it."""
    architecture: str
    rank: int
    layers: tuple[str, ...]
    """Of torch, that get an adapter."""
    rate: float
    """Learning rate at its height."""
    most_tokens: int
    """Of a sequence."""


_WITHOUT_QK: Final = ("v_proj", "o_proj", "gate_proj", "up_proj", "down_proj")
BASES: Final = {
    "smollm2": Base(name="smollm2", architecture="llama", rank=24, layers=_WITHOUT_QK, rate=1e-3, most_tokens=2600),
    "qwen2.5-coder-0.5b": Base(
        name="qwen2.5-coder-0.5b",
        architecture="qwen2",
        rank=12,
        layers=("q_proj", "k_proj", *_WITHOUT_QK),
        rate=4e-4,
        most_tokens=2600,
    ),
}
"""For `llama`, q and k are permuted in GGUF, so that they get no adapter; ranks keep the file below 16 MB."""


def base_file(base: Base, given: Path | None) -> tuple[Path, str]:
    """Return a base's file and its SHA-256, which must be the publisher's.

    Raises:
        SystemExit: it is not here, or another file.
    """
    about = known(base.name)
    assert about is not None
    path = given or models_folder() / base.name / "model.gguf"
    if not path.is_file():
        raise SystemExit(f"{path} is not here\n  help: formiga model fetch {base.name}, or --file FILE")
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while chunk := stream.read(1 << 20):
            digest.update(chunk)
    if digest.hexdigest() != about.sha256:
        raise SystemExit(f"{path} is not {about.title}: its SHA-256 is {digest.hexdigest()}, not {about.sha256}")
    return path, about.sha256
