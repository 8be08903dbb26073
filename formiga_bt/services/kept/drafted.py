"""Which tasks a model wrote: `drafted.jsonl` in a site's runtime folder, a line for each, never changed and never removed.

A task is known again by what it does (`safety.meaning`) or by the line in its file (`safety.drafted`). Drafts may be removed
(`formiga drafts`); what they were stays in this file, for a copy of one may lie anywhere.

Called by whoever keeps a draft, by `Loading`, and by `formiga approve` and `formiga load`.
"""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final

from formiga_bt.base.site_folder import FOLDER, append_line, read_lines
from formiga_bt.lang.model import Task
from formiga_bt.safety.drafted import Drafted, merged, read, said_in, written
from formiga_bt.safety.meaning import meaning

LEDGER: Final = "drafted.jsonl"

Known = Mapping[str, Drafted]
"""Fingerprint -> who had it written."""


def note(runtime: Path, tasks: Iterable[Task], record: Drafted, *, draft: int = 0, unix_millis: int = 0) -> None:
    """Write down that a model wrote these tasks; on disk when this returns. What is known already is passed over.

    Raises:
        SiteError: the file cannot be written, or read.
    """
    known = known_of(runtime)
    for print_, task in {meaning(one): one for one in tasks}.items():
        if merged((known.get(print_), record)) != known.get(print_):
            line = {"meaning": print_, "task": task.name, **written(record)}
            append_line(runtime / LEDGER, {**line, "draft": draft, "unix_millis": unix_millis})


def known_of(runtime: Path) -> dict[str, Drafted]:
    """Return what a site's folder knows, by fingerprint.

    Raises:
        SiteError: the file cannot be read.
    """
    found: dict[str, Drafted] = {}
    for line in read_lines(runtime / LEDGER):
        one = merged((found.get(str(line.get("meaning", ""))), read(line)))
        if line.get("meaning") and one is not None:
            found[str(line["meaning"])] = one
    return found


def known_below(folder: Path) -> dict[str, Drafted]:
    """Return what all sites know whose runtime folders lie in a folder: a site may have got another name meanwhile."""
    found: dict[str, Drafted] = {}
    for file in sorted((folder / FOLDER).glob(f"*/{LEDGER}")):
        for key, one in known_of(file.parent).items():
            both = merged((found.get(key), one))
            assert both is not None
            found[key] = both
    return found


def who_drafted(task: Task, known: Known, texts: Iterable[str]) -> Drafted | None:
    """Return who had a model write a task, as its folder knows and its texts say; None: nobody did, as far as is known."""
    return merged((known.get(meaning(task)) if known else None, *map(said_in, texts)))


def texts_of(task: Task) -> list[str]:
    """Return the texts of a task and of what it imports besides what ships, as far as they can be read now."""
    texts = []
    for name in dict.fromkeys((task.mark.file, *(file for file in task.files if file.startswith("/")))):
        with suppress(OSError, UnicodeDecodeError):
            texts.append(Path(name).read_text(encoding="utf-8"))
    return texts
