"""What a request that changes a draft goes on from: the answer that became its task, the task as its file is now, or the words.

Called by `draft` and `formiga draft --continue`.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from msgspec import json

from formiga_bt.base.errors import UnusableFile
from formiga_bt.lang.loader import load_task_text
from formiga_bt.llm.editing import VERSION, as_answer
from formiga_bt.llm.envelope import Form, ModelAnswer, NoAnswer, form_of, read_answer
from formiga_bt.llm.prompt import as_data
from formiga_bt.llm.records import Draft, Round
from formiga_bt.llm.vocabulary import verbs_of
from formiga_bt.llm.words.feasible import impossible
from formiga_bt.llm.words.wording import read
from formiga_bt.llm.world import RequestWorld
from formiga_bt.safety.drafted import unstamped

_VERSION: Final = re.compile(r"^version: \"?([^\"\n]*?)\"?$", re.MULTILINE)
NO_TREE: Final = frozenset({"no_answer", "too_long", "contradicted"})
"""What is said of an answer that holds no tree."""


@dataclass(frozen=True, slots=True)
class Following:
    """What a model is asked next."""

    request: str
    before: tuple[str, str] | None
    """The request before and the JSON of the answer to it; None: it is asked anew, with both requests in one."""
    form: Form


def following(
    previous: Draft, request: str, world: RequestWorld, form: Form | None = None, file: str = ""
) -> Following:
    """Return what a request that changes a draft is asked with.

    Args:
        previous: the draft; its YAML is what its file says now, with or without the line of its origin.
        request: in words.
        world: as in `draft`.
        form: of the new answer; None = that of the answer before.
        file: where its task stands, for an error.

    Raises:
        UnusableFile: the task has errors that no round had, or what the short form cannot say.
    """
    before = as_data(previous.request)
    if unstamped(previous.yaml).strip():
        answer, found = _of_task(previous, world, form, file or "the task of the draft")
        return Following(request, (before, answer), found)
    said = _said(previous)
    if said:
        return Following(request, (before, said), form or form_of(_read(said)))
    both = f"{before}\n{request}"
    if previous.kind == "impossible" and _is_impossible(both, world):  # the new words take back what could not be
        answer = json.encode({"plan": "", "answer": {"impossible": previous.say, "instead": ""}}).decode()
        return Following(request, (before, answer), form or "short")
    return Following(both, None, form or "short")


def shown(text: str, world: RequestWorld, form: Form | None, file: str) -> tuple[str, str, Form]:
    """Return what a task without errors is for, and the JSON and the form of an answer with it.

    Raises:
        UnusableFile: the short form is wanted, and cannot say it.
    """
    purpose, answer, found = as_answer(text, world, form or "short")
    if form == "short" and found == "full":
        raise UnusableFile(f"{file} has what the short form cannot say", help="--form full")
    return purpose, answer, found


def _of_task(previous: Draft, world: RequestWorld, form: Form | None, file: str) -> tuple[str, Form]:
    """Return the answer that became the task of a draft, unless somebody has changed its file since."""
    text = unstamped(previous.yaml).strip()
    for one in reversed(previous.rounds):
        answer = one.answer or one.reply.text
        if answer and unstamped(one.yaml).strip() == text:
            found = form_of(_read(answer))
            if form in (None, found):
                return _with_version(answer, previous.yaml), found
            break
    loaded = load_task_text(
        previous.yaml, "task.yaml", catalogue=world.catalogue, site=world.site, library=world.folders
    )
    if loaded.task is None:
        raise UnusableFile(f"{file} has errors", help=f"formiga check {file}")
    _, answer, found = shown(previous.yaml, world, form, file)
    return answer, found


def _with_version(answer: str, yaml: str) -> str:
    """Return an answer with the version that its task has, where a change of a task has kept one."""
    found = _VERSION.search(yaml)
    one = _answer(answer)
    if found is None or found[1] == VERSION or one is None or one.tree is None or "version" in one.tree:
        return answer
    return json.encode({"plan": one.plan, "answer": {"tree": {**one.tree, "version": found[1]}}}).decode()


def _said(previous: Draft) -> str:
    """Return the answer that a draft without a task came to: the question or the reason of a model, or the best tree."""
    if previous.kind == "failed":
        best = _best(previous.rounds)
        return best.answer or best.reply.text if best is not None else ""
    last = previous.rounds[-1].reply if previous.rounds else None
    if last is None or previous.rounds[-1].shortfalls:
        return ""
    answer = _answer(last.text)
    return last.text if answer is not None and answer.tree is None else ""


def _best(rounds: Sequence[Round]) -> Round | None:
    """Return the last of the rounds whose trees have the fewest errors."""
    best: Round | None = None
    for one in rounds:
        if {problem.code for problem in one.shortfalls} & NO_TREE:
            continue
        if best is None or _errors(one) <= _errors(best):
            best = one
    return best


def _errors(one: Round) -> int:
    return sum(problem.severity == "error" for problem in one.shortfalls)


def _answer(text: str) -> ModelAnswer | None:
    try:
        return read_answer(None, text)
    except NoAnswer:
        return None


def _read(text: str) -> object:
    answer = _answer(text)
    return answer.tree if answer is not None else None


def _is_impossible(request: str, world: RequestWorld) -> bool:
    return impossible(read(request, world.site, world.catalogue), world, verbs_of(world)) is not None
