"""Any file of the language by what it says it is: a task, a library, a site, a scenario, a catalogue.

Called by `formiga fix`, which checks a text that is not on disk yet.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal

from formiga_bt.base.diagnostics import Diagnostic
from formiga_bt.base.packaged import folder
from formiga_bt.lang.catalogue import load_catalogue
from formiga_bt.lang.compose import compose
from formiga_bt.lang.files import read_file
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.scenario import load_scenario_text

Kind = Literal["task", "library", "site", "scenario", "catalogue", "other"]
"""`other`: a test, or a profile; no fixes are offered for them."""

_SIGNS: Final[tuple[tuple[Kind, str], ...]] = (
    ("other", "formiga_test|formiga_profile"),
    ("task", "task"),
    ("site", "formiga_site"),
    ("scenario", "scenario"),
    ("library", "subtrees"),
    ("catalogue", "types|actions"),
)


def kind_of(text: str) -> Kind:
    """Return what a text says it is; a task, if it says nothing that is known."""
    for kind, keys in _SIGNS:
        if re.search(rf"^[\"']?(?:{keys})[\"']?[ \t]*:", text, re.MULTILINE):
            return kind
    return "task"


def check_text(
    text: str,
    path: Path,
    catalogue: Catalogue,
    actions: Sequence[Path],
    site: Site | None,
    *,
    added: Sequence[Path] = (),
) -> list[Diagnostic]:
    """Return the problems of a file with this text.

    Args:
        text: of the file.
        path: its name, and where its imports are looked up.
        catalogue: agent types and actions.
        actions: the files of that catalogue.
        site: where tasks are to run.
        added: catalogue files that count beside those that a site names.
    """
    file = str(path)
    match kind_of(text):
        case "site":
            return [one for one in compose(path, added, text=text).diagnostics if one.mark.file == file]
        case "scenario":
            folders = (path.parent, folder("trees"))
            return load_scenario_text(text, file, actions=added, folders=folders).diagnostics
        case "catalogue":
            others = [other for other in actions if other.resolve() != path.resolve()]
            return load_catalogue([*others, path], read=lambda one: text if one == path else read_file(one))[1]
        case "other":
            return []
        case "library":
            return _of_library(text, path, catalogue)
        case _:
            return load_task_text(text, file, catalogue=catalogue, site=site, folder_=path.parent).diagnostics


def _of_library(text: str, path: Path, catalogue: Catalogue) -> list[Diagnostic]:
    """Return the problems of a library: it is read as the task that it would be with a name and a step."""
    task = f"{text.rstrip()}\ntask: Library\nsteps:\n  - wait: 1 s\n"
    found = load_task_text(task, str(path), catalogue=catalogue, folder_=path.parent).diagnostics
    return [d for d in found if d.code != "W060" and d.mark.line <= text.rstrip().count("\n") + 1]
