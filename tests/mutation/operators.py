"""Single faults of task files: what authors and language models get wrong, one at a time.

The operators are fixed before the checks are tuned against them; a new kind of fault is a new operator, an old one is not
changed to be found more easily. A file is plain data here (dicts, lists, scalars). Each operator yields every place where it
applies as a `Fault` with the whole mutated file; nothing is drawn at random. Faults of YAML's own syntax are left out: they
are all refused, and would only raise the score.
"""

import copy
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final

Data = Any
Path = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault in a file."""

    operator: str
    where: str
    """Path of the changed value: `steps/0/with/to`."""
    what: str
    """What was done, in words."""
    data: Data


KINDS: Final = (
    "do", "ask", "call", "wait", "wait_until", "wait_for", "check", "set", "notify", "fail", "release", "sequence",
    "fallback", "race", "parallel", "if", "switch", "while", "repeat", "for", "break_if", "guard", "with_agents",
    "with_resource", "request",
)  # fmt: skip
CONDITIONS: Final = ("when", "if", "while", "until", "wait_until", "check", "expect", "guard", "break_if")
LISTS: Final = (
    "steps",
    "then",
    "else",
    "sequence",
    "fallback",
    "parallel",
    "race",
    "default",
    "finally",
    "on_failure",
    "on_abort",
)
MOVES: Final = ("TakeOff", "GoTo", "LandIn", "Explore")
HOME: Final = ("ReturnHome", "FetchHome")
_HOLE: Final = re.compile(r"\$\{(.*?)\}")
_WORD: Final = re.compile(r"(?<![\w.'])[A-Za-z_]\w*(?![\w(=]|\s*\()")
_QUANTITY: Final = re.compile(r"(-?\d+(?:\.\d+)?)\s?(ms|s|min|h|m|km|%|deg|m/s|kg|g)\b")


# --- walking -----------------------------------------------------------------------------------------------------


def nodes(data: Data, path: Path = ()) -> Iterator[tuple[Path, Data]]:
    """Iterate over every value of a file with its path, outermost first."""
    yield path, data
    if isinstance(data, dict):
        for key, value in data.items():
            yield from nodes(value, (*path, key))
    elif isinstance(data, list):
        for at, value in enumerate(data):
            yield from nodes(value, (*path, at))


def get(data: Data, path: Path) -> Data:
    """Return the value at a path."""
    for part in path:
        data = data[part]
    return data


def is_step(data: Data) -> bool:
    """Return whether a value is a step."""
    return isinstance(data, dict) and any(kind in data for kind in KINDS)


def steps(data: Data) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Iterate over the steps of a file."""
    for path, value in nodes(data):
        if path and isinstance(path[-1], int) and is_step(value):
            yield path, value


def changed(data: Data, path: Path, value: Data) -> Data:
    """Return a copy of a file with another value at a path."""
    new = copy.deepcopy(data)
    get(new, path[:-1])[path[-1]] = value
    return new


def without(data: Data, path: Path) -> Data:
    """Return a copy of a file without the value at a path; a mapping left empty goes too."""
    new = copy.deepcopy(data)
    owner = get(new, path[:-1])
    del owner[path[-1]]
    if owner == {} and path[:-1]:
        return without(new, path[:-1])
    return new


def renamed(data: Data, path: Path, name: str) -> Data:
    """Return a copy of a file with another key at a path, in the same place."""
    new = copy.deepcopy(data)
    owner = get(new, path[:-1])
    items = [(name if key == path[-1] else key, value) for key, value in owner.items()]
    owner.clear()
    owner.update(items)
    return new


def slip(word: str) -> str:
    """Return a word with a slip of the pen: two letters exchanged in the middle, or the last one twice."""
    at = len(word) // 2
    other = word[: at - 1] + word[at] + word[at - 1] + word[at + 1 :] if len(word) > 2 else word + word[-1]
    return other if other != word else word + word[-1]


def expressions(data: Data) -> Iterator[tuple[Path, str, list[tuple[int, int]]]]:
    """Iterate over the texts that hold expressions, with the spans of those."""
    for path, value in nodes(data):
        if not isinstance(value, str) or not path:
            continue
        if path[-1] in CONDITIONS:
            yield path, value, [(0, len(value))]
        else:
            spans = [match.span(1) for match in _HOLE.finditer(value)]
            if spans:
                yield path, value, spans


