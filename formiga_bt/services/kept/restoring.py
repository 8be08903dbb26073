"""A site is made of its backup, in a folder that has none: unpacked beside, checked, then given its names.

What was done after the backup the site does not know, but its machines do. So

* its next start has a higher epoch than any that they may follow, and ids go on far above those that may have been used. Both
  grow with the age of the backup, so that two sites made of one backup differ;
* `restored.json` stays in the runtime folder until the first start has journaled that all is HELD, under lockdown.
"""

import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from formiga_bt.base.bounds import MOST_EPOCH
from formiga_bt.base.clock import SECOND, wall_clock_us
from formiga_bt.base.durable import PRIVATE_FOLDER, make_private, sync_folder, write_durably
from formiga_bt.base.errors import SiteError
from formiga_bt.base.site_folder import COUNTERS, FOLDER, JOURNAL, RESTORED, UNKNOWN, UNKNOWN_EPOCHS, is_running
from formiga_bt.services.kept.archive import RUNTIME, SITE, Manifest, paths_of, read_manifest, reading, unpack

EPOCHS_BY_AGE: Final = 400
"""So many epochs are passed over for age at most: with `UNKNOWN_EPOCHS` less than agents take in one step."""
IDS_A_MINUTE: Final = 1000
"""More than a site uses."""


def restore(file: Path, into: Path) -> Manifest:
    """Make a site of a backup.

    Args:
        file: the backup.
        into: the folder of the site file; made if it is not there.

    Raises:
        SiteError: there is a site, or the backup is damaged; the folder is as it was.
        JournalError: the journal in it is damaged; the folder is as it was.
    """
    with reading(file) as archive:
        manifest = read_manifest(archive, file)
        _refuse_site(into, manifest)
        beside = into / f".formiga-restoring-{os.getpid()}"
        try:
            into.mkdir(parents=True, exist_ok=True)
            beside.mkdir(mode=PRIVATE_FOLDER)
            unpack(archive, manifest, beside, file)
            (beside / RUNTIME).mkdir(exist_ok=True)
            if (beside / RUNTIME / JOURNAL).exists():
                from formiga_bt.journal.copying import check_copy

                check_copy(beside / RUNTIME / JOURNAL)
            _renew(beside / RUNTIME, manifest, wall_clock_us())
            _name(beside, into, manifest)
        except OSError as error:
            raise SiteError(f"cannot write {error.filename or into}: {error.strerror or error}") from error
        finally:
            shutil.rmtree(beside, ignore_errors=True)
    return manifest


def _refuse_site(into: Path, manifest: Manifest) -> None:
    runtime = into / FOLDER / manifest.site
    if is_running(runtime):
        raise SiteError(f"an engine runs on the site {manifest.site} in {into}", help="formiga down first, then look")
    tops = {path.partition("/")[0] for path in paths_of(manifest, SITE)}
    there = [one for one in (runtime, *(into / top for top in sorted(tops))) if os.path.lexists(one)]
    if there:
        names = ", ".join(str(one) for one in there[:5])
        raise SiteError(
            f"there is something already: {names}; nothing was written",
            help="restore into an empty folder: --into FOLDER; a site is never written over",
        )


def _renew(runtime: Path, manifest: Manifest, now: int) -> None:
    """Have the next start pass over epochs and ids that may have been used since, and hold everything."""
    minutes = max(0, now - manifest.made) // (60 * SECOND)
    epoch = manifest.epoch + UNKNOWN_EPOCHS + min(minutes, EPOCHS_BY_AGE)
    write_durably(runtime / "epoch", f"{min(epoch, MOST_EPOCH - 1)}\n")
    marks = _marks(runtime / "marks.json")
    skipped = UNKNOWN + IDS_A_MINUTE * minutes
    counters = {name: int(marks.get("counters", {}).get(name, 0)) + skipped for name in COUNTERS}
    write_durably(runtime / "marks.json", json.dumps({"now_us": marks.get("now_us", 0), "counters": counters}) + "\n")
    about = {"restored_unix_millis": now // 1000, "backup_unix_millis": manifest.made // 1000, "epoch": manifest.epoch}
    write_durably(runtime / RESTORED, json.dumps(about) + "\n")
    make_private(runtime)
    runtime.chmod(PRIVATE_FOLDER)


def _marks(file: Path) -> Mapping[str, Any]:
    try:
        said = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return said if isinstance(said, dict) else {}


def _name(beside: Path, into: Path, manifest: Manifest) -> None:
    """Give all its names: the runtime folder first, the site file last, so that half a site never starts."""
    (into / FOLDER).mkdir(mode=PRIVATE_FOLDER, exist_ok=True)
    (beside / RUNTIME).rename(into / FOLDER / manifest.site)
    sync_folder(into / FOLDER)
    tops = sorted((beside / SITE).iterdir(), key=lambda one: one.name == manifest.site_file)
    for one in tops:
        one.rename(into / one.name)
    sync_folder(into)
