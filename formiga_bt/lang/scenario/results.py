"""Reads `results` of a scenario or a test case: what simulated agents give, in which of their goals they fail or begin late.

results: [{do: Inspect, nth: 2, give: {cracks: 3}}, {do: crane_1.Winch, fail: jammed}, {do: Winch, delay: 5 s}]
"""

from typing import Final

from formiga_bt.lang.keyed import read_keys
from formiga_bt.lang.kinds import Option
from formiga_bt.lang.model import ActionSpec
from formiga_bt.lang.scenario.book import Book
from formiga_bt.lang.scenario.entries import ScenarioResult
from formiga_bt.lang.text.document import Mapping_, Scalar
from formiga_bt.lang.text.reading import did_you_mean, fix_word, quoted_list, shorten
from formiga_bt.lang.text.synonyms import surely

RESULT: Final = (
    Option("do", "action", "Whose goals: Action of all, or agent.Action.", required=True),
    Option("nth", "value", "Which of these goals of an agent, from 1; without it each.", type="int", least=1),
    Option("give", "map", "Fields of the result; the others are as ever."),
    Option("fail", "name", "It fails with this code where it would have ended."),
    Option("delay", "value", "So much later it begins (0 s).", type="duration", least=0.0),
)


def read_results(book: Book) -> tuple[ScenarioResult, ...]:
    """Return what is to become of goals; `book.types` must know who is there."""
    found = [_result(book, mapping) for mapping in book.keys.mappings("results", "a result")]
    return tuple(one for one in found if one is not None)


def _result(book: Book, mapping: Mapping_) -> ScenarioResult | None:
    keys = read_keys(mapping, RESULT, book.problems, "a result")
    at = keys.text("do")
    if "give" in keys and "fail" in keys:
        book.problems.add("E008", keys["fail"].key.mark, "'give' and 'fail' exclude each other", "take one of them out")
    if not {"give", "fail", "delay"} & keys.keys():
        book.problems.add("E008", mapping.mark, "nothing is said of these goals", "add give, fail or delay")
    if at is None:
        return None
    agent, _, action = at.text.rpartition(".")
    if agent and agent not in book.types:
        book.nobody(at, list(book.types))
        return None
    spec = _action(book, at, agent, action)
    if spec is None:
        return None
    give = book.fields(keys["give"], spec.result, spec.name, "returns") if "give" in keys else {}
    nth = keys.whole("nth") if "nth" in keys else 0
    return ScenarioResult(agent, action, nth, give, keys.word("fail"), keys.number("delay"))


def _action(book: Book, at: Scalar, agent: str, action: str) -> ActionSpec | None:
    types = [book.types[agent]] if agent else list(dict.fromkeys(book.types.values()))
    known = list(dict.fromkeys(name for one in types for name in book.catalogue.types[one].actions))
    if action in known:
        return book.catalogue.actions[action]
    who = book.types[agent] if agent else "nobody here"
    text = f"{who} has no action '{shorten(action)}'" if agent else f"{who} has an action '{shorten(action)}'"
    fix = fix_word(at, surely(action, known)) if not agent else None
    book.problems.add("E021", at.mark, text + did_you_mean(action, known), f"actions: {quoted_list(known)}", fix)
    return None
