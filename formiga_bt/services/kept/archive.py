"""The file of a backup: a zip with a manifest, private, and read again after it was written.

    formiga-backup.json      what the backup is of, and of each file its bytes and SHA-256
    site/...                 files below the folder of the site file, by their paths there
    runtime/...              files of the runtime folder; `runtime/journal.db` is the journal

It appears under its name only when it is whole. Paths in it are data of who made it: only plain ones below these two folders
are taken, and no more bytes are written than the manifest says.
"""

import fcntl
import hashlib
import os
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath
from typing import IO, Final

import msgspec
from msgspec import Struct

from formiga_bt.base.durable import PRIVATE_FILE, PRIVATE_FOLDER, sync_folder
from formiga_bt.base.errors import SiteError
from formiga_bt.base.site_folder import is_site_name

MANIFEST: Final = "formiga-backup.json"
SITE: Final = "site"
RUNTIME: Final = "runtime"
VERSION: Final = 1
MOST_MANIFEST: Final = 64_000_000
CHUNK: Final = 1 << 20


class File(Struct, frozen=True, forbid_unknown_fields=True):
    """A file of a backup."""

    path: str
    bytes: int
    sha256: str


class Manifest(Struct, frozen=True, kw_only=True):
    """What a backup is of."""

    formiga_backup: int
    """Of this form: 1."""
    site: str
    site_file: str
    """Its name, such as site.yaml."""
    made: int
    """Wall clock, microseconds, before anything was read."""
    formiga: str
    """The version that made it."""
    epoch: int = 0
    """Of the last start that it knows."""
    journal: str = ""
    """`journal.db`; or where the journal is that is not in it, without a password; "" = there is none."""
    left_out: tuple[str, ...] = ()
    """What the site uses and is not in it."""
    files: tuple[File, ...] = ()


