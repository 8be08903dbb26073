"""The museum of mistakes, tests/lang_errors: how each file is read, which places of the checker it reaches, and what they say.

The first word of a file's name says what the file is (`IN`, `read`). A place is where a problem is reported (`ROOMS`): a call
with a code, such as `problems.add("E008", ...)`.
"""

import ast
import re
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

from formiga_bt.base.diagnostics import Diagnostic, in_order
from formiga_bt.base.wires import GROUP, WireKind, WireOption
from formiga_bt.lang.any_file import check_rules
from formiga_bt.lang.checks.deadlock import check_tasks
from formiga_bt.lang.compose import compose
from formiga_bt.lang.json_form.reading import load_task_json
from formiga_bt.lang.loader import load_catalogue, load_site, load_task, load_task_text
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.request.binding import bind_fields, bind_params
from formiga_bt.lang.request.profiles import load_profile
from formiga_bt.lang.request.value_files import ValueFile
from formiga_bt.lang.scenario import load_scenario
from formiga_bt.lang.text.document import parse
from formiga_bt.lang.text.reading import plain
from formiga_bt.rehearsal.cases.reading import load_cases

ROOT = Path(__file__).parents[3]
MUSEUM = ROOT / "tests" / "lang_errors"
CATALOGUES = [ROOT / "actions" / "base.yaml", MUSEUM / "catalogue" / "kite.yaml", MUSEUM / "catalogue" / "yard.yaml"]
FILES = sorted(
    path.relative_to(MUSEUM).as_posix()
    for each in ("*.yaml", "world_*/", "plays/*_*.yaml", "unreadable/*_*.yaml", "unreadable/world_*/", "cases/*.yaml")
    for path in MUSEUM.glob(each)
)
ROOMS = ("lang", "rehearsal/cases")
"""What reads files of people and reports what is wrong in them."""
CODE = re.compile(r"[EW]\d{3}")
MQTT = WireKind(
    name="mqtt",
    summary="By a broker.",
    guarantees=("goal_memory", "clearance", "cancel_confirmed"),
    make=f"{__name__}:nothing",
    options=(WireOption("broker", "Where it is."), WireOption("keep", "Whether it keeps.", "flag")),
    check=lambda given, mode: [("broker", "no port", "say HOST:PORT")] if ":" not in str(given.get("broker")) else [],
)
WIRES = EntryPoints(
    [
        EntryPoint("mqtt", f"{__name__}:MQTT", GROUP),
        EntryPoint("odd", "formiga_bt.base.wires:GROUP", GROUP),
        EntryPoint("gone", "no_such_module:KIND", GROUP),
        EntryPoint("alias", "formiga_bt.base.wires:ZENOH", GROUP),
    ]
)
"""Wires of packages, as if these were installed."""
Read = tuple[list[Diagnostic], Mapping[str, str]]


def read(name: str, catalogue: Catalogue) -> Read:
    """Return the problems of a file of the museum, which is the current folder, and the texts in which they stand."""
    path = Path(name)
    match _kind(name):
        case "site":
            _, found, sources = load_site(path, catalogue)
        case "world":  # with its catalogues and its rules
            world = compose(path / "site.yaml")
            found, sources = world.diagnostics, world.sources
        case "catalogue":
            _, found, sources = load_catalogue([path])
        case "rules":
            text = path.read_text(encoding="utf-8")
            found, sources = check_rules(text, path, CATALOGUES), {name: text}
        case "scenario" | "given":
            scenario = load_scenario(path, catalogue=catalogue)
            found, sources = scenario.diagnostics, scenario.sources
        case "test":
            cases = load_cases(path, catalogue=catalogue)
            assert cases.cases is None
            found, sources = cases.diagnostics, cases.sources
        case "profile":
            profile = load_profile(path)
            found, sources = profile.diagnostics, profile.sources
        case "json":
            told = load_task_json(path.read_text(encoding="utf-8"), catalogue=catalogue, name=name)
            found, sources = [one.diagnostic for one in told.problems], {name: told.yaml}
        case "request":
            found, sources = _request(path, catalogue)
        case "tasks":
            found, sources = _tasks(path, catalogue)
        case _:
            loaded = load_task(path, catalogue=catalogue, site=_site(name, catalogue))
            found, sources = loaded.diagnostics, loaded.sources
            assert (loaded.task is None) == any(d.severity == "error" for d in found)
    return found, sources


