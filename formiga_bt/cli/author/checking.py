"""What `formiga check` does, and its plain command lines read without the library that reads the others.

`check` runs at every save of an editor and in every commit hook. Importing the command line library takes as long as
checking a task, so `quick` understands the usual words by itself and leaves the rest (`--help`, mistakes) to
`cli.author.check`.
"""

import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Literal

from formiga_bt.base.diagnostics import Diagnostic, in_order
from formiga_bt.base.near_site import SITE_FILE
from formiga_bt.cli.inputs import (
    CheckWorld,
    FoundFiles,
    UnusableFile,
    added_catalogues,
    find_tasks,
    near,
    read_task,
    read_world,
    rendered,
)

Form = Literal["text", "json", "sarif", "github"]

_OTHER: Final = re.compile(r"^[\"']?(?:formiga_(?:site|rules|test|profile)|scenario)[\"']?[ \t]*:", re.MULTILINE)
_PARTS: Final = re.compile(r"^[\"']?(?:types|actions|subtrees)[\"']?[ \t]*:", re.MULTILINE)
_TASK: Final = re.compile(r"^[\"']?(?:task|steps)[\"']?[ \t]*:", re.MULTILINE)
"""What files say that they are (`lang.any_file` says it too, but it is too slow to import for a task)."""

FORMS: Final[tuple[Form, ...]] = ("json", "sarif", "github")


def check(files: Sequence[Path], site: Path | None, actions: Sequence[Path], *, strict: bool, form: Form) -> int:
    """Check files, print what was found, and return the exit code: 0 usable, 1 refused.

    Raises:
        UnusableFile: a file cannot be read.
    """
    given = find_tasks(files, may_be_empty=True)
    beside, left = _beside(files, given)
    if not given.tasks and not beside:
        find_tasks(files)  # says what is there instead
    added = added_catalogues(actions)
    found: list[Diagnostic] = []
    sources: dict[str, str] = {}
    paths = [*given.tasks, *beside]
    for world, mine in _worlds(paths, site, actions):
        found += world.diagnostics
        sources.update(world.sources)
        tasks = []
        for path in mine:
            if path in beside or is_other(path):
                problems, texts = _other(path, world, added)
            else:
                read = read_task(path, world)
                problems, texts = read.diagnostics, read.sources
                tasks += [read.task] if read.task is not None else []
            found += problems
            sources.update(texts)
        if len(tasks) > 1:
            from formiga_bt.lang.checks.deadlock import check_tasks

            found += check_tasks(tasks, world.catalogue)
    given = FoundFiles(paths, left)
    problems = in_order(found)
    errors = sum(d.severity == "error" for d in problems)
    warnings = len(problems) - errors
    refused = errors > 0 or (strict and warnings > 0)
    closing = _closing(len(paths), errors, warnings, refused) + (f"; {given.note}" if given.note else "")
    if form == "text":
        for text in rendered(problems, sources):
            print(text + "\n")
        print(closing)
        return int(refused)
    head: dict[str, Any] = {"ok": not refused, "files": len(paths), "errors": errors, "warnings": warnings}
    head["no_tasks"] = [str(path) for path in given.others]
    print(_report(form, problems, head, closing))
    return int(refused)


def _worlds(
    paths: Sequence[Path], site: Path | None, actions: Sequence[Path]
) -> Iterator[tuple[CheckWorld, Sequence[Path]]]:
    """Iterate over what files are checked against, each with its files.

    Without a site that was named those are the catalogues and libraries of the site near each file, else of the one here.
    """
    if site is not None:
        yield read_world(actions, site), paths
        return
    files: dict[Path, list[Path]] = {}
    sites = {folder: near(folder / SITE_FILE) for folder in dict.fromkeys(path.parent for path in paths)}
    for path in paths:
        files.setdefault(sites[path.parent], []).append(path)
    for one, mine in files.items():
        yield read_world(actions, near=one), mine


