"""Profiles (`formiga_profile: 1`): named sets of parameter values, by task.

    formiga_profile: 1
    profile: paper-code
    description: The values of the published code where it differs from the text.
    tasks:
      Circle: {radius: 5 m}

A profile only fills in parameters that nobody gave; what it says passes the same checks as any other value. It is looked up by
name in `profiles/` beside the files in use and among the trees that ship, or named by its path.
"""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from formiga_bt.base.diagnostics import Diagnostic, Mark, in_order
from formiga_bt.base.packaged import folder
from formiga_bt.lang.keyed import Keys, check_version, read_root, text_of
from formiga_bt.lang.kinds import Option
from formiga_bt.lang.model import Task
from formiga_bt.lang.request.aliases import by_alias, given_params
from formiga_bt.lang.text.document import Entry, Mapping_, Scalar
from formiga_bt.lang.text.reading import Problems, did_you_mean, plain, read_mapping, read_name, shorten

PROFILE: Final = (
    Option("formiga_profile", "value", "Version of the format.", type="int", required=True),
    Option("profile", "text", "Its name.", required=True),
    Option("description", "text", "What it is for."),
    Option("tasks", "map", "Values of parameters, by task.", required=True),
)
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_-]*\Z")


@dataclass(frozen=True, slots=True)
class Profile:
    """A profile that was read."""

    name: str
    file: str
    tasks: Mapping[str, Mapping_]
    description: str = ""

    def texts(self, task: str) -> dict[str, str]:
        """Return its values for a task as the texts that a person would type; none if it says nothing of that task."""
        mapping = self.tasks.get(task)
        entries = mapping.entries if mapping is not None else ()
        return {
            one.key.text: one.value.text if isinstance(one.value, Scalar) else json.dumps(plain(one.value))
            for one in entries
        }

    def fill(self, task: Task, given: Iterable[str]) -> dict[str, str]:
        """Return the texts for those parameters of a task that are not given, under whatever alias.

        Args:
            task: whose parameters.
            given: the names that a person used.
        """
        named, taken = by_alias(task.params), given_params(task.params, given)
        return {
            name: text
            for name, text in self.texts(task.name).items()
            if (named[name].name if name in named else name) not in taken
        }

    def filled(self, task: Task, params: Mapping_ | None, mark: Mark) -> Mapping_:
        """Return the written parameters with the profile's entries for those that are missing."""
        entries: tuple[Entry, ...] = params.entries if params is not None else ()
        missing = self.fill(task, [entry.key.text for entry in entries])
        more = self.tasks[task.name].entries if missing else ()
        return Mapping_((*entries, *(one for one in more if one.key.text in missing)), mark)


@dataclass(frozen=True, slots=True)
class LoadedProfile:
    """What became of a profile file; `profile` is None if there is any error."""

    profile: Profile | None
    diagnostics: list[Diagnostic]
    sources: Mapping[str, str] = field(default_factory=dict)


def known_profiles(folders: Sequence[Path] = ()) -> dict[str, Path]:
    """Return the profiles in `profiles/` of these folders and of the trees that ship, by name; the first one counts."""
    found: dict[str, Path] = {}
    for place in (*folders, folder("trees")):
        for path in sorted((place / "profiles").glob("*.yaml")):
            found.setdefault(path.stem, path)
    return found


def profile_file(word: str, folders: Sequence[Path] = ()) -> Path | None:
    """Return the file that a word names: a profile's name, or a path; None if there is none."""
    path = Path(word)
    return known_profiles(folders).get(word) or (path if path.is_file() else None)


def load_profile(path: Path) -> LoadedProfile:
    """Read a profile file; whether its tasks have such parameters is looked at where it is used."""
    problems = Problems()
    text = text_of(path, problems)
    if text is None:
        return LoadedProfile(None, problems.found)
    file, begin = str(path), "formiga_profile: 1"
    keys = read_root(text, file, PROFILE, problems, what="profile", owner="a profile", begin=begin)
    profile = _read(keys, file) if keys is not None else None
    return LoadedProfile(None if problems.has_errors() else profile, in_order(problems.found), {file: text})


def _read(keys: Keys, file: str) -> Profile:
    check_version(keys, "formiga_profile", "this profile needs")
    name, problems = keys.text("profile"), keys.problems
    if name is not None and not _NAME.match(name.text):
        keys.wrong("profile", "E008", f"'{shorten(name.text)}' cannot be a profile's name", "letters, digits, - and _")
    tasks: dict[str, Mapping_] = {}
    for entry in keys.entries("tasks"):
        at, values = read_name(entry.key, problems, "task"), read_mapping(entry.value, problems, entry.key.text)
        if at is not None and values is not None:
            tasks[at.text] = values
    return Profile(name.text if name is not None else "", file, tasks, keys.word("description"))


def unknown_profile(word: str, folders: Sequence[Path] = ()) -> str:
    """Return what to say of a profile that there is none of."""
    known = sorted(known_profiles(folders))
    return f"no profile '{shorten(word)}'{did_you_mean(word, known)}; profiles: {', '.join(known) or 'none'}"
