"""From a model's answer to a judged task: JSON form, mends, YAML file, checker, dry run, comparison with the request.

The file is written by us. Nothing of an answer is carried out; all that becomes of it is a tree in the language, which has
passed the same checker as any other file, or a list of what is wrong with it.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from formiga_bt.lang.json_form.reading import to_yaml
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Task
from formiga_bt.lang.text.formatting import format_text
from formiga_bt.llm.envelope import Form, ModelAnswer
from formiga_bt.llm.judging.answers import answers, hangs_on_answer
from formiga_bt.llm.judging.compare import OF_CHANGES, compare
from formiga_bt.llm.judging.outcome import fly, from_diagnostic, of_flight
from formiga_bt.llm.records import ParamValue, RehearsedFlight, Shortfall
from formiga_bt.llm.shaping.lifting import ASSUMED, Lifter
from formiga_bt.llm.shaping.mends import mended
from formiga_bt.llm.shaping.short import ShortError, expanded
from formiga_bt.llm.vocabulary import LIBRARIES, AgentVerb
from formiga_bt.llm.words.wording import Words
from formiga_bt.llm.world import RequestWorld
from formiga_bt.safety.drafted import unlike_a_stamp

FILE: Final = "draft.yaml"
MOST_DESCRIPTION: Final = 200


@dataclass(frozen=True, slots=True)
class Judged:
    """What an answer is worth."""

    task: Task | None
    yaml: str
    values: tuple[ParamValue, ...]
    shortfalls: tuple[Shortfall, ...]
    flight: RehearsedFlight | None = None
    mends: tuple[str, ...] = ()

    @property
    def errors(self) -> int:
        """Return how many of its shortfalls are errors."""
        return sum(one.severity == "error" for one in self.shortfalls)


def judge(
    answer: ModelAnswer,
    words: Words,
    world: RequestWorld,
    verbs: Mapping[str, AgentVerb],
    form: Form,
    *,
    credit: str = "",
    compared: Words | None = None,
    is_change: bool = False,
    edited: tuple[str, ...] = (),
) -> Judged:
    """Judge an answer that holds a tree.

    Args:
        answer: as read.
        words: all that was asked for so far: where values come from.
        world: where it is to be flown.
        verbs: the vocabulary.
        form: of the tree.
        credit: who wrote it, for the head of the file.
        compared: the request that the task is compared with; None = none.
        is_change: `compared` changes an earlier request, so that it does not say everything.
        edited: what a program edited in the answer, in words; see `nearby`.
    """
    assert answer.tree is not None
    try:
        data, notes, values, added = _data(answer, words, world, verbs, form)
    except ShortError as error:
        return Judged(None, "", (), (Shortfall("form", str(error), error.path),), None, edited)
    fixed = mended(data, world)
    problems = [from_diagnostic(p.path, p.diagnostic) for p in fixed.loaded.problems]
    problems += _foreign_imports(fixed.data, verbs)
    mends = (*edited, *added, *fixed.done)
    if fixed.loaded.task is None or any(p.severity == "error" for p in problems):
        return Judged(None, fixed.loaded.yaml, values, tuple(problems), None, mends)
    values = (*values, *_more_values(fixed.data, values, words))
    text = _file(fixed.data, notes, words.said, answer.plan, mends, credit)
    loaded = load_task_text(text, FILE, catalogue=world.catalogue, site=world.site, library=world.folders)
    if loaded.task is None:  # our own comments broke it: the plain file then
        text = fixed.loaded.yaml
        task = fixed.loaded.task
    else:
        task = loaded.task
    if task.requests:
        problems.append(Shortfall("requests", "a drafted task may not start other tasks", help="write their steps"))
        return Judged(None, text, values, tuple(problems), None, mends)
    flight = fly(task, world)
    problems += of_flight(flight)
    if compared is not None:
        found = compare(compared, task, text, flight, world)
        problems += [one for one in found if one.code in OF_CHANGES] if is_change else found
        if not is_change and flight.status == "SUCCEEDED" and flight.asked and hangs_on_answer(compared, text):
            problems += answers(flight, fly(task, world, says="no"))
    return Judged(task, text, values, tuple(problems), flight, mends)


def _data(
    answer: ModelAnswer, words: Words, world: RequestWorld, verbs: Mapping[str, AgentVerb], form: Form
) -> tuple[dict[str, Any], Mapping[str, str], tuple[ParamValue, ...], tuple[str, ...]]:
    description = " ".join(words.said.split("\n")[0].split())[:MOST_DESCRIPTION].replace("${", "{")
    assert answer.tree is not None
    if form == "short":
        lifter = Lifter(words, world.site)
        made = expanded(answer.tree, world, verbs, lifter)
        first, kept = made.data.pop("version"), answer.tree.get("version")  # kept: of the task that is changed
        version = kept if isinstance(kept, str) and kept else first
        head = {"task": made.data.pop("task"), "version": version, "description": description}
        return head | made.data, made.notes, lifter.values(), tuple(made.added)
    data = {key: value for key, value in answer.tree.items() if value is not None}
    head = {"task": data.pop("task", "Drafted"), "description": data.pop("description", description)}
    claimed = {one["name"]: one["words"] for one in answer.run}
    values = []
    notes = {}
    params = data.get("params")
    for index, param in enumerate(params if isinstance(params, list) else ()):
        if isinstance(param, dict) and isinstance(param.get("name"), str):
            text = _plain(param.get("default"))
            said = words.holds(claimed.get(param["name"], "")) or _said(words, text)
            values.append(ParamValue(param["name"], text, said))
            notes[f"$.params[{index}]"] = f'"{said}"' if said else ASSUMED
    return head | data, notes, tuple(values), ()


def _plain(default: Any) -> str:
    if isinstance(default, dict) and len(default) == 1:
        inner = next(iter(default.values()))
        if isinstance(inner, dict):
            return ",".join(str(one) for one in inner.values())
        return str(inner)
    return "" if default is None else str(default)


def _said(words: Words, text: str) -> str:
    from formiga_bt.base.units import parse_quantity

    amount = parse_quantity(text)
    if amount is not None:
        return words.amount(*amount)
    if re.fullmatch(r"\d+(?:\.\d+)?", text):
        return words.number(float(text))
    return words.places.get(text, "") or words.agents.get(text, "")


def _more_values(data: Mapping[str, Any], known: tuple[ParamValue, ...], words: Words) -> list[ParamValue]:
    """Return the values of params that a mend added."""
    names = {one.name for one in known}
    return [
        ParamValue(param["name"], _plain(param.get("default")), _said(words, _plain(param.get("default"))))
        for param in data.get("params", ())
        if param["name"] not in names
    ]


def _foreign_imports(data: Mapping[str, Any], verbs: Mapping[str, AgentVerb]) -> list[Shortfall]:
    known = {*LIBRARIES, *(verb.library for verb in verbs.values())}
    imports = data.get("imports") or ()
    legal = "only " + ", ".join(sorted(known - {""}))
    return [
        Shortfall("import", f"'{one}' may not be imported", f"$.imports[{i}]", legal)
        for i, one in enumerate(imports if isinstance(imports, (list, tuple)) else [imports])
        if not isinstance(one, str) or one not in known
    ]


def _file(
    data: Mapping[str, Any], notes: Mapping[str, str], request: str, plan: str, mends: tuple[str, ...], credit: str
) -> str:
    """Return the file, laid out as `formiga fmt` does, with comments that say where it came from and why."""
    text, paths = to_yaml(data)
    lines = _on_one_line(text.splitlines(), paths, notes)
    head = [f"Drafted{f' by {credit}' if credit else ''} from the request:"]
    head += [f"  {line}" for line in _wrapped(request)]
    head += [f"Plan: {line}" if not i else f"  {line}" for i, line in enumerate(_wrapped(plan))]
    head += [f"Added: {mend}" for mend in mends]
    body = "\n".join([*(f"# {_comment(line)}".rstrip() for line in head), *lines]) + "\n"
    laid_out = format_text(body, FILE)
    return laid_out.text or body


def _on_one_line(lines: list[str], paths: Mapping[int, str], notes: Mapping[str, str]) -> list[str]:
    """Return the lines with each plain param, and the imports, on one line; a param's comment stands behind it."""
    found: list[str] = []
    number = 0
    while number < len(lines):
        head, path = lines[number], paths[number + 1]
        number += 1
        inner = []
        if re.fullmatch(r"\$\.params\[\d+\]", path) or path == "$.imports":
            while number < len(lines) and paths[number + 1].startswith(path) and paths[number + 1] != path:
                inner.append(lines[number])
                number += 1
        note = f"  # {_comment(notes[path])}" if path in notes else ""
        items = path == "$.imports" and all(line.lstrip().startswith("- ") for line in inner)
        if inner and items:
            found.append(f"{head} [{', '.join(line.strip()[2:] for line in inner)}]")
        elif inner and all(re.fullmatch(r" {4}\w+: .+", line) for line in inner):
            found.append(f"{head} {{{', '.join(line.strip() for line in inner)}}}{note}")
        else:
            found += [head + note, *inner]
    return found


def _wrapped(text: str) -> list[str]:
    import textwrap

    return [unlike_a_stamp(line) for line in textwrap.wrap(" ".join(_comment(text).split()), 110)[:12]]


def _comment(text: str) -> str:
    """Return a text that stands in one comment line, whatever was in it."""
    return "".join(c if c.isprintable() else " " for c in text)
