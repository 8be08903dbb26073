"""Reads `answers` of a case: how questions are answered, and what becomes of goals."""

from collections.abc import Mapping
from typing import Any

from msgspec.structs import replace

from formiga_bt.lang.keyed import read_keys
from formiga_bt.lang.model import Ask, Role, Task, WithAgents
from formiga_bt.lang.scenario.book import Book
from formiga_bt.lang.scenario.forms import filled
from formiga_bt.lang.text.document import Entry, Mapping_, Scalar
from formiga_bt.lang.text.reading import did_you_mean, fix_word, quoted_list, shorten
from formiga_bt.lang.text.synonyms import nearest
from formiga_bt.lang.walk import all_steps
from formiga_bt.rehearsal.bodies import on_wire
from formiga_bt.rehearsal.cases.cases import AnswerRule, GoalRule
from formiga_bt.rehearsal.cases.options import ANSWER, GOAL

OF_CLEARANCES = ("clear", "wait", "refuse")
"""What the engine's own question offers."""


def read_rules(book: Book, task: Task) -> tuple[tuple[AnswerRule, ...], tuple[GoalRule, ...]]:
    """Return the rules of a case, answers and goals, each in the order of the file."""
    answers: list[AnswerRule] = []
    goals: list[GoalRule] = []
    for mapping in book.keys.mappings("answers", "answers"):
        if mapping.get("do") is not None:
            goal = _goal(book, task, mapping)
            goals += [goal] if goal is not None else []
        else:
            answer = _answer(book, task, mapping)
            answers += [answer] if answer is not None else []
    return tuple(answers), tuple(goals)


def all_roles(task: Task) -> Mapping[str, Role]:
    """Return the roles of a task and of its `with_agents`, by name; of one name in several blocks the types of all."""
    found = dict(task.roles)
    for step in all_steps(task):
        for role in step.roles.values() if isinstance(step, WithAgents) else ():
            known = found.get(role.name)
            found[role.name] = (
                role if known is None else replace(known, types=tuple(dict.fromkeys((*known.types, *role.types))))
            )
    return found


def _answer(book: Book, task: Task, mapping: Mapping_) -> AnswerRule | None:
    keys = read_keys(mapping, ANSWER, book.problems, "an answer")
    which, said, never, after_s = keys.text("ask"), keys.text("answer"), keys.flag("never"), keys.number("after")
    if (said is None) != never:
        text = "'answer' and 'never' exclude each other" if never else "an answer needs 'answer' or 'never: true'"
        book.problems.add("E008", mapping.mark, text, "take one of them out" if never else "add answer:")
    if which is None:
        return None
    number = int(which.text) if which.text.isdecimal() and len(which.text) < 7 and not which.quoted else None
    if number == 0:
        book.problems.add("E062", which.mark, "questions count from 1")
    asks = [step for step in all_steps(task) if isinstance(step, Ask)]
    options = dict.fromkeys(word for ask in asks for word in ask.options)
    if number is None:
        options |= dict.fromkeys(OF_CLEARANCES)
    if said is not None and said.text not in options:
        text = f"'{shorten(said.text)}' is never an answer here{did_you_mean(said.text, options)}"
        meant = nearest(said.text, options)
        book.problems.add("E014", said.mark, text, f"answers: {quoted_list(options) or 'none'}", fix_word(said, meant))
    by = keys.name("by")
    people = [agent for agent in book.types if book.is_human(agent)]
    if by is not None and by.text not in people:
        book.nobody(by, people, "person")
        by = None
    said_by = by.text if by is not None else ""
    answer = said.text if said is not None else ""
    values = filled(book, keys["fields"], asks) if "fields" in keys else {}
    form = {name: on_wire(value) for name, value in values.items()}
    return AnswerRule(mapping.mark, number, which.text, answer, after_s, form, said_by)


def read_order(book: Book, task: Task, at: Scalar, what: str) -> tuple[str, str] | None:
    """Return who and what of `role.Action` or `agent.Action`, or None if it was reported."""
    who, dot, action = at.text.partition(".")
    roles = all_roles(task)
    known = [*roles, *book.types]
    if not dot or not who or not action:
        book.problems.add("E008", at.mark, f"'{what}' must be role.Action, this is '{shorten(at.text)}'")
        return None
    types = list(roles[who].types) if who in roles else [book.types[who]] if who in book.types else []
    if not types:
        text = f"no role and no agent is called '{shorten(who)}'{did_you_mean(who, known)}"
        book.problems.add("E020", at.mark, text, f"known: {quoted_list(known)}")
        return None
    actions = list(dict.fromkeys(name for type_ in types for name in book.catalogue.types[type_].actions))
    if action not in actions:
        text = f"{' or '.join(types)} has no action '{shorten(action)}'{did_you_mean(action, actions)}"
        book.problems.add("E021", at.mark, text, f"actions: {quoted_list(actions)}")
        return None
    return who, action


def _goal(book: Book, task: Task, mapping: Mapping_) -> GoalRule | None:
    keys = read_keys(mapping, GOAL, book.problems, "a goal")
    at = keys.text("do")
    order = read_order(book, task, at, "do") if at is not None else None
    nth = keys.whole("nth") if "nth" in keys else None
    codes = [keys.word(key) for key in ("fail", "reject")]
    chosen = [key for key in ("fail", "reject", "result") if key in keys]
    if len(chosen) > 1 or not (chosen or "after" in keys):
        text = f"'{chosen[0]}' and '{chosen[1]}' exclude each other" if chosen else "nothing is said of these goals"
        book.problems.add("E008", mapping.mark, text, "one of fail, reject, result, after")
        return None
    if "reject" in keys and "after" in keys:
        book.problems.add(
            "E008", keys["after"].key.mark, "a goal is refused at once: 'after' does not go with 'reject'"
        )
    result = _result(book, order[1], keys["result"]) if order is not None and "result" in keys else {}
    if order is None:
        return None
    code = next(filter(None, codes), "")
    does = {"fail": "fail", "reject": "reject", "result": "finish"}.get(chosen[0] if chosen else "", "wait")
    after_s = keys.number("after")
    return GoalRule(mapping.mark, *order, nth, does, code, result, after_s)  # type: ignore[arg-type]  # one of its words


def _result(book: Book, action: str, entry: Entry) -> Mapping[str, Any]:
    """Return a result as wire values."""
    spec, before = book.catalogue.actions[action], len(book.problems.found)
    found = book.fields(entry, spec.result, action, "returns")
    missing = [name for name in spec.result if name not in found]
    if missing and not book.problems.has_errors(before):
        book.problems.add("E022", entry.value.mark, f"the result lacks {quoted_list(missing)}")
    return {name: on_wire(value) for name, value in found.items()}