def words_in(text: str, spans: list[tuple[int, int]]) -> Iterator[re.Match[str]]:
    """Iterate over the names that expressions read: no fields, helpers, argument names, texts or words of the language."""
    for match in _WORD.finditer(text):
        within = any(start <= match.start() and match.end() <= end for start, end in spans)
        quoted = text[: match.start()].count("'") % 2 == 1
        unit = re.search(r"\d\s?$", text[: match.start()]) is not None
        if (
            within
            and not quoted
            and not unit
            and match[0] not in ("and", "or", "not", "in", "if", "else", "true", "false")
        ):
            yield match


def roles_of(data: Data) -> list[str]:
    """Return the roles of a task, or the agent params of all subtrees."""
    return list(data.get("agents", {}))


def places_of(data: Data) -> list[str]:
    """Return the names of places at hand."""
    kinds = {name: p if isinstance(p, str) else p.get("type") for name, p in data.get("params", {}).items()}
    return [*(name for name, kind in kinds.items() if kind == "place"), "base"]


def moved_role(step: dict[str, Any]) -> str:
    """Return whom a step moves: a role or param; "" = nobody."""
    if "do" in step:
        role, _, action = str(step["do"]).partition(".")
        return role if action in MOVES else ""
    if "call" in step:
        return next(
            (
                match[1]
                for v in step.get("with", {}).values()
                if (match := re.fullmatch(r"\$\{(\w*(?:drone|going|escort|patrol)\w*)\}", str(v)))
            ),
            "",
        )
    return ""


# --- operators ---------------------------------------------------------------------------------------------------


