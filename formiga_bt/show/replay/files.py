"""The site, the catalogue and the tasks of a journal, read from the exact files that were kept with it."""

import re
from pathlib import Path
from typing import Final

from msgspec.structs import replace

from formiga_bt.base.packaged import files
from formiga_bt.journal.records import SITE_FILES, BundleRow
from formiga_bt.journal.store import Journal
from formiga_bt.lang.loader import load_catalogue, load_task_text
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.lang.site import load_site_text
from formiga_bt.lang.site.libraries import library_folders

_CATALOGUE: Final = re.compile(r"^(types|actions)\s*:", re.MULTILINE)
_OTHER: Final = re.compile(r"^formiga_\w+\s*:", re.MULTILINE)
"""What trees, libraries of subtrees and sites begin with."""


class Files:
    """What an engine was made of, as far as its journal has it.

    Args:
        journal: of the site.
    """

    def __init__(self, journal: Journal) -> None:
        rows = journal.bundles()
        self._journal = journal
        self.rows: dict[tuple[str, str], BundleRow] = {(row.name, row.bundle): row for row in rows}
        self.of_site: BundleRow | None = next((row for row in rows if row.name == SITE_FILES), None)
        self._tasks: dict[tuple[str, str], Task | None] = {}
        self.catalogue: Catalogue = self._catalogue()
        self.site: Site = self._site(journal.site)

    def task(self, name: str, bundle: str) -> Task | None:
        """Return a version of a task; None: its files were not kept, or this version cannot read them."""
        key = (name, bundle)
        if key not in self.rows and key not in self._tasks:  # loaded since into an engine that runs
            self.rows = {(row.name, row.bundle): row for row in self._journal.bundles()}
        if key not in self._tasks:
            self._tasks[key] = self._read(self.rows.get(key))
        return self._tasks[key]

    def _read(self, row: BundleRow | None) -> Task | None:
        text = row.texts.get(row.file) if row is not None else None
        if row is None or text is None:
            return None
        loaded = load_task_text(
            text, row.file, catalogue=self.catalogue, site=self.site, folder_=Path(row.file).parent, read=Reading(row)
        )
        return replace(loaded.task, bundle=row.bundle) if loaded.task is not None else None

    def _catalogue(self) -> Catalogue:
        row = self.of_site
        texts = row.texts if row is not None else {}
        paths = [Path(one) for one, text in texts.items() if _CATALOGUE.search(text) and not _OTHER.search(text)]
        if row is not None and paths:
            libraries = library_folders(row.texts.get(row.file, ""), row.file)
            found, problems, _ = load_catalogue(paths, read=Reading(row), libraries=libraries)
            if not any(one.severity == "error" for one in problems):
                return found
        return load_catalogue(files("actions"))[0]

    def _site(self, name: str) -> Site:
        row = self.of_site
        text = row.texts.get(row.file, "") if row is not None else ""
        site = load_site_text(text, row.file, self.catalogue, on_disk=False)[0] if row is not None and text else None
        return site if site is not None else Site(name, 0.0, 0.0)


class Reading:
    """Reads a file among those that were kept: the very one, or one of the same name in a folder of the same name.

    Args:
        row: the files.
    """

    def __init__(self, row: BundleRow) -> None:
        self._texts = row.texts

    def __call__(self, path: Path) -> str:
        """Return its text.

        Raises:
            FileNotFoundError: it was not kept.
        """
        for last in (len(path.parts), 2):
            for one, text in self._texts.items():
                if Path(one).parts[-last:] == path.parts[-last:]:
                    return text
        raise FileNotFoundError(2, "it was not kept", str(path))