# -- writing -----------------------------------------------------------------------------------------------------------
def write_archive(
    target: Path, files: Iterable[tuple[str, Path]], manifest: Callable[[tuple[File, ...]], Manifest]
) -> Manifest:
    """Write a backup beside its place, read it again, and give it its name.

    Args:
        target: is replaced if it is there.
        files: path in the archive -> file; one that is gone by then is left out.
        manifest: made of what was written.

    Raises:
        SiteError: it cannot be written, or cannot be read again; what was there under its name is left.
    """
    with _unfinished(target) as new, _mapped(target):
        written: list[File] = []
        with zipfile.ZipFile(new, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            for name, file in files:
                with suppress(FileNotFoundError):
                    written.append(_put(archive, name, file))
            made = manifest(tuple(written))
            archive.writestr(MANIFEST, msgspec.json.format(msgspec.json.encode(made)))
        new.flush()
        os.fsync(new.fileno())
        new.seek(0)
        with zipfile.ZipFile(new) as archive:
            for one in read_manifest(archive, target).files:
                _check(archive, one, target)
        _beside(target).replace(target)
        sync_folder(target.parent)
    return made


def _beside(target: Path) -> Path:
    return target.with_name(f".{target.name}.part")


@contextmanager
def _unfinished(target: Path) -> Iterator[IO[bytes]]:
    """Open the file that becomes the archive; one that a killed process left is used again."""
    beside = _beside(target)
    with _mapped(target), open(os.open(beside, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, PRIVATE_FILE), "rb+") as new:
        try:
            fcntl.flock(new, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise SiteError(f"another backup is written to {target} now", help="wait, or name another file") from error
        os.fchmod(new.fileno(), PRIVATE_FILE)
        new.truncate(0)
        try:
            yield new
        except BaseException:
            beside.unlink(missing_ok=True)
            raise


def _put(archive: zipfile.ZipFile, name: str, file: Path) -> File:
    found, size = hashlib.sha256(), 0
    with file.open("rb") as source:
        about = zipfile.ZipInfo(name)  # the date of 1980: when a file was changed says nothing here
        about.compress_type = zipfile.ZIP_DEFLATED
        about.external_attr = PRIVATE_FILE << 16
        with archive.open(about, "w", force_zip64=True) as into:
            while part := source.read(CHUNK):
                found.update(part)
                size += len(part)
                into.write(part)
    return File(name, size, found.hexdigest())


# -- reading -----------------------------------------------------------------------------------------------------------
@contextmanager
def reading(file: Path) -> Iterator[zipfile.ZipFile]:
    """Open a backup.

    Raises:
        SiteError: it cannot be read, or is none.
    """
    with _mapped(file):
        try:
            archive = zipfile.ZipFile(file)
        except zipfile.BadZipFile as error:
            raise SiteError(f"{file} is no backup, or was cut short: {error}", help="name another one") from error
        with archive:
            yield archive


def read_manifest(archive: zipfile.ZipFile, file: Path) -> Manifest:
    """Return what a backup is of.

    Raises:
        SiteError: it is no backup of ours, or of a newer formiga, or names files that no backup has.
    """
    try:
        about = archive.getinfo(MANIFEST)
        if about.file_size > MOST_MANIFEST:
            raise SiteError(f"{file} is no backup: its {MANIFEST} is too large")
        told = msgspec.json.decode(archive.read(about), type=Manifest)
    except (KeyError, msgspec.MsgspecError, zipfile.BadZipFile) as error:
        raise SiteError(
            f"{file} is no backup of formiga: {error}", help="name a file that `formiga backup` made"
        ) from error
    if told.formiga_backup != VERSION:
        raise SiteError(f"{file} was made by formiga {told.formiga}, in a form that this version does not read")
    if wrong := _fault_of(told):
        raise SiteError(f"{file} {wrong}, as no backup does; nothing was written")
    return told


def _fault_of(told: Manifest) -> str:
    """Return what is wrong with a manifest that somebody made by hand; an empty text if nothing is."""
    names = {one.path for one in told.files}
    if not is_site_name(told.site):
        return f"calls its site {told.site!r}"
    if "/" in told.site_file or f"{SITE}/{told.site_file}" not in names:
        return f"has no site file {told.site_file!r}"
    if len(names) != len(told.files):
        return "names a file twice"
    return next((f"names the file {one!r}" for one in sorted(names) if not _is_plain(one)), "")


def _is_plain(path: str) -> bool:
    parts = PurePosixPath(path).parts
    bad = any(part.startswith(".") or not part.isprintable() or "\\" in part for part in parts)
    return len(parts) > 1 and parts[0] in (SITE, RUNTIME) and not bad and "/".join(parts) == path


def unpack(archive: zipfile.ZipFile, manifest: Manifest, into: Path, file: Path) -> None:
    """Write all files of a backup below a folder, safely on disk, each compared with the manifest.

    Raises:
        SiteError: one is not as it was, or cannot be written.
    """
    with _mapped(file):
        for one in manifest.files:
            path = into / one.path
            path.parent.mkdir(parents=True, exist_ok=True, mode=PRIVATE_FOLDER)
            with path.open("xb") as new:
                _check(archive, one, file, new.write)
                new.flush()
                os.fsync(new.fileno())


def _check(archive: zipfile.ZipFile, one: File, file: Path, write: Callable[[bytes], object] = lambda _: None) -> None:
    found, left = hashlib.sha256(), one.bytes
    try:
        with archive.open(one.path) as source:
            while left >= 0 and (part := source.read(min(CHUNK, left + 1))):
                left -= len(part)
                found.update(part)
                write(part)
    except (KeyError, zipfile.BadZipFile, EOFError) as error:
        raise SiteError(f"{file} is damaged: {one.path}: {error}", help="take an older backup") from error
    if left != 0 or found.hexdigest() != one.sha256:
        raise SiteError(f"{file} is damaged: {one.path} is not what was written", help="take an older backup")


@contextmanager
def _mapped(file: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise SiteError(f"cannot use {error.filename or file}: {error.strerror or error}") from error
    except (zipfile.LargeZipFile, NotImplementedError, RuntimeError) as error:  # encrypted, or packed in another way
        raise SiteError(f"{file} cannot be read: {error}") from error


def paths_of(manifest: Manifest, top: str) -> Mapping[str, File]:
    """Return the files below one of the two folders, by their paths there."""
    return {one.path.removeprefix(f"{top}/"): one for one in manifest.files if one.path.startswith(f"{top}/")}