def _site(name: str, catalogue: Catalogue) -> Site | None:
    """Return the site of a task: `_of_hall` at the end of its name is catalogue/hall-site.yaml, `_of_site` the demo's."""
    _, of, word = name.removesuffix(".yaml").rpartition("_of_")
    file = ROOT / "trees" / "demo-site.yaml" if word == "site" else MUSEUM / "catalogue" / f"{word}-site.yaml"
    return load_site(file, catalogue)[0] if of and file.exists() else None


def _request(path: Path, catalogue: Catalogue) -> Read:
    """Read a task and, below `---`, what is given for its `params`, in which files, and as `fields` of an event."""
    task, _, given = path.read_text(encoding="utf-8").partition("\n---\n")
    loaded = load_task_text(task, str(path), catalogue=catalogue)
    site = load_site(ROOT / "trees" / "demo-site.yaml", catalogue)[0]
    assert loaded.task is not None
    assert site is not None
    node, _ = parse(given, "given")
    said: Any = plain(node) if node is not None else {}
    files = [
        ValueFile(file, Path(file).read_text(encoding="utf-8-sig"), param)
        for param, file in said.get("params_from", {}).items()
    ]
    _, found, sources = bind_params(loaded.task, said.get("params", {}), site, files=files)
    if "fields" in said:
        types = {name: param.type for name, param in loaded.task.params.items()}
        _, more, texts = bind_fields("the event 'seen'", types, said["fields"], site)
        return [*found, *more], {**sources, **texts}
    return found, sources


def _tasks(path: Path, catalogue: Catalogue) -> Read:
    """Read several tasks, which are checked together; they are divided by `---`."""
    pieces = path.read_text(encoding="utf-8").split("\n---\n")
    texts = {f"{path.stem}.{n}.yaml": piece for n, piece in enumerate(pieces, 1)}
    loaded = [load_task_text(text, file, catalogue=catalogue) for file, text in texts.items()]
    tasks = [one.task for one in loaded if one.task is not None]
    found = [problem for one in loaded for problem in one.diagnostics]
    return in_order([*found, *check_tasks(tasks, catalogue)]), texts


@dataclass(frozen=True)
class Place:
    """Where the checker reports a problem."""

    file: str
    line: int
    end: int
    code: str
    text: str

    def __str__(self) -> str:
        return f"{Path(self.file).relative_to(ROOT)}:{self.line}: {self.code}: {self.text[:150]}"


