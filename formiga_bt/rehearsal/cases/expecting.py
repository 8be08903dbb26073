"""Reads what a case expects."""

from collections.abc import Sequence
from typing import cast, get_args

from formiga_bt.lang.codes import read_code
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.model import Fail, Task
from formiga_bt.lang.scenario.book import Book
from formiga_bt.lang.text.reading import did_you_mean, quoted_list, read_number, read_word, read_words, shorten
from formiga_bt.lang.walk import all_steps
from formiga_bt.rehearsal.cases.cases import GAP, Expect, GoalRule, Standing
from formiga_bt.rehearsal.cases.options import EXPECT
from formiga_bt.rehearsal.cases.rules import all_roles, read_order


def read_expect(book: Book, task: Task, goals: Sequence[GoalRule] = ()) -> Expect | None:
    """Return what a case expects, or None if it does not say it; `goals` are its rules for goals."""
    if "expect" not in book.keys:
        return None
    keys = book.keys.inside("expect", EXPECT, "expect")
    code, status = keys.text("code"), keys.word("status")
    if code is not None and status == "succeeded":
        book.problems.add("E008", keys["code"].key.mark, "a task that succeeds has no code", "say status: failed")
    return Expect(
        book.keys.mark("expect"),
        status,  # type: ignore[arg-type]  # one of its words
        read_code(code, [*_own_words(task), *(rule.code for rule in goals)], book.problems)
        if code is not None
        else None,
        _actions(book, task, keys),
        _end_state(book, task, keys),
        keys.number("max_time") if "max_time" in keys else None,
        keys.whole("answers_asked") if "answers_asked" in keys else None,
        _notices(keys),
        keys.whole("crashes"),
        _rules(book, keys),
    )


def _rules(book: Book, keys: Keys) -> dict[str, int]:
    known, found = book.site.rules, {}
    for one in keys.entries("rules"):
        number = read_number(one.value, book.problems, one.key.text)
        if one.key.text not in known:
            what = f"the site has no rule '{shorten(one.key.text)}'{did_you_mean(one.key.text, known)}"
            book.problems.add("E010", one.key.mark, what, f"rules: {quoted_list(known)}" if known else "")
        elif number is not None:
            found[one.key.text] = int(number)
    return found


def _own_words(task: Task) -> list[str]:
    return [step.code for step in all_steps(task) if isinstance(step, Fail) and step.code]


def _actions(book: Book, task: Task, keys: Keys) -> tuple[str, ...] | None:
    if "actions" not in keys:
        return None
    found = []
    for at in read_words(keys["actions"].value, book.problems, "actions"):
        if at.text == GAP or read_order(book, task, at, "actions") is not None:
            found.append(at.text)
    return tuple(found)


def _end_state(book: Book, task: Task, keys: Keys) -> dict[str, Standing]:
    machines = [name for name, type_ in book.types.items() if not book.catalogue.types[type_].human]
    roles = [r.name for r in all_roles(task).values() if not all(book.catalogue.types[t].human for t in r.types)]
    known = [*roles, *machines]
    found: dict[str, Standing] = {}
    for one in keys.entries("end_state"):
        if one.key.text not in known:
            text = (
                f"no machine and no role of one is called '{shorten(one.key.text)}'{did_you_mean(one.key.text, known)}"
            )
            book.problems.add("E010", one.key.mark, text, f"known: {quoted_list(known)}")
        word = read_word(one.value, book.problems, one.key.text, get_args(Standing))
        if word:
            found[one.key.text] = cast(Standing, word)
    return found


def _notices(keys: Keys) -> tuple[str, ...] | None:
    if "notices" not in keys:
        return None
    return tuple(keys.words("notices"))
