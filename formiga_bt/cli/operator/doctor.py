"""`formiga doctor`: look a site and its machine over, before the engine starts or while it runs."""

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer
from msgspec import to_builtins

from formiga_bt.base.site_folder import FOLDER, read_address
from formiga_bt.base.visible import visible
from formiga_bt.cli.inputs import is_demo, read_world
from formiga_bt.cli.operator.checkup.finding import Checked, Patient, late, read_patient, run_checks, worst
from formiga_bt.cli.operator.checkup.table import CHECKS
from formiga_bt.cli.options import JsonOption
from formiga_bt.cli.ordering import EXIT_NO
from formiga_bt.cli.printing import print_json

MARKS = {"ok": "ok  ", "warn": "WARN", "fail": "FAIL"}


def command(
    site: Annotated[
        Path, typer.Option(help="Site file, or `demo` for the one that ships with formiga.", metavar="FILE")
    ] = Path("site.yaml"),
    http: Annotated[str, typer.Option(help="Where the API is to be served, as of `formiga up`.")] = "127.0.0.1:8420",
    strict: Annotated[bool, typer.Option("--strict", help="Exit with 1 for warnings, too.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Look a site over: its files, keys, libraries, clock, disks, journal, ports, and its engine if it runs.

    Nothing is changed, and no check takes longer than 10 s. Each finding says what, where, and how to mend it. Exit
    code 0: nothing fails; 1: something does.
    """
    patient = read_patient(lambda: _read(site, http))
    found = run_checks(CHECKS, patient) if patient is not None else [Checked("site", late(f"the site file {site}"))]
    level = worst(found)
    if as_json:
        told = [{"check": one.check, **to_builtins(one.finding)} for one in found]
        print_json({"site": str(site), "worst": level, "findings": told})
    else:
        _show(found)
    if level == "fail" or (strict and level == "warn"):
        raise typer.Exit(EXIT_NO)


def _read(site: Path, http: str) -> Patient:
    world = read_world([], site) if site.exists() or is_demo(site) else None
    beside = (Path() if is_demo(site) else site.parent).resolve()
    if world is not None and world.site is not None:
        runtime = beside / FOLDER / world.site.name
    else:  # of a site file that cannot be used, the folder may still tell
        there = sorted(one for one in (beside / FOLDER).glob("*") if one.is_dir())
        runtime = there[0] if len(there) == 1 else beside / FOLDER / "unknown"
    return Patient(site, http, runtime, world, read_address(runtime))


def _show(found: list[Checked]) -> None:
    for one in found:
        finding = one.finding
        where = f"   ({finding.where})" if finding.where else ""
        typer.echo(f"{MARKS[finding.level]}  {one.check:<8}  {visible(finding.what)}{where}")
        if finding.fix and finding.level != "ok":
            typer.echo(f"{'':16}help: {visible(finding.fix)}")
    count = Counter(one.finding.level for one in found)
    typer.echo(f"{count['ok']} ok, {count['warn']} to look at, {count['fail']} to mend")
