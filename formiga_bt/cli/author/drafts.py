"""`formiga drafts`: the tasks that models wrote and that wait for a person, in the site's folder."""

import time
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from formiga_bt.base.visible import visible
from formiga_bt.cli.inputs import UnusableFile, is_demo, readable, site_file
from formiga_bt.cli.options import JsonOption, print_table
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.show.clean import cleaned

if TYPE_CHECKING:
    from formiga_bt.llm.drafts import Brief, KeptDraft

WIDEST = 60
"""Columns of a request in the list."""


class DraftsCommand(StrEnum):
    """What is done."""

    LIST = "list"
    SHOW = "show"
    DELETE = "delete"


def command(
    what: Annotated[
        DraftsCommand, typer.Argument(help="list, show or delete.", show_default=False)
    ] = DraftsCommand.LIST,
    numbers: Annotated[
        list[int] | None, typer.Argument(help="With show, delete: numbers of drafts.", metavar="N")
    ] = None,
    older_than: Annotated[
        str,
        typer.Option(help="With delete: all that are older and that nobody approved, for example 30d.", metavar="TIME"),
    ] = "",
    site: Annotated[
        Path | None,
        typer.Option(help="Site file. Default: site.yaml of this folder, else the demo site.", metavar="FILE"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """List, show and delete drafts: tasks that `formiga draft` or an assistant left for a person.

    What was started from a draft goes on without it. That a model wrote a task is known after its draft is gone, too.
    Exit code 2: the command line or a file cannot be used.
    """
    given = list(numbers or [])
    if older_than and what is not DraftsCommand.DELETE:
        raise UnusableFile("--older-than goes with delete: formiga drafts delete --older-than 30d")
    if what is DraftsCommand.LIST and given:
        raise UnusableFile(f"say: formiga drafts show {given[0]}")
    if what is DraftsCommand.SHOW and not given:
        raise UnusableFile("formiga drafts show needs the number of a draft", help="formiga drafts lists them")
    folder = _folder(site)
    if what is DraftsCommand.LIST:
        _list(folder, as_json=as_json)
    elif what is DraftsCommand.SHOW:
        _show(folder, given, as_json=as_json)
    else:
        _delete(folder, given, older_than, as_json=as_json)


def _folder(site: Path | None) -> Path:
    from formiga_bt.base.packaged import folder
    from formiga_bt.lang.compose import compose
    from formiga_bt.llm.drafts import drafts_folder

    here = Path("site.yaml")
    named = site or (here if here.is_file() else None)
    path = None if named is None or is_demo(named) else readable(site_file(named))
    found = compose(path or folder("trees") / "demo-site.yaml").site
    if found is None:
        raise UnusableFile(f"{path} has errors", help=f"formiga check {path}")
    return drafts_folder(path, found.name)


def _list(folder: Path, *, as_json: bool) -> None:
    from formiga_bt.llm.drafts import briefs

    found = briefs(folder)
    if as_json:
        print_json([visible(_as_json(one)) for one in found])
        return
    if not found:
        typer.echo(f"there are no drafts in {folder}")
        show_next("formiga draft REQUEST")
        return
    rows = [
        (str(one.number), cleaned(one.task) or one.kind, _age(one.origin.unix_millis), _words(one), cleaned(one.origin.by),
         _short(one.origin.request))
        for one in found
    ]  # fmt: skip
    print_table([("N", "TASK", "AGE", "STANDS", "BY", "REQUEST"), *rows])
    show_next(
        f"formiga drafts show {found[-1].number}", "formiga drafts delete N", "formiga drafts delete --older-than 30d"
    )


def _words(one: "Brief") -> str:
    if one.origin.approved_by:
        return f"run by {cleaned(one.origin.approved_by)}"
    return "waits" if one.kind == "task" else one.kind


def _short(text: str) -> str:
    line = cleaned(" ".join(text.split()))
    return line if len(line) <= WIDEST else line[: WIDEST - 3] + "..."


def _age(unix_millis: int) -> str:
    if not unix_millis:
        return "-"
    seconds = max(0, int(time.time()) - unix_millis // 1000)
    for size, unit in ((86_400, "d"), (3_600, "h"), (60, "min")):
        if seconds >= size:
            return f"{seconds // size} {unit}"
    return f"{seconds} s"


def _as_json(one: "Brief") -> dict[str, Any]:
    from msgspec import to_builtins

    return {
        "number": one.number, "kind": one.kind, "task": one.task, "folder": str(one.folder), **to_builtins(one.origin)
    }  # fmt: skip


def _show(folder: Path, given: list[int], *, as_json: bool) -> None:
    from formiga_bt.llm.drafts import read_draft

    found = [read_draft(folder, number) for number in given]
    if as_json:
        from msgspec import to_builtins

        told = (
            [
                {"number": one.number, "kind": one.draft.kind, "task": one.draft.task, "yaml": one.draft.yaml,
                 "say": one.draft.say, "folder": str(one.folder), **to_builtins(one.origin)}
                for one in found
            ]
        )  # fmt: skip
        print_json(visible(told))
        return
    for one in found:
        typer.echo("\n".join(_lines(one)))


def _lines(one: "KeptDraft") -> list[str]:
    from formiga_bt.services.crew import utc

    draft, origin = one.draft, one.origin
    when = utc(origin.unix_millis * 1000) if origin.unix_millis else ""
    rounds = f"{origin.rounds} answer{'' if origin.rounds == 1 else 's'}"
    rows = {
        "request": cleaned(" ".join(origin.request.split())),
        "asked by": cleaned(origin.by) + (f", {when}" if when else ""),
        "model": cleaned(f"{origin.provider} {origin.model}".strip()) + f", {rounds}",
        "came to": cleaned(f"{draft.kind} {draft.task}".strip() + (f": {draft.say}" if draft.say else "")),
        "run by": f"{cleaned(origin.approved_by)}, as version {origin.bundle[:8]}"
        if origin.approved_by
        else "nobody yet",
        "file": f"{one.folder}/task.yaml",
    }
    text = [cleaned(line) for line in draft.yaml.rstrip("\n").split("\n")]
    return [f"draft {one.number}", *(f"  {name:<9} {said}" for name, said in rows.items()), "", *text, ""]


def _delete(folder: Path, given: list[int], older_than: str, *, as_json: bool) -> None:
    from formiga_bt.llm.drafts import briefs, delete, read_draft

    if bool(given) == bool(older_than):
        raise UnusableFile("say which: formiga drafts delete N ...    or: formiga drafts delete --older-than 30d")
    kept = 0
    if older_than:
        before = int(time.time() * 1000) - _millis(older_than)
        old = [one for one in briefs(folder) if 0 < one.origin.unix_millis < before]
        given = [one.number for one in old if not one.origin.approved_by]
        kept = len(old) - len(given)
    else:
        from formiga_bt.llm.drafts import numbers

        gone = [number for number in given if number not in numbers(folder)]
        if gone:
            read_draft(folder, gone[0])  # says which there are; nothing was removed yet
    for number in dict.fromkeys(given):
        delete(folder, number)
    if as_json:
        print_json({"deleted": list(dict.fromkeys(given)), "kept": kept})
        return
    many = len(dict.fromkeys(given))
    note = f"; {kept} that {'was' if kept == 1 else 'were'} run {'stays' if kept == 1 else 'stay'}" if kept else ""
    typer.echo(f"{many} draft{'' if many == 1 else 's'} deleted{note}")


def _millis(text: str) -> int:
    from formiga_bt.base.units import parse_quantity

    amount = parse_quantity(text)
    if amount is None or amount[0] != "duration" or amount[1] < 0:
        raise UnusableFile(f"--older-than {text}: say a time with its unit, such as 30d or 12h")
    return int(amount[1] * 1000)
