"""`with_resource`: steps with units of resources of the site. Their names are fixed, so that all that is ever claimed is known.

with_resource: lift_1                       one unit
with_resource: [lift_1, dock_bay: 2]        all of them at once
"""

import re
from collections.abc import Iterator
from typing import Final

from formiga_bt.lang.body import Body
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.steps.blocks import Readers
from formiga_bt.lang.steps.parts import Part
from formiga_bt.lang.text.document import Listing, Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import did_you_mean, fix_word, quoted_list, shorten, what_is
from formiga_bt.lang.text.synonyms import surely

_NAME: Final = re.compile(r"[A-Za-z]\w*")
_COUNTED: Final = re.compile(r"([A-Za-z]\w*)\s*:\s*(\S+)")
_SUCH_AS: Final = "such as: with_resource: lift_1, or with_resource: [lift_1, dock_bay: 2]"


def read_with_resource(read: Readers, body: Body, keys: Keys) -> Part | None:
    """Read which resources, how long to wait for them, then the steps."""
    node = keys["with_resource"].value
    before = len(body.problems.found)
    units: dict[str, int] = {}
    for at, text, number in _claims(body, node):
        if text in units:
            body.problems.add("E018", at.mark, f"'{shorten(text)}' is named twice", "name it once, with its units")
            continue
        units[text] = _units(body, at, text, number)
    if not units and not body.problems.has_errors(before):
        body.problems.add("E044", node.mark, "'with_resource' asks for nothing", _SUCH_AS)
    wait = body.span(keys["wait"].value, "wait") if "wait" in keys else None
    steps = read.steps(body, keys["steps"].value, "steps", "steps") if "steps" in keys else ()
    return {"units": units, "wait": wait, "steps": steps}


def _claims(body: Body, node: Node) -> Iterator[tuple[Scalar, str, Node | str | None]]:
    """Iterate over the places, names and units that are written; what is no name is reported and left out."""
    if isinstance(node, Listing):
        for item in node.items:
            yield from _claims(body, item)
    elif isinstance(node, Mapping_):
        for entry in node.entries:
            yield entry.key, entry.key.text, entry.value
    elif (counted := _COUNTED.fullmatch(node.text)) is not None:
        yield node, counted[1], counted[2]
    elif _NAME.fullmatch(node.text):
        yield node, node.text, None
    elif "${" in node.text:
        what = "the resources of a task are fixed names: what may be claimed must be known before it runs"
        body.problems.add("E008", node.mark, what, _SUCH_AS)
    else:
        body.problems.add("E008", node.mark, f"'with_resource' must be a name, this is {what_is(node)}", _SUCH_AS)


def _units(body: Body, at: Scalar, name: str, number: Node | str | None) -> int:
    """Return how many units are asked for; report E110 and E111."""
    site = body.world.site
    text = number if isinstance(number, str) else number.text if isinstance(number, Scalar) else "" if number else "1"
    mark = number.mark if isinstance(number, Scalar | Listing | Mapping_) else at.mark
    units = int(text) if text.isascii() and text.isdigit() and len(text) < 10 else 0
    if units < 1:
        body.problems.add("E008", mark, f"the units of '{name}' must be a whole number from 1 on", _SUCH_AS)
    if site is None:
        return max(units, 1)
    if name not in site.resources:
        meant = surely(name, site.resources)
        what = f"no resource is called '{shorten(name)}'{did_you_mean(name, site.resources)}"
        help_ = (
            f"resources of {site.name}: {quoted_list(site.resources)}"
            if site.resources
            else f"add it to the site file: resources: {{{name}: {{capacity: 1}}}}"
        )
        fix = fix_word(at, meant) if meant and at.text == name else None
        body.problems.add("E110", at.mark, what, help_, fix)
    elif units > (most := site.resources[name].capacity):
        what = f"'{name}' has {most} unit{'s' if most > 1 else ''}, this asks for {units}"
        body.problems.add("E111", mark, what, "ask for fewer, or raise its capacity in the site file")
    return max(units, 1)
