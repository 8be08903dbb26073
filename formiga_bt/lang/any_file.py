"""Any file of the language by what it says it is: a task, a library, a site, rules, a scenario, a catalogue.

Called by `formiga fix`, which checks a text that is not on disk yet.
"""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, Literal

from formiga_bt.base.diagnostics import Diagnostic, Mark
from formiga_bt.base.packaged import folder
from formiga_bt.lang.catalogue import load_catalogue
from formiga_bt.lang.compose import compose
from formiga_bt.lang.files import read_file
from formiga_bt.lang.loader import load_library_text, load_task_text
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.rules.keys import FOLDER as RULES
from formiga_bt.lang.scenario import load_scenario_text

Kind = Literal["task", "library", "site", "rules", "scenario", "catalogue", "other"]
"""`other`: a test, or a profile; no fixes are offered for them."""

_SIGNS: Final[tuple[tuple[Kind, str], ...]] = (
    ("other", "formiga_test|formiga_profile"),
    ("rules", "formiga_rules"),
    ("task", "task"),
    ("site", "formiga_site"),
    ("scenario", "scenario"),
    ("library", "subtrees"),
    ("catalogue", "types|actions"),
)


def kind_of(text: str) -> Kind:
    """Return what a text says it is; a task, if it says nothing that is known."""
    return said_kind(text) or "task"


def said_kind(text: str) -> Kind | None:
    """Return what a text says it is; None if it says nothing that is known."""
    for kind, keys in _SIGNS:
        if re.search(rf"^[\"']?(?:{keys})[\"']?[ \t]*:", text, re.MULTILINE):
            return kind
    return None


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
        case "rules":
            return check_rules(text, path, added)
        case "scenario":
            folders = (path.parent, folder("trees"))
            return load_scenario_text(text, file, actions=added, folders=folders).diagnostics
        case "catalogue":
            others = [other for other in actions if other.resolve() != path.resolve()]
            return load_catalogue([*others, path], read=lambda one: text if one == path else read_file(one))[1]
        case "other":
            return []
        case "library":
            found = load_library_text(text, file, catalogue=catalogue, site=site, folder_=path.parent).diagnostics
            return [one for one in found if one.mark.file == file]
        case _:
            return load_task_text(text, file, catalogue=catalogue, site=site, folder_=path.parent).diagnostics


def rules_of_site(path: Path, added: Sequence[Path] = ()) -> list[Diagnostic]:
    """Return the problems of the files of rules beside a site file."""
    beside = path.parent / RULES
    return [one for one in compose(path, added).diagnostics if Path(one.mark.file).parent == beside]


def check_rules(
    text: str, path: Path, added: Sequence[Path], read: Callable[[Path], str] = read_file
) -> list[Diagnostic]:
    """Return the problems of a file of rules: they are those of the site beside whose file its folder stands."""
    site = path.parent.parent / "site.yaml"
    if path.parent.name != RULES or not site.is_file():
        what = f"there is no {site}, so nothing can be said of these rules"
        return [Diagnostic("E008", Mark(str(path), 1, 1), what, "they stand in rules/ beside the site file, site.yaml")]

    def read_all(one: Path) -> str:
        return text if one == path else read(one)

    return [one for one in compose(site, added, read=read_all).diagnostics if one.mark.file == str(path)]
