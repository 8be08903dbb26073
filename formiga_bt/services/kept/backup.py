"""A backup of a site: what its next start on another machine needs. Made while the engine runs, or not.

| part | how |
|---|---|
| the site's files | the site file, all below `trees/`, what it names, what tasks import; only below its folder |
| the runtime folder | regular files but those of `NOT_KEPT`; each is replaced whole or grown by lines, so it can be read |
| the journal | SQLite's online backup (`journal.copying`), after all else, so that it knows at least what they know |

A journal in PostgreSQL is left to `pg_dump`: it is the database's own tool, it needs rights that formiga has not, and its dumps
are restored by tools that whoever runs the server has.
"""

import os
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from formiga_bt import __version__
from formiga_bt.base.clock import wall_clock_us
from formiga_bt.base.durable import PRIVATE_FOLDER
from formiga_bt.base.errors import SiteError
from formiga_bt.base.site_folder import JOURNAL, JOURNAL_AT, NO_JOURNAL, journal_of
from formiga_bt.services.kept.archive import RUNTIME, SITE, VERSION, File, Manifest, write_archive
from formiga_bt.services.kept.attachments import FOLDER as ATTACHMENTS

NOT_KEPT: Final = frozenset({"lock", "engine.json", "door", "exact", NO_JOURNAL, "sim", "sim.lock"})
"""What has a meaning only for the process that made it, and `exact`: ids are used after a backup that it does not know."""


class Source:
    """A site to be backed up.

    Args:
        site_file: of the site.
        used: other files that the site and its tasks are read from.
        runtime: its runtime folder; its name is the site's.
        attachments: keep files that agents named, too.
        without_journal: a journal that lies in PostgreSQL, or none, is no reason to refuse.

    Raises:
        SiteError: there is nothing to back up, or the journal is not one that can be in a backup.
    """

    def __init__(
        self,
        site_file: Path,
        used: Sequence[Path],
        runtime: Path,
        *,
        attachments: bool = False,
        without_journal: bool = False,
    ) -> None:
        if not runtime.is_dir():
            raise SiteError(f"{runtime.name} was not started here yet: there is no {runtime}", help="copy the folder")
        self._site_file, self._used, self._runtime = site_file, used, runtime
        self._attachments = attachments
        self._where = journal_of(runtime)
        self._journal = Path(self._where) if self._where and "://" not in self._where else None
        if self._journal is None and not without_journal:
            raise _no_journal(self._where)
        self._epoch = 0
        self.left_out: list[str] = []
        """Files that the site uses and that lie outside of its folder."""

    def write(self, target: Path) -> Manifest:
        """Write the backup, and read it again.

        Raises:
            JournalError: the journal cannot be read.
            SiteError: the backup cannot be written.
        """
        if not target.parent.is_dir():
            raise SiteError(f"there is no folder {target.parent}", help="make it, or name another file")
        made = wall_clock_us()
        copy = target.with_name(f".{target.name}.journal") / JOURNAL

        def manifest(files: tuple[File, ...]) -> Manifest:
            return Manifest(
                formiga_backup=VERSION, site=self._runtime.name, site_file=self._site_file.name, made=made,
                formiga=__version__, epoch=self._epoch, journal=JOURNAL if self._journal is not None else self._where,
                left_out=tuple(self.left_out), files=files,
            )  # fmt: skip

        try:
            return write_archive(target, self._files(copy), manifest)
        finally:
            shutil.rmtree(copy.parent, ignore_errors=True)

    def _files(self, copy: Path) -> Iterator[tuple[str, Path]]:
        """Iterate over what is kept; the copy of the journal is made when its turn comes."""
        yield from self._of_site()
        yield from self._of_runtime()
        self._epoch = _known_epoch(self._runtime)
        if self._journal is not None:
            from formiga_bt.journal.copying import copy_journal
            from formiga_bt.journal.store import Journal

            shutil.rmtree(copy.parent, ignore_errors=True)  # of a backup that was killed
            copy.parent.mkdir(mode=PRIVATE_FOLDER)
            copy_journal(self._journal, copy)
            with Journal(copy, self._runtime.name, read_only=True) as copied:
                self._epoch = max(self._epoch, *(start.epoch for start in copied.starts()), 0)
            yield f"{RUNTIME}/{JOURNAL}", copy

    def _of_site(self) -> Iterator[tuple[str, Path]]:
        beside = self._site_file.parent.resolve()
        trees = [path for path in sorted((beside / "trees").rglob("*")) if path.is_file()]
        for path in dict.fromkeys(one.absolute() for one in (self._site_file, *trees, *self._used)):
            try:
                below = path.resolve().relative_to(beside)
            except ValueError:
                self.left_out.append(str(path))
                continue
            if not any(part.startswith(".") for part in below.parts):
                yield f"{SITE}/{below.as_posix()}", path

    def _of_runtime(self) -> Iterator[tuple[str, Path]]:
        for place, folders, names in os.walk(self._runtime):
            is_top = Path(place) == self._runtime
            folders[:] = sorted(one for one in folders if not (is_top and self._is_passed_over(one)))
            for name in sorted(names):
                path = Path(place) / name
                passed_over = name.startswith(".") or (is_top and self._is_passed_over(name))
                if not passed_over and path.is_file() and not path.is_symlink():
                    yield f"{RUNTIME}/{path.relative_to(self._runtime).as_posix()}", path

    def _is_passed_over(self, name: str) -> bool:
        ours = name in NOT_KEPT or name.startswith((JOURNAL, "aside-"))
        return (
            ours
            or (name == JOURNAL_AT and self._journal is not None)
            or (name == ATTACHMENTS and not self._attachments)
        )


def _known_epoch(runtime: Path) -> int:
    try:
        return int((runtime / "epoch").read_text(encoding="ascii"))
    except (OSError, ValueError):
        return 0


def _no_journal(where: str) -> SiteError:
    without = "then formiga backup FILE --without-journal for all else"
    if where:
        dump = f"pg_dump --format=custom --file=journal.dump '{where}'"
        return SiteError(f"the journal lies in a database, {where}: its own tool copies it", help=f"{dump}; {without}")
    return SiteError("the site keeps no journal: of its tasks and orders nothing can be kept", help="--without-journal")
