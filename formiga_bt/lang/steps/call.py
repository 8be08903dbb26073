"""`call`: the call of a subtree with its arguments. What it needs of each agent that is passed is checked here."""

from formiga_bt.lang.body import Body
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.model import Expr
from formiga_bt.lang.steps.heights import check_called_heights
from formiga_bt.lang.steps.parts import Part, read_save, unknown_argument
from formiga_bt.lang.steps.who import origin_of
from formiga_bt.lang.text.document import Entry, Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import quoted_list, read_mapping, read_name
from formiga_bt.lang.types import ANY
from formiga_bt.lang.walk import plain_name
from formiga_bt.lang.world import Callee


def read_call(body: Body, keys: Keys) -> Part | None:
    """Read the call of a subtree with its arguments."""
    at = read_name(keys["call"].value, body.problems, "call")
    callee = body.resolve(at) if at is not None else None
    if at is None or callee is None:
        return None
    args = _read_args(body, keys.get("with"), callee, at)
    part: Part = {"subtree": callee.subtree, "args": args}
    if "save_as" in keys:
        if callee.returns is not None:
            part["save_as"] = read_save(body, keys["save_as"].value, callee.returns)
        else:
            mark = keys["save_as"].key.mark
            body.problems.add("E053", mark, f"{at.text} returns nothing to save", "remove save_as, or give it returns:")
            body.drop(Mapping_((keys["save_as"],), at.mark))
    return part


def _read_args(body: Body, given: Entry | None, callee: Callee, at: Scalar) -> dict[str, Expr]:
    params = callee.subtree.params
    mapping = read_mapping(given.value, body.problems, "with") if given is not None else None
    args: dict[str, Expr] = {}
    misspelt = given is not None and mapping is None
    for entry in mapping.entries if mapping is not None else ():
        param = params.get(entry.key.text)
        if param is None:
            misspelt = True
            unknown_argument(body, "E050", entry.key, params, at.text, "param")
            body.count(entry.value)
            continue
        absent = param.optional or param.default is not None
        args[param.name] = body.value(entry.value, param.type, param.name, optional=absent)
        if param.min is None:
            body.not_negative(args[param.name], param.name)
        if param.type.name == "agent" or (param.type.item is not None and param.type.item.name == "agent"):
            _check_abilities(body, entry.value, args[param.name], callee.needs.get(param.name, ()), at.text)
        name = plain_name(args[param.name])
        if param.name in callee.releases and args[param.name].type.is_foreign:
            whence, help_ = origin_of(body, name)
            one = f"'{name}', which {whence}" if "param" in whence else "an agent from fleet()"
            body.problems.add("E023", entry.value.mark, f"{at.text} releases {one}: this task does not hold it", help_)
        elif param.name in callee.releases and name:
            body.flow.released.setdefault(name, at.mark)
    check_called_heights(body, args, callee)
    for param in params.values():
        if param.name not in args and param.default is None and not param.optional and not misspelt:
            where = mapping.mark if mapping is not None else at.mark
            body.problems.add(
                "E050", where, f"{at.text} needs '{param.name}' ({param.type})", f"add with: {param.name}: ..."
            )
    return args


def _check_abilities(body: Body, node: Node, arg: Expr, needs: tuple[str, ...], callee: str) -> None:
    """Report E052 where the agent passed lacks an action; hand the needs on to the role or param that is passed."""
    name = arg.reads[0].name if len(arg.reads) == 1 and not arg.reads[0].field else ""
    types = body.agents.get(name, arg.type.item.of if arg.type.item is not None else arg.type.of)
    known = body.world.catalogue.types
    machines = [one for one in types if one not in known or not known[one].human]
    if arg.type.is_foreign and needs and (machines or not types):
        whence, help_ = origin_of(body, name)
        one = f"'{name}', which {whence}" if "param" in whence else "an agent from fleet()"
        body.problems.add("E023", node.mark, f"{callee} orders {needs[0]} of {one}: this task does not hold it", help_)
        return
    for action in needs:
        lacking = [one for one in types if one in known and action not in known[one].actions]
        if lacking and arg.type != ANY:
            what = f"{callee} orders {action} of '{name or 'this agent'}', but {lacking[0]} has no such action"
            body.problems.add(
                "E052", node.mark, what, f"actions of {lacking[0]}: {quoted_list(known[lacking[0]].actions)}"
            )
            return
        if name in body.agents:
            body.need(name, action)
