"""`request`: a step that starts another task. Its params are known here, so that what it is given is checked now."""

from collections.abc import Mapping

from msgspec.structs import replace

from formiga_bt.lang.body import Body
from formiga_bt.lang.files import Unit
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.model import Expr, Param
from formiga_bt.lang.own_records import records_of
from formiga_bt.lang.params import read_params
from formiga_bt.lang.records import CHILD
from formiga_bt.lang.request.aliases import by_alias
from formiga_bt.lang.request.neighbours import Neighbours
from formiga_bt.lang.steps.parts import Part, read_save
from formiga_bt.lang.text.document import Node, Scalar
from formiga_bt.lang.text.reading import (
    Problems,
    did_you_mean,
    fix_word,
    quoted_list,
    read_mapping,
    read_name,
    shorten,
)
from formiga_bt.lang.text.synonyms import nearest
from formiga_bt.lang.world import World


def read_request(body: Body, keys: Keys) -> Part | None:
    """Read the request of another task with its params."""
    at = read_name(keys["request"].value, body.problems, "request")
    others = body.world.others
    if at is None or others is None:
        return None
    params = task_params(others, at.text, body.world)
    if params is None:
        known = others.names()
        own = others.called(at.text)
        if own:
            what = f"'{at.text}' is another name of {own}, for callers from outside; did you mean '{own}'?"
            body.problems.add("E050", at.mark, what, f"write {own}", fix_word(at, own))
            return None
        meant = nearest(at.text, known)
        help_ = f"tasks: {quoted_list(known)}" if known and not meant else "its file stands beside this one"
        what = f"no task is called '{shorten(at.text)}'{did_you_mean(at.text, known)}"
        body.problems.add("E050", at.mark, what, help_, fix_word(at, meant))
        return None
    others.asked.setdefault(at.text, at)
    waits = "wait" not in keys or keys.flag("wait")
    part: Part = {"task": at.text, "args": read_args(body, keys, params, at), "wait": waits}
    part["needs"] = others.roles(at.text)
    if "priority" in keys:
        part["priority"] = keys.word("priority")
    part["detached"] = keys.flag("detached")
    if "save_as" in keys:
        part["save_as"] = read_save(body, keys["save_as"].value, CHILD)
    return part


def task_params(others: Neighbours, name: str, world: World) -> dict[str, Param] | None:
    """Return the params of a task that may be requested; None: there is none of that name."""

    def read(unit: Unit, node: Node) -> dict[str, Param]:
        records = records_of(unit, world.catalogue, Problems())
        return read_params(node, replace(world, records=records), Problems())

    return others.params(name, read)


def read_args(body: Body, keys: Keys, params: Mapping[str, Param], at: Scalar) -> dict[str, Expr]:
    """Read what a task is given, under the key `with`; report what does not fit its params, and what is missing."""
    by_name = by_alias(params)
    mapping = read_mapping(keys["with"].value, body.problems, "with") if "with" in keys else None
    args: dict[str, Expr] = {}
    complete = "with" not in keys or mapping is not None
    for entry in mapping.entries if mapping is not None else ():
        name = entry.key.text
        param = by_name.get(name)
        if param is None:
            complete = False
            what = f"{at.text} has no param '{shorten(name)}'{did_you_mean(name, params)}"
            help_ = f"params: {quoted_list(params)}" if params else "it has no params"
            body.problems.add("E050", entry.key.mark, what, help_, fix_word(entry.key, nearest(name, params)))
            body.count(entry.value)
        elif param.name in args:
            what = f"'{name}' and '{param.name}' are the same param"
            body.problems.add("E018", entry.key.mark, what, "remove one")
        else:
            absent = param.optional or param.default is not None
            args[param.name] = body.value(entry.value, param.type, name, optional=absent)
            if param.min is None:
                body.not_negative(args[param.name], name)
    for param in params.values():
        if param.name not in args and param.default is None and not param.optional and complete:
            where = mapping.mark if mapping is not None else at.mark
            what = f"{at.text} needs '{param.name}' ({param.type})"
            body.problems.add("E050", where, what, f"add with: {param.name}: ...")
    return args
