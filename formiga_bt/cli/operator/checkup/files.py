"""Checks of files: the site's own, and those of its runtime folder."""

import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from formiga_bt.base.diagnostics import Diagnostic
from formiga_bt.base.durable import PRIVATE_FILE, PRIVATE_FOLDER, open_to_others
from formiga_bt.base.unusable_files import unusable
from formiga_bt.cli.inputs import find_tasks, is_demo, read_task
from formiga_bt.cli.operator.checkup.finding import Finding, Patient
from formiga_bt.cli.operator.up import gaps

SECRET: Final = frozenset({"accounts.json", "secrets.json", "token"})
"""Whoever reads one of these can speak for others, or try to. What else is there the folder's own mode protects."""


def site(patient: Patient) -> Iterator[Finding]:
    """Check the site file and its catalogues."""
    world = patient.world
    if world is None or (world.site is None and not world.diagnostics):
        name = patient.site
        yield Finding(
            "fail", f"there is no site file {name}", str(name), "make one: formiga init; or name it: --site FILE"
        )
        return
    yield from (_of(one) for one in world.diagnostics)
    if world.site is not None:
        for gap in gaps(world.site, 1.0):
            text, _, fix = gap.partition("\n  help: ")
            yield Finding("warn", text, str(patient.site), fix)


def _of(one: Diagnostic) -> Finding:
    return Finding("fail" if one.severity == "error" else "warn", f"{one.code}: {one.message}", str(one.mark), one.help)


def tasks(patient: Patient) -> Iterator[Finding]:
    """Check the task files: one with an error is not served."""
    own = Path("trees") if is_demo(patient.site) else patient.site.parent / "trees"
    world = patient.world
    if world is None or not own.is_dir():
        return
    for path in find_tasks([own], may_be_empty=True).tasks:
        errors = [one for one in read_task(path, world).diagnostics if one.severity == "error"]
        if errors:
            more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
            what = f"{path} is not served: {errors[0].code}: {errors[0].message}{more}"
            yield Finding("warn", what, str(errors[0].mark), f"formiga check {path}")


def private(patient: Patient) -> Iterator[Finding]:
    """Check the runtime folder: what is in it can be used, and nobody else can read it."""
    folder = patient.runtime
    if not folder.exists():
        yield Finding("ok", "the site was not started here yet: there is no runtime folder", str(folder))
        return
    for name, why in unusable(folder).items():
        yield Finding("fail", why, str(folder / name), "put it back; else the next start sets it aside")
    owner = folder.stat().st_uid
    if owner != os.geteuid():
        yield Finding(
            "warn", f"it belongs to user {owner}, and this is user {os.geteuid()}", str(folder), "run as its owner"
        )
    if _is_open(folder):
        yield _opened(folder, PRIVATE_FOLDER)
    for path in sorted(folder.iterdir()):
        if path.name in SECRET and _is_open(path):
            yield _opened(path, PRIVATE_FILE)


def _opened(path: Path, right: int) -> Finding:
    mode = stat.S_IMODE(path.stat().st_mode)
    return Finding("fail", f"others may read or write it: its mode is {mode:o}", str(path), f"chmod {right:o} {path}")


def _is_open(path: Path) -> bool:
    try:
        found = path.lstat()
    except OSError:  # it has gone meanwhile
        return False
    return not stat.S_ISLNK(found.st_mode) and open_to_others(found)