def places() -> list[Place]:
    """Return where problems of files are reported."""
    found = []
    for path in sorted(path for room in ROOMS for path in (ROOT / "formiga_bt" / room).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            codes = _codes(node)
            if codes:
                end = node.end_lineno or node.lineno
                found.append(Place(str(path), node.lineno, end, codes[0], ast.unparse(node)))
    return found


def _codes(node: ast.AST) -> list[str]:
    """Return the codes that a node reports."""
    if isinstance(node, ast.Assign) and isinstance(node.value, ast.Tuple):  # what is said of a name that is used later
        return [one for part in node.value.elts for one in _written(part)]
    if not isinstance(node, ast.Call):
        return []
    given = [*node.args, *(keyword.value for keyword in node.keywords)]
    codes = [code for part in given for code in _written(part)]
    bare = isinstance(node.func, ast.Name) and node.func.id == "ExprSyntax"  # E009 if it says nothing else
    return codes or (["E009"] if bare else [])


def _written(node: ast.expr) -> list[str]:
    if isinstance(node, ast.IfExp):
        return [*_written(node.body), *_written(node.orelse)]
    is_code = isinstance(node, ast.Constant) and isinstance(node.value, str) and CODE.fullmatch(node.value)
    return [str(node.value)] if is_code and isinstance(node, ast.Constant) else []


class Visits:
    """Which places were passed while it was entered, as `with`. What traced before goes on afterwards."""

    def __init__(self, of: Iterable[Place]) -> None:
        self._of: dict[tuple[str, int], list[Place]] = {}
        for place in of:
            for line in range(place.line, place.end + 1):
                self._of.setdefault((place.file, line), []).append(place)
        self.passed: set[Place] = set()
        self._watched: dict[CodeType, bool] = {}
        self._before: Any = None

    def __enter__(self) -> "Visits":
        self._before = sys.gettrace()
        sys.settrace(self._call)
        return self

    def __exit__(self, *_: object) -> None:
        sys.settrace(self._before)

    def _call(self, frame: FrameType, event: str, arg: object) -> Callable[..., Any] | None:
        code = frame.f_code
        if code not in self._watched:
            lines = {line for *_, line in code.co_lines() if line is not None}
            self._watched[code] = any((code.co_filename, line) in self._of for line in lines)
        return self._line if self._watched[code] else None

    def _line(self, frame: FrameType, event: str, arg: object) -> Callable[..., Any]:
        if event == "line":
            self.passed.update(self._of.get((frame.f_code.co_filename, frame.f_lineno), ()))
        return self._line


IN = {
    "task": "In a task",
    "tasks": "In tasks that are checked together",
    "json": "In a task in JSON form",
    "catalogue": "In a catalogue",
    "site": "In a site",
    "world": "In a site with what is beside it",
    "rules": "In rules",
    "scenario": "In a scenario",
    "test": "In a test file",
    "profile": "In a profile",
    "request": "In what a task is given",
    "given": "In what a task is given",
}
"""What the files of a kind are, in their order on the page of messages."""
HEAD = """\
# Messages of the checker

Each message under its code, once, and below it what helps, where something does. Names and numbers are those of examples.
`formiga explain E008` prints those of a code, below the page of that code in [errors.md](errors.md).

Written by `pytest tests/unit/lang/test_lang_errors.py --update-golden` from the files of `tests/lang_errors`: do not edit it.
"""
SAID = re.compile(
    r"^\S.*:\d+:\d+: (?P<code>[EW]\d{3}): (?P<message>.*)\n(?:(?!  help: ).+\n)*(?:  help: (?P<helps>.*))?",
    re.MULTILINE,
)
VARIES = re.compile(r"; did you mean .*|'[^']*'|\d[\d.,]*|true or false|\ban? (list of )?\w+( agent)?")
"""What differs from one message of a place to the next."""


def page_of_messages() -> str:
    """Return docs/messages.md, of the texts that are expected."""
    of: dict[str, dict[str, dict[tuple[str, str], tuple[str, str]]]] = {}
    for name in sorted(FILES, key=lambda name: list(IN).index(_kind(name))):
        text = expected(name).read_text(encoding="utf-8")
        for said in SAID.finditer(text):
            known = of.setdefault(said["code"], {})
            message, helps = said["message"], said["helps"] or ""
            alike = VARIES.sub("", message), VARIES.sub("", helps).partition(":")[0]
            if not any(alike in group for group in known.values()):
                known.setdefault(IN[_kind(name)], {})[alike] = message, helps
    parts = [HEAD]
    for code in sorted(of, key=lambda code: (code[1:], code)):
        parts.append(f"\n## {code}\n")
        for where, group in of[code].items():
            lines = "".join(f"{message}\n" + (f"    {helps}\n" if helps else "") for message, helps in group.values())
            parts.append(f"\n{where}:\n\n```text\n{lines}```\n")
    return "".join(parts)


def expected(name: str) -> Path:
    """Return the file with what is expected of a file of the museum."""
    return MUSEUM / f"{name.removesuffix('.yaml')}.expected.txt"


def _kind(name: str) -> str:
    word = "test" if name.endswith(".test.yaml") else Path(name).name.partition("_")[0]
    return word if word in IN else "task"