def _beside(files: Sequence[Path], given: FoundFiles) -> tuple[list[Path], list[Path]]:
    """Return the libraries, sites, catalogues, rules, scenarios, tests and profiles of folders, and what is none of them."""
    tests = [path for folder in files if folder.is_dir() for path in sorted(folder.rglob("*.test.y*ml"))]
    if not given.others and not tests:
        return [], []
    from formiga_bt.lang.any_file import said_kind

    found = {path: path.is_file() and said_kind(read_quietly(path)) is not None for path in (*given.others, *tests)}
    return [path for path, known in found.items() if known], [path for path, known in found.items() if not known]


def read_quietly(path: Path) -> str:
    """Return the text of a file, an empty one if it cannot be read."""
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return ""


def is_other(path: Path) -> bool:
    """Return whether a file says that it is a library, a site, rules, a catalogue, a scenario, a test or a profile."""
    text = read_quietly(path)
    return _OTHER.search(text) is not None or (_PARTS.search(text) is not None and _TASK.search(text) is None)


def _other(path: Path, world: CheckWorld, actions: Sequence[Path]) -> tuple[Sequence[Diagnostic], Mapping[str, str]]:
    """Return the problems of a file that is no task, and the texts that they stand in."""
    text = path.read_text(encoding="utf-8")
    if re.search(r"^[\"']?formiga_test[\"']?[ \t]*:", text, re.MULTILINE):
        from formiga_bt.rehearsal.cases.reading import load_cases

        cases = load_cases(path, actions=actions)
        return cases.diagnostics, cases.sources
    if re.search(r"^[\"']?formiga_profile[\"']?[ \t]*:", text, re.MULTILINE):
        from formiga_bt.lang.request.profiles import load_profile

        profile = load_profile(path)
        return profile.diagnostics, profile.sources
    from formiga_bt.lang.any_file import check_text, kind_of, rules_of_site

    known = [d for d in world.diagnostics if d.mark.file == str(path)]
    found = check_text(text, path, world.catalogue, world.actions, world.site, added=actions)
    if kind_of(text) == "site":
        found = [*found, *rules_of_site(path, actions)]
    return [one for one in found if one not in known], {str(path): text}


def _report(form: Form, problems: list[Diagnostic], head: dict[str, Any], closing: str) -> str:
    from formiga_bt.cli.author.reports import as_github, as_json, as_sarif

    if form == "json":
        return as_json(problems, head)
    if form == "github":
        return "\n".join([*map(as_github, problems), closing])
    from formiga_bt.lang.pages import summaries

    return as_sarif(problems, summaries())


def _closing(files: int, errors: int, warnings: int, refused: bool) -> str:
    verdict = "refused" if refused else "ok"
    return f"{verdict}: {_count(files, 'file')}, {_count(errors, 'error')}, {_count(warnings, 'warning')}"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def quick(words: Sequence[str]) -> int | None:
    """Carry out a plain command line of `check`; None if `cli.author.check` is to read it.

    Args:
        words: what follows `check`.
    """
    files: list[Path] = []
    actions: list[Path] = []
    site: Path | None = None
    strict = False
    form: Form = "text"
    rest = iter(words)
    for word in rest:
        name, is_joined, value = word.partition("=")
        if word == "--strict":
            strict = True
        elif word.removeprefix("--") in FORMS and form == "text" and word.startswith("--"):
            form = next(one for one in FORMS if word == f"--{one}")
        elif name in ("--site", "--actions"):
            path = value if is_joined else next(rest, "")
            if not path or path.startswith("-"):
                return None
            if name == "--actions":
                actions.append(Path(path))
            elif site is None:
                site = Path(path)
            else:
                return None
        elif word.startswith("-") or not word:
            return None
        else:
            files.append(Path(word))
    if not files:
        return None
    try:
        return check(files, site, actions, strict=strict, form=form)
    except UnusableFile as error:
        print(f"formiga: {error}", file=sys.stderr)
        return 2
