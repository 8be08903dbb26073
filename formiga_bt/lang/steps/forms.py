"""The `form` of an `ask`: what people fill in."""

from formiga_bt.lang.actions import read_fields
from formiga_bt.lang.body import Body
from formiga_bt.lang.forms import FILLED, FormField
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.kinds import FORM
from formiga_bt.lang.text.reading import quoted_list

_TAKEN = ("answer", "by", "at", "all")


def read_form(body: Body, keys: Keys) -> tuple[FormField, ...]:
    """Return the form of a question, empty if it has none; what cannot be filled in is reported."""
    if "form" not in keys:
        return ()
    found: list[FormField] = []
    before = len(body.problems.found)
    specs = read_fields(keys["form"].value, body.problems, "form", FORM)
    unread = body.problems.has_errors(before)
    for entry in keys.entries("form"):
        spec = specs.get(entry.key.text)
        if spec is None:
            continue
        if spec.name in _TAKEN:
            body.problems.add("E018", entry.key.mark, f"each answer has '{spec.name}' already", "another name")
        elif spec.type.name == "enum" and not spec.type.values:
            body.problems.add("E008", entry.value.mark, "an enum needs 'values'", "{type: enum, values: [a, b]}")
        elif spec.type.name not in FILLED:
            if spec.type.name != "any" or not unread:
                what = f"nobody can fill in a {spec.type}"
                body.problems.add("E008", entry.value.mark, what, f"types: {quoted_list(FILLED)}")
        else:
            kind = spec.type
            found.append(FormField(spec.name, kind.name, kind.values, spec.min, spec.max, spec.help))
    if not specs and not keys.entries("form"):
        keys.wrong("form", "E044", "'form' has no fields", "such as: form: {spot: place}")
    return tuple(found)