def misspelt_action(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """An action that no agent has, as people and models write them."""
    slips = {"TakeOff": "Takeoff", "GoTo": "MoveTo", "LandIn": "Land", "Explore": "Survey", "MiniFinder": "FindMini"}
    for path, step in steps(data):
        role, _, action = str(step.get("do", "")).partition(".")
        if action in slips:
            yield (*path, "do"), f"{action} is {slips[action]}", changed(data, (*path, "do"), f"{role}.{slips[action]}")


def misspelt_key(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A key with a slip of the pen."""
    for path, _ in nodes(data):
        if (
            path
            and isinstance(path[-1], str)
            and isinstance(get(data, path[:-1]), dict)
            and is_step(get(data, path[:-1]))
        ):
            yield path, f"{path[-1]} is {slip(path[-1])}", renamed(data, path, slip(path[-1]))


def misspelt_field(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A field of a goal, or an argument of a call, with a slip of the pen."""
    for path, _ in nodes(data):
        if len(path) > 1 and path[-2] == "with":
            yield path, f"{path[-1]} is {slip(str(path[-1]))}", renamed(data, path, slip(str(path[-1])))


def unknown_name(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A name that nothing has, in an expression."""
    for path, text, spans in expressions(data):
        for match in words_in(text, spans):
            new = text[: match.start()] + slip(match[0]) + text[match.end() :]
            yield path, f"{match[0]} is {slip(match[0])}", changed(data, path, new)


def unknown_agent_field(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A field that agents or results do not have."""
    for path, text, spans in expressions(data):
        for match in re.finditer(r"(?<=\w)\.([a-z_]+)", text):
            if any(start <= match.start() < end for start, end in spans):
                new = text[: match.start(1)] + slip(match[1]) + text[match.end() :]
                yield path, f"{match[1]} is {slip(match[1])}", changed(data, path, new)


def dropped_step(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A step that is missing."""
    for path, step in steps(data):
        yield path, f"without {_title(step)}", without(data, path)


def dropped_field(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A field of a goal, or an argument of a call, that is missing."""
    for path, _ in nodes(data):
        if len(path) > 1 and path[-2] == "with":
            yield path, f"without {path[-1]}", without(data, path)


def dropped_option(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """An option of a step or role that is missing; `with` and the step's own key are other operators'."""
    for path, _ in nodes(data):
        owner = get(data, path[:-1]) if path else None
        options = is_step(owner) and path[-1] not in (*KINDS, "with", "name", "note")
        of_role = len(path) == 3 and path[0] == "agents"
        if options or of_role:
            yield path, f"without {path[-1]}", without(data, path)


def dropped_definition(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A param, var, role or import that is missing while it is used."""
    for path, _ in nodes(data):
        if (len(path) == 2 and path[0] in ("params", "vars", "agents")) or path == ("imports",):
            yield path, f"without {path[-1]}", without(data, path)


def missing_retry_delay(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A retry without its delay, or without its number."""
    for path, value in nodes(data):
        if path and path[-1] == "retry" and isinstance(value, dict):
            for key in value:
                yield (*path, key), f"retry without {key}", without(data, (*path, key))


def other_unit(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A unit of the same kind, a thousandfold or sixtyfold off."""
    other = {"s": "min", "min": "s", "h": "min", "m": "km", "km": "m", "kg": "g"}
    yield from _units(data, other)


def wrong_unit(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A unit of another kind."""
    yield from _units(data, {"s": "m", "min": "m", "h": "km", "m": "s", "km": "h", "%": "m", "deg": "m"})


def missing_unit(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A quantity as a bare number."""
    for path, value in nodes(data):
        match = _QUANTITY.fullmatch(value) if isinstance(value, str) else None
        if match is not None and path[-1] not in ("help", "label", "description"):
            number = float(match[1])
            yield path, f"{value} is {match[1]}", changed(data, path, int(number) if number.is_integer() else number)


def _units(data: Data, other: dict[str, str]) -> Iterator[tuple[Path, str, Data]]:
    for path, value in nodes(data):
        if not isinstance(value, str) or path[-1] in ("help", "label", "description", "ask", "notify"):
            continue
        for match in _QUANTITY.finditer(value):
            if match[2] in other:
                new = f"{value[: match.start()]}{match[1]} {other[match[2]]}{value[match.end() :]}"
                yield path, f"{match[0]} is {match[1]} {other[match[2]]}", changed(data, path, new)


def tenfold(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A number with a nought too many."""
    for path, value in nodes(data):
        if isinstance(value, bool) or path[-1:] in (("formiga",), ("version",)):
            continue
        if isinstance(value, int | float) and value:
            yield path, f"{value} is {value * 10}", changed(data, path, value * 10)
        elif isinstance(value, str) and (match := _QUANTITY.fullmatch(value)) is not None:
            new = f"{match[1]}0 {match[2]}" if "." not in match[1] else f"{float(match[1]) * 10:g} {match[2]}"
            yield path, f"{value} is {new}", changed(data, path, new)


def wrong_literal(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A word where a number or quantity is due, or a number where a word is."""
    for path, value in nodes(data):
        if path[-1:] in (("formiga",), ("version",), ("help",), ("label",)) or isinstance(value, bool):
            continue
        if isinstance(value, int | float) or (isinstance(value, str) and _QUANTITY.fullmatch(value)):
            yield path, f"{value} is 'high'", changed(data, path, "high")


def text_for_name(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A value without its `${}`: a text where a variable was meant."""
    for path, value in nodes(data):
        if isinstance(value, str) and (match := re.fullmatch(r"\$\{(\w+)\}", value)):
            yield path, f"{value} is {match[1]}", changed(data, path, match[1])


def ground_for_air(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A place on the ground where a position in the air is due, and the reverse."""
    for path, value in nodes(data):
        if not isinstance(value, str):
            continue
        if match := re.fullmatch(r"\$\{(?:above|at_height)\(([\w.()]+), .*\)\}", value):
            yield path, "on the ground", changed(data, path, f"${{{match[1]}}}")
        elif path[-1] == "at" and (match := re.fullmatch(r"\$\{([\w.]+)\}", value)):
            yield path, "in the air", changed(data, path, f"${{above({match[1]}, 20 m)}}")


def other_place(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """Another place of the task than the one meant."""
    names = places_of(data)
    for path, text, spans in expressions(data):
        for match in words_in(text, spans):
            if match[0] in names:
                for name in names:
                    if name != match[0]:
                        new = text[: match.start()] + name + text[match.end() :]
                        yield path, f"{match[0]} is {name}", changed(data, path, new)


def other_role(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """Another role of the task than the one meant; inside a parallel that is `crossed_roles`."""
    for path, what, new in _roles(data):
        if "parallel" not in path:
            yield path, what, new


def crossed_roles(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """In a branch of a parallel, the role of another branch."""
    for path, what, new in _roles(data):
        if "parallel" in path:
            yield path, what, new


def _roles(data: Data) -> Iterator[tuple[Path, str, Data]]:
    roles = roles_of(data)
    for path, value in nodes(data):
        if not isinstance(value, str) or path[:1] == ("agents",):
            continue
        for role in roles:
            for other in roles:
                named = value == f"${{{role}}}" or (path[-1] == "do" and value.startswith(f"{role}.")) or value == role
                if other != role and named:
                    new = value.replace(role, other, 1)
                    yield path, f"{value} is {new}", changed(data, path, new)


def other_type(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A role of another agent type."""
    for name, role in data.get("agents", {}).items():
        for other in ("lwd", "hwd", "picker", "watcher"):
            if isinstance(role, dict) and role.get("type") not in (None, other):
                yield ("agents", name), f"{role['type']} is {other}", changed(data, ("agents", name, "type"), other)


def other_param_type(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A param of another type."""
    other = {
        "place": "position",
        "distance": "duration",
        "int": "distance",
        "region": "place",
        "duration": "distance",
        "enum": "int",
        "bool": "text",
        "agent": "place",
    }
    for path, value in nodes(data):
        is_type = path[-1:] == ("type",) or (len(path) > 1 and path[-2] == "params" and isinstance(value, str))
        if is_type and "params" in path and value in other:
            yield path, f"{value} is {other[value]}", changed(data, path, other[value])


def dropped_landing(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """What brings a machine to the ground, forgotten."""
    for path, step in steps(data):
        if str(step.get("do", "")).endswith(".LandIn") or step.get("call") in HOME:
            yield path, f"without {_title(step)}", without(data, path)


def landing_on_one_path(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """What brings a machine to the ground, on one path only."""
    for path, step in steps(data):
        role = moved_role(step)
        if role and (str(step.get("do", "")).endswith(".LandIn") or step.get("call") in HOME) and "when" not in step:
            cond = f"{role}.battery > 70 %"
            yield path, f"{_title(step)} when {cond}", changed(data, path, {**step, "when": cond})
            yield path, f"{_title(step)} in a then", changed(data, path, {"if": cond, "then": [step]})


def start_on_one_path(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A take-off on one path only."""
    for path, step in steps(data):
        role = moved_role(step)
        if role and str(step.get("do", "")).endswith(".TakeOff") and "when" not in step:
            cond = f"{role}.battery > 70 %"
            yield path, f"{_title(step)} when {cond}", changed(data, path, {**step, "when": cond})


def ignored_failure(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """`ignore_failure` on what moves a machine."""
    for path, step in steps(data):
        if moved_role(step) and "ignore_failure" not in step:
            yield path, f"{_title(step)} ignored", changed(data, path, {**step, "ignore_failure": True})


def fallback_around(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A flight in a fallback with a notice: its failure counts as success."""
    for path, step in steps(data):
        if moved_role(step):
            yield (
                path,
                f"{_title(step)} or a notice",
                changed(data, path, {"fallback": [step, {"notify": "It did not work."}]}),
            )


def wrong_order(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """Two neighbours of a sequence exchanged."""
    for path, step in steps(data):
        owner, at = get(data, path[:-1]), path[-1]
        if isinstance(at, int) and at + 1 < len(owner) and path[-2] != "parallel":
            new = changed(changed(data, path, owner[at + 1]), (*path[:-1], at + 1), step)
            yield path, f"{_title(owner[at + 1])} before {_title(step)}", new


def step_twice(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A step that stands there twice."""
    for path, step in steps(data):
        new = copy.deepcopy(data)
        get(new, path[:-1]).insert(path[-1], copy.deepcopy(step))
        yield path, f"{_title(step)} twice", new


def other_action(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """TakeOff where LandIn was meant, and the like; the arguments stay if that action has them."""
    keeps = {"TakeOff": ("altitude",), "GoTo": ("to", "speed"), "LandIn": ("at",)}
    for path, step in steps(data):
        role, _, action = str(step.get("do", "")).partition(".")
        for other in keeps if action in keeps else ():
            if other != action:
                args = {key: value for key, value in step.get("with", {}).items() if key in keeps[other]}
                if other == "LandIn" and not args:
                    args = {"at": "${base}"}
                new = {**step, "do": f"{role}.{other}", **({"with": args} if args else {})}
                if not args:
                    new.pop("with", None)
                yield path, f"{action} is {other}", changed(data, path, new)


def swapped_branches(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """`then` and `else` exchanged."""
    for path, step in steps(data):
        if "if" in step:
            new = {**step, "then": step.get("else", [{"wait": "1 s"}]), "else": step["then"]}
            yield path, "then and else exchanged", changed(data, path, new)


def negated_condition(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A condition the wrong way round."""
    for path, value in nodes(data):
        if path and path[-1] in CONDITIONS and isinstance(value, str) and is_step(get(data, path[:-1])):
            yield path, f"not ({value})", changed(data, path, f"not ({value})")


def other_comparison(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """`==` for `!=`, `<` for `>`, `and` for `or`."""
    other = {"==": "!=", "!=": "==", ">": "<", "<": ">", " and ": " or ", " or ": " and "}
    for path, text, _ in expressions(data):
        for old, new in other.items():
            at = text.find(old)
            if at >= 0:
                yield (
                    path,
                    f"{old.strip()} is {new.strip()}",
                    changed(data, path, text[:at] + new + text[at + len(old) :]),
                )


def wrong_word(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """An answer or other word in an expression that is never the value."""
    for path, text, _ in expressions(data):
        for match in re.finditer(r"'(\w+)'", text):
            new = text[: match.start(1)] + slip(match[1]) + text[match.end(1) :]
            yield path, f"'{match[1]}' is '{slip(match[1])}'", changed(data, path, new)


def wrong_argument(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A call of a helper with an argument too few."""
    for path, text, _ in expressions(data):
        for match in re.finditer(r"\b([a-z_]+)\(([^()]*), [^(),]+\)", text):
            new = text[: match.start()] + f"{match[1]}({match[2]})" + text[match.end() :]
            yield path, f"{match[0]} is {match[1]}({match[2]})", changed(data, path, new)


def short_timeout(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A timeout far too short, on the steps that have one and on goals that have none."""
    for path, step in steps(data):
        if "timeout" in step or "do" in step or "call" in step:
            yield path, f"{_title(step)} within 5 s", changed(data, path, {**step, "timeout": "5 s"})


def short_task(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """A timeout of the whole task that no flight keeps."""
    if "task" in data:
        yield ("timeout",), "timeout: 20 s", {**copy.deepcopy(data), "timeout": "20 s"}


def at_once(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """Steps one after another made parallel, and the reverse."""
    for path, step in steps(data):
        if "sequence" in step:
            rest = {key: value for key, value in step.items() if key != "sequence"}
            yield path, "parallel", changed(data, path, {"parallel": step["sequence"], **rest})
        elif "parallel" in step:
            rest = {key: value for key, value in step.items() if key != "parallel"}
            yield path, "sequence", changed(data, path, {"sequence": step["parallel"], **rest})
        elif "for" in step:
            rest = {key: value for key, value in step.items() if key != "mode"}
            more = {} if "mode" in step else {"mode": "parallel"}
            yield path, "each" if "mode" in step else "parallel", changed(data, path, {**rest, **more})
    for path, value in nodes(data):
        if path[-1:] == ("steps",) and isinstance(value, list) and len(value) > 1:
            yield path, "all at once", changed(data, path, [{"parallel": value}])


def other_count(data: Data) -> Iterator[tuple[Path, str, Data]]:
    """One agent more or less than meant; a count where one agent was meant."""
    for name, role in data.get("agents", {}).items():
        counts = [role["count"] - 1, role["count"] + 1] if isinstance(role, dict) and "count" in role else [2]
        for count in counts:
            yield ("agents", name), f"count {count}", changed(data, ("agents", name), {**role, "count": count})


def _title(step: dict[str, Any]) -> str:
    kind = next(kind for kind in KINDS if kind in step)
    value = step[kind]
    return f"{kind} {value}" if isinstance(value, str) and kind in ("do", "call") else kind


OPERATORS: Final[tuple[Callable[[Data], Iterator[tuple[Path, str, Data]]], ...]] = (
    misspelt_action, misspelt_key, misspelt_field, unknown_name, unknown_agent_field, dropped_step, dropped_field,
    dropped_option, dropped_definition, missing_retry_delay, other_unit, wrong_unit, missing_unit, tenfold, wrong_literal,
    text_for_name, ground_for_air, other_place, other_role, crossed_roles, other_type, other_param_type, dropped_landing,
    landing_on_one_path, start_on_one_path, ignored_failure, fallback_around, wrong_order, step_twice, other_action,
    swapped_branches, negated_condition, other_comparison, wrong_word, wrong_argument, short_timeout, short_task, at_once,
    other_count,
)  # fmt: skip


def faults(data: Data) -> Iterator[Fault]:
    """Iterate over all single faults of a file, operator by operator; one that leaves the data as it is, is none."""
    for operator in OPERATORS:
        for path, what, new in operator(data):
            if new != data:
                yield Fault(operator.__name__, "/".join(map(str, path)), what, new)
