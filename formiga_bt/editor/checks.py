"""All checks of a file of any kind, as `formiga check` makes them, with what is visible at each step.

May take seconds for thousands of steps; changes nothing of the document. The server has it called in
a process of its own (`worker`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

from formiga_bt.base.diagnostics import Diagnostic
from formiga_bt.editor.grammar import is_ours
from formiga_bt.editor.project import Document, Project
from formiga_bt.editor.seen import Recorder, Seen
from formiga_bt.lang.any_file import check_rules
from formiga_bt.lang.catalogue import load_catalogue
from formiga_bt.lang.loader import load_library_text, load_task_text
from formiga_bt.lang.scenario import load_scenario_text
from formiga_bt.lang.site import load_site_text


@dataclass(frozen=True, slots=True)
class Checked:
    """What a check found: the problems of this file and of those that it reads, and what was visible."""

    version: int
    diagnostics: tuple[Diagnostic, ...]
    seen: Seen | None
    """None = the text could not be read; the last one holds."""


def check(project: Project, document: Document) -> Checked:
    """Check a file with all that it reads."""
    recorder = Recorder(str(document.path), document.lines)
    found = _problems(project, document, recorder)
    return Checked(document.version, tuple(found), recorder.seen() if recorder.entries else None)


def _problems(project: Project, document: Document, watch: Recorder) -> Sequence[Diagnostic]:
    path, text, file = document.path, document.text, str(document.path)
    if not is_ours(document.lines):
        return ()
    match document.kind:
        case "task" | "library":
            load = load_task_text if document.kind == "task" else load_library_text
            loaded = load(
                text,
                file,
                catalogue=project.catalogue(path),
                site=project.site_of(path),
                folder_=path.parent,
                read=project.read,
                watch=watch,
            )
            return loaded.diagnostics
        case "site":
            found = load_site_text(text, file, project.catalogue(path), read=project.read)[1]
            return [one for one in found if one.mark.file == file]  # those of its rules stand in their files
        case "rules":
            return check_rules(text, path, project.actions, project.read)
        case "catalogue":
            files = project.catalogue_files(path)
            known = path.resolve() in [one.resolve() for one in files]
            return load_catalogue(files if known else (*files, path), read=project.read)[1]
        case "scenario":
            folders = project.folders(path)
            return load_scenario_text(text, file, actions=project.actions, folders=folders).diagnostics
        case "test":
            from formiga_bt.rehearsal.cases.reading import load_cases_text  # it brings the engine with it

            folders = project.folders(path)
            return load_cases_text(text, file, actions=project.actions, folders=folders).diagnostics
