"""A new beginning: what a journal has of a site is set aside under another name, and nothing of it is deleted."""

from pathlib import Path
from typing import Final

import sqlalchemy as sa

from formiga_bt.base.durable import move_aside
from formiga_bt.base.errors import JournalError, SiteError
from formiga_bt.journal import schema
from formiga_bt.journal.database import lock_file, mapped, read_url, writing
from formiga_bt.journal.files import all_of
from formiga_bt.journal.reading import sites_of
from formiga_bt.journal.store import Journal

MOST: Final = 10_000
"""So many beginnings are told apart by number."""


def set_aside(where: str, site: str, folder: Path) -> str:
    """Set aside what a journal has of a site, so that nothing of the site is in it any more.

    The files of an SQLite journal are moved, also damaged ones; of a database in which other sites are, the site's history gets
    another name there. Who is killed meanwhile says `--start-anew` once more.

    Args:
        where: path or URL of the journal.
        site: name of the site; no engine has it.
        folder: a journal that lies in it is moved into a folder of this one; any other one beside itself.

    Returns:
        Where it is now, for people; an empty text if there was nothing.

    Raises:
        SiteError: an engine writes the journal.
        JournalError: it cannot be set aside.
    """
    url = read_url(where)
    if url.get_backend_name() != "sqlite":
        return _renamed(where, site)
    file = Path(url.database or "")
    if any(one != site for one in _sites(where)):
        return _renamed(where, site)
    return _moved(file, folder)


def last_epoch(where: str, site: str) -> int:
    """Return the epoch of the last engine that wrote a journal; 0 if that cannot be known."""
    try:
        with Journal(where, site, read_only=True) as journal:
            return max((start.epoch for start in journal.starts()), default=0)
    except JournalError:
        return 0


def _sites(where: str) -> list[str]:
    """Return the sites in a file; none, if it cannot be read."""
    try:
        return sites_of(where)
    except JournalError:
        return []


def _moved(file: Path, folder: Path) -> str:
    locks = []
    try:
        for lock in sorted(
            file.parent.glob(f"{file.name}.*.lock")
        ):  # a file that cannot be read may have several sites
            taken = lock_file(lock)
            if taken is None:
                raise SiteError(f"an engine writes the journal {file} ({lock.name})", help="end it first: formiga down")
            locks.append(taken)
        own = file.parent.resolve() == folder.resolve()
        # The file first: a log without it is refused, but a file without its log would be believed.
        target = move_aside(all_of(file), "aside" if own else f"{file.name}.aside")
    finally:
        for release in locks:
            release()
    return str(target / file.name) if target is not None else ""


def _renamed(where: str, site: str) -> str:
    with Journal(where, site) as journal:
        if journal.number is None:
            return ""
        if not journal.hold():
            raise SiteError(
                f"an engine writes the journal of {site} in {journal.where}", help="end it first: formiga down"
            )
        name = schema.sites.c.name
        with mapped(journal.where), journal.database.engine.connect() as plain, writing(plain) as connection:
            names = set(connection.execute(sa.select(name)).scalars())
            new = next(f"{site}-aside-{n}" for n in range(1, MOST) if f"{site}-aside-{n}" not in names)
            connection.execute(sa.update(schema.sites).where(schema.sites.c.site == journal.number).values(name=new))
        return f"{journal.where}, as the site {new}"
