"""LoRA adapters for models on this machine: which one a checkout has for a model, and what its file says of itself.

The package that is installed has the adapters' cards, but not their files (13 MB).

An adapter was trained with a prompt of its own; a model that has it is asked with that prompt. The file says which
(`formiga.prompt`), and for which base it was made (`formiga.base_sha256`).
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Final

from formiga_bt.llm.errors import UnusableModel
from formiga_bt.llm.models import OnDisk

FOLDER: Final = Path(__file__).parent / "adapters"
NONE: Final = "none"
"""Said in place of an adapter: the model alone."""
_MAGIC: Final = b"GGUF"
_MOST_KEYS: Final = 10_000
_MOST_TEXT: Final = 1 << 20
_STRING, _ARRAY = 8, 9
_SIZES: Final = {0: 1, 1: 1, 2: 2, 3: 2, 4: 4, 5: 4, 6: 4, 7: 1, 10: 8, 11: 8, 12: 8}
"""Bytes of a plain value of GGUF by its type."""


def shipped(model: OnDisk) -> Path | None:
    """Return the adapter that a checkout has for a model, if there is one, made for this very file."""
    path = FOLDER / f"{model.name}.gguf"
    if not path.is_file():
        return None
    return path if about(path).get("formiga.base_sha256") == model.sha256 else None


def absent(name: str) -> str:
    """Return how to get the adapter of a model, by the model's name; "" if it is here, or there is none."""
    file = FOLDER / f"{name}.gguf"
    if file.is_file() or not file.with_suffix(".md").is_file():
        return ""
    return (
        f"the adapter of {name} is not installed; without it drafts are worse\n"
        f"  help: take formiga_bt/llm/adapters/{file.name} (13 MB) from a checkout of formiga_bt, then:"
        f" formiga model use {name} --adapter FILE"
    )


def about(path: Path) -> dict[str, str]:
    """Return the texts at the head of a GGUF file by their keys.

    Raises:
        UnusableModel: it cannot be read, or is no GGUF file.
    """
    try:
        with path.open("rb") as stream:
            return dict(_texts(stream))
    except OSError as error:
        raise UnusableModel(f"{path}: {error.strerror or error}") from error
    except (struct.error, ValueError) as error:
        raise UnusableModel(
            f"{path} is no GGUF file", help="an adapter is a LoRA adapter as llama.cpp reads it"
        ) from error


def _texts(stream: IO[bytes]) -> Iterator[tuple[str, str]]:
    if stream.read(4) != _MAGIC:
        raise ValueError("no GGUF")
    _, _, keys = _read(stream, "<IQQ")
    if keys > _MOST_KEYS:
        raise ValueError("too many keys")
    for _ in range(keys):
        key = _text(stream)
        (kind,) = _read(stream, "<I")
        if kind == _STRING:
            yield key, _text(stream)
        else:
            _skip(stream, kind)


def _skip(stream: IO[bytes], kind: int) -> None:
    if kind != _ARRAY:
        if kind not in _SIZES:
            raise ValueError(f"unknown type {kind}")
        stream.seek(_SIZES[kind], 1)
        return
    inner, count = _read(stream, "<IQ")
    if inner in _SIZES:
        stream.seek(_SIZES[inner] * count, 1)
    elif inner == _STRING and count <= _MOST_TEXT:
        for _ in range(count):
            stream.seek(_read(stream, "<Q")[0], 1)
    else:
        raise ValueError("unknown array")


def _text(stream: IO[bytes]) -> str:
    (size,) = _read(stream, "<Q")
    if size > _MOST_TEXT:
        raise ValueError("too long")
    data = stream.read(size)
    if len(data) != size:
        raise ValueError("cut off")
    return data.decode("utf-8", "replace")


def _read(stream: IO[bytes], form: str) -> tuple[int, ...]:
    return struct.unpack(form, stream.read(struct.calcsize(form)))
