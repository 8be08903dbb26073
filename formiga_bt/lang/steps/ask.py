"""Steps that address people: `ask` and `notify`.

Each function reads the keys of one step and returns its own part of the model; `step` adds the modifiers.
"""

from formiga_bt.base.asking import CONFIRM
from formiga_bt.lang import records
from formiga_bt.lang.body import Body
from formiga_bt.lang.expr.compiling import poison
from formiga_bt.lang.forms import DONE, YES_NO
from formiga_bt.lang.keyed import Keys, read_keys
from formiga_bt.lang.kinds import CLEARS
from formiga_bt.lang.model import Expr, Who
from formiga_bt.lang.steps.forms import read_form
from formiga_bt.lang.steps.parts import Part, read_expect, read_save
from formiga_bt.lang.steps.who import find_action, read_held, read_who, site_role_names
from formiga_bt.lang.text.document import Node, Scalar
from formiga_bt.lang.text.reading import (
    did_you_mean,
    fix_word,
    quoted_list,
    read_listing,
    read_mapping,
    read_text,
    read_words,
    shorten,
    what_is,
)
from formiga_bt.lang.text.synonyms import surely
from formiga_bt.lang.types import TEXT


def read_ask(body: Body, keys: Keys) -> Part | None:
    """Read a question to people."""
    part: Part = {"question": _words(body, keys["ask"].value, "ask", "of: [ROLE] and options: [yes, no]")}
    part["of"] = _read_whom(body, keys["of"].value, "of", action=CONFIRM) if "of" in keys else ()
    part["form"] = form = read_form(body, keys)
    options = _read_options(body, keys) if "options" in keys or not form else DONE
    part["options"] = options
    part["policy"] = keys.word("policy")
    if "escalate_after" in keys:
        part["escalate_after"] = body.span(keys["escalate_after"].value, "escalate_after")
        if len(part["of"]) == 1 and not part["of"][0].site_role:
            mark = keys["escalate_after"].key.mark
            body.problems.add("E074", mark, "escalate_after has nobody to ask next", "name another one in of:")
    if "clears" in keys:
        part["clears"], part["clears_on"] = _read_clears(body, keys["clears"].value, options)
    if "if_no_answer" in keys:
        part["if_no_answer"] = body.value(keys["if_no_answer"].value, TEXT, "if_no_answer")
    result = records.answer(options, part["policy"], form)
    if "save_as" in keys:
        part["save_as"] = read_save(body, keys["save_as"].value, result)
    part["expect"] = read_expect(body, keys, result)
    return part


def _words(body: Body, node: Node, kind: str, others: str) -> Expr:
    """Compile what people are to read; `others` are the keys that somebody may have meant who wrote no text."""
    if not isinstance(node, Scalar):
        help_ = f"{kind}: takes the words themselves; {others} stand beside it, at the same indent"
        body.problems.add("E013", node.mark, f"{kind} is due a text, this is {what_is(node)}", help_)
        return poison(node, "")
    return body.text(node, kind)


def _read_options(body: Body, keys: Keys) -> tuple[str, ...]:
    if "options" not in keys:
        return YES_NO
    node = keys["options"].value
    words = read_words(node, body.problems, "options")
    seen: dict[str, Scalar] = {}
    for word in words:
        if word.text in seen:
            body.problems.add("E074", word.mark, f"the option '{shorten(word.text)}' is given twice", "remove one")
        seen.setdefault(word.text, word)
    if len(words) == 1 or (not words and getattr(node, "items", None) == ()):
        body.problems.add("E074", node.mark, "a question needs at least two options", "such as: options: [yes, no]")
    return tuple(seen) or YES_NO


def _read_clears(body: Body, node: Node, options: tuple[str, ...]) -> tuple[Who | None, tuple[str, ...]]:
    mapping = read_mapping(node, body.problems, "clears")
    if mapping is None:
        return None, ()
    keys = read_keys(mapping, CLEARS, body.problems, "'clears'")
    who = None
    at = keys.text("role")
    if at is not None:
        who = read_held(body, at.text, at, at.mark)
        types = body.world.catalogue.types
        human = [name for name in body.agents.get(at.text, ()) if name in types and types[name].human]
        if human:
            body.problems.add("E074", at.mark, f"'{at.text}' is a person; clears is for a machine", "name the drone")
    on = read_words(keys["on"].value, body.problems, "on") if "on" in keys else []
    for word in on:
        if word.text not in options:
            what = f"'{shorten(word.text)}' is never an answer here{did_you_mean(word.text, options)}"
            meant = surely(word.text, options)
            body.problems.add("E014", word.mark, what, f"options: {quoted_list(options)}", fix_word(word, meant))
    return who, tuple(word.text for word in on)


def _read_whom(body: Body, node: Node, key: str, action: str = "") -> tuple[Who, ...]:
    """Read a list of roles and site roles; `action` is what each of the roles must offer."""
    items = read_listing(node, body.problems, key)
    if items is not None and not items:
        body.problems.add("E044", node.mark, f"'{key}' is an empty list", "name at least one role")
    found: list[Who] = []
    site_roles = site_role_names(body)
    for item in items or ():
        at = read_text(item, body.problems, key)
        if at is None:
            continue
        if at.text not in body.agents and at.text in site_roles:
            found.append(Who(at.text, None, site_role=True, mark=at.mark))
        elif at.text not in body.agents:
            body.unknown_agent(at.mark, at.text, site_roles)
            body.used.add(at.text)
        else:
            who = read_who(body, at.text, at, at.mark)
            if who is not None and action and find_action(body, at.text, action, at.mark, known=True) is not None:
                body.need(at.text, action)
            if who is not None:
                found.append(who)
    return tuple(found)


def read_notify(body: Body, keys: Keys) -> Part:
    """Read a notice to people."""
    part: Part = {"text": _words(body, keys["notify"].value, "notify", "to: [ROLE] and severity: warning")}
    if "to" in keys:
        part["to"] = _read_whom(body, keys["to"].value, "to")
    if "severity" in keys:
        part["severity"] = keys.word("severity")
    return part
