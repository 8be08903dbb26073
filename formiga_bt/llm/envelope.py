"""What a model answers: a plan in prose, then a tree, or a question, or why it cannot be done. Its schema, and how it is read.

    {"plan": "...", "answer": {"tree": {...}}}
    {"plan": "...", "answer": {"question": "..."}}
    {"plan": "...", "answer": {"impossible": "...", "instead": "..."}}

The tree is in one of two forms: `short` (see `llm.shaping.short`), or `full`, the JSON form of the language, with `run` beside
it for the values of its params. An answer can hold nothing else, and its sizes are bounded: what is longer is no answer.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Any, Final, Literal

from formiga_bt.lang.expr.scope import AGENT_FIELDS
from formiga_bt.llm.letters import whole
from formiga_bt.llm.vocabulary import AgentVerb
from formiga_bt.llm.world import RequestWorld

Form = Literal["short", "full"]
Schema = dict[str, Any]

MOST_ORDERED: Final = 3
"""So many types of roles may stand in any order; more stand in one."""
MOST_TEXT: Final = 600
"""Characters of a plan, a question, a reason."""
MOST_VALUE: Final = 200
"""Characters of a value of the tree."""
MOST_STEPS: Final = 24
"""In one list."""
MOST_DEPTH: Final = 24
"""Of nested JSON."""
MOST_NODES: Final = 3000
"""JSON values of an answer."""
_STRING: Final[Schema] = {"type": "string", "maxLength": MOST_VALUE}
_PROSE: Final[Schema] = {"type": "string", "maxLength": MOST_TEXT}


class NoAnswer(ValueError):  # noqa: N818 - it says what is missing
    """A reply is not of the form; the text says why, for the model."""


@dataclass(frozen=True, slots=True)
class ModelAnswer:
    """An answer as read. Exactly one of `tree`, `question` and `impossible` is given."""

    plan: str
    tree: dict[str, Any] | None = None
    question: str = ""
    impossible: str = ""
    instead: str = ""
    run: tuple[Mapping[str, str], ...] = ()


def schema_of(
    world: RequestWorld,
    verbs: Mapping[str, AgentVerb],
    form: Form = "short",
    *,
    typed: bool = False,
    roles: Sequence[tuple[str, int]] = (),
) -> Schema:
    """Return the schema of an answer: closed objects, one for each verb of the catalogue.

    Args:
        world: its types and agents are those of the roles.
        verbs: the vocabulary.
        form: of the tree.
        typed: values are held to the shape that is due (`40 m`, `circle(camp, 5 m)`) by patterns, which not every service
            knows. Names are free.
        roles: agent types and how many of each a request speaks of for certain; a task in short form has those roles.
    """
    if form == "short":
        tree, definitions = _task(world), _steps(verbs, shapes(world) if typed else {})
        if roles:
            tree["properties"]["agents"] = _exactly(roles)
        kinds = [_closed({"tree": tree})]
    else:
        from formiga_bt.editor.llm_schema import llm_schema

        full = llm_schema(world.catalogue)
        definitions = full.pop("$defs")
        run = {"type": "array", "items": _closed({"name": _STRING, "value": _STRING, "words": _STRING})}
        kinds = [_closed({"tree": full, "run": run})]
    kinds += [_closed({"question": _PROSE}), _closed({"impossible": _PROSE, "instead": _PROSE})]
    return {**_closed({"plan": _PROSE, "answer": {"anyOf": kinds}}), "$defs": definitions}


def form_of(tree: Any) -> Form:
    """Return the form that a tree is in: an action or a call of a library is called so in the full one only."""
    if isinstance(tree, dict):
        return "full" if {"action", "call"} & tree.keys() else form_of(list(tree.values()))
    return "full" if isinstance(tree, list) and any(form_of(one) == "full" for one in tree) else "short"


def without_refusal(schema: Schema, *, may_ask: bool = True) -> Schema:
    """Return the schema of an answer that may not say that something is impossible, nor put a question if it may not ask."""
    answer = schema["properties"]["answer"]
    barred = {"impossible"} if may_ask else {"impossible", "question"}
    kinds = [one for one in answer["anyOf"] if not barred & one["properties"].keys()]
    return {**schema, "properties": {**schema["properties"], "answer": {"anyOf": kinds}}}


def _task(world: RequestWorld) -> Schema:
    types = [name for name in world.catalogue.types if name != "person"]
    on_site = {agent.type for agent in world.site.agents.values()}
    usual = [name for name in types if name in on_site or any(name in _parents(world, t) for t in on_site)]
    role = _closed(
        {"name": _STRING, "type": {"enum": usual or types}, "id": {"enum": list(world.site.agents)}, "near": _STRING,
         "count": {"type": "integer"}},
        ["name", "type"],
    )  # fmt: skip
    if not world.site.agents:
        del role["properties"]["id"]
    return _closed(
        {"task": _STRING, "agents": {"type": "array", "items": role, "maxItems": 8}, "steps": _list_of_steps()}
    )


def _exactly(roles: Sequence[tuple[str, int]]) -> Schema:
    """Return the schema of these roles, in any order: each type so many times, or as one team."""
    kinds: list[list[Schema]] = []
    for order in permutations(roles) if len(roles) <= MOST_ORDERED else [tuple(roles)]:
        apart: list[Schema] = []
        together: list[Schema] = []
        for type_, count in order:
            one = {"name": _STRING, "type": {"const": type_}}
            apart += [_closed(one)] * count
            together.append(_closed({**one, "count": {"const": count}} if count > 1 else one))
        kinds += [apart] if apart == together else [apart, together]
    lists: list[Schema] = [
        {"type": "array", "prefixItems": items, "minItems": len(items), "maxItems": len(items)} for items in kinds
    ]
    return lists[0] if len(lists) == 1 else {"anyOf": lists}


def _parents(world: RequestWorld, type_: str) -> tuple[str, ...]:
    return world.catalogue.types[type_].extends if type_ in world.catalogue.types else ()


def _steps(verbs: Mapping[str, AgentVerb], shape: Mapping[str, Schema]) -> Schema:
    steps = _list_of_steps()
    found: Schema = {}
    for verb in verbs.values():
        fields: Schema = {name: _field(type_, shape) for name, type_ in verb.fields.items()}
        saved = {"save_as": _STRING} if verb.name == "MiniFinder" or (not verb.library and not verb.fields) else {}
        found[f"do_{verb.name}"] = _closed(
            {"do": {"const": verb.name}, "agent": _STRING, **fields, **saved}, ["do", "agent", *verb.required]
        )
    words = {"type": "array", "items": _STRING, "maxItems": 6}
    found |= {
        "parallel": _closed({"parallel": steps}),
        "sequence": _closed({"sequence": steps}),
        "for": _closed(
            {"for": _STRING, "in": _STRING, "mode": {"enum": ["each", "parallel"]}, "steps": steps}, ["for", "in", "steps"]
        ),
        "repeat": _closed(
            {"repeat": shape.get("repeat", _STRING), "every": shape.get("duration", _STRING), "until": _STRING,
             "steps": steps},
            ["repeat", "steps"],
        ),
        "if": _closed({"if": _STRING, "then": steps, "else": steps}, ["if", "then"]),
        "ask": _closed(
            {"ask": _STRING, "of": words, "options": words, "go_on": _STRING, "save_as": _STRING}, ["ask", "of"]
        ),
        "wait": _closed({"wait": shape.get("duration", _STRING)}),
        "wait_until": _closed({"wait_until": _STRING}),
        "notify": _closed({"notify": _STRING}),
        "break_if": _closed({"break_if": _STRING}),
    }  # fmt: skip
    return {"step": {"anyOf": [{"$ref": f"#/$defs/{name}"} for name in found]}, **found}


def shapes(world: RequestWorld) -> dict[str, Schema]:
    """Return how the values of each type look in the short form: patterns that small models are held to.

    Args:
        world: the fields of its agents and results that are places are known.
    """
    number = "[0-9]{1,4}([.][0-9]{1,2})?"
    far = f"{number} (m|km)"
    known = dict(AGENT_FIELDS)
    for action in world.catalogue.actions.values():
        known.update(action.result)
    fields = "|".join(sorted(name for name, type_ in known.items() if type_.name in ("place", "position")))
    name = f"[A-Za-z_][A-Za-z0-9_]{{0,40}}([.]({fields}))?"
    way = f"(north|south|east|west)={far}"
    place = f"({name}|offset\\({name}, {way}(, {way})?\\)|centroid\\({name}\\))"
    count = "[0-9]{1,2}"
    listed = (
        f"(circle\\({place}, {far}(, points={count})?\\)|zigzag\\({place}, {place}, {far}, {count}\\)"
        f"|line\\({place}, {place}, {count}\\)|triangle\\({place}, {far}\\)|\\[{place}(, {place}){{1,5}}\\])"
    )
    patterns = {
        "distance": far,
        "duration": f"{number} (s|min|h)",
        "speed": f"{number} m/s",
        "place": f"({place}|{listed})",
        "position": f"({place}|{listed})",
        "list of place": listed,
        "region": "[A-Za-z_][A-Za-z0-9_]{0,40}",
        "repeat": f"({count}|forever|{number} (s|min|h))",
    }
    return {key: {"type": "string", "pattern": f"^{pattern}$"} for key, pattern in patterns.items()}


def _field(type_: str, shape: Mapping[str, Schema]) -> Schema:
    if type_ in shape:
        return shape[type_]
    if type_.startswith("one of "):
        return {"enum": [one.strip() for one in type_.removeprefix("one of ").split(",")]}
    return _STRING


def _list_of_steps() -> Schema:
    return {"type": "array", "items": {"$ref": "#/$defs/step"}, "maxItems": MOST_STEPS}


def _closed(properties: Schema, required: list[str] | None = None) -> Schema:
    return {
        "type": "object",
        "additionalProperties": False,
        "properties": properties,
        "required": list(properties) if required is None else required,
    }


def read_answer(data: Any, text: str = "") -> ModelAnswer:
    """Read a reply.

    Args:
        data: the JSON value of the reply; None = it is looked for in the text.
        text: of the reply.

    Raises:
        NoAnswer: it is not of the form, or too large.
    """
    value = data if data is not None else _json_in(text)
    _bounded(value)
    value = whole(value)
    if not isinstance(value, dict):
        raise NoAnswer('answer with one JSON object: {"plan": .., "answer": {"tree": ..}}')
    plan = _prose(value.get("plan"))
    answer = value.get("answer", value)
    if isinstance(answer, dict) and isinstance(answer.get("tree"), dict):
        run = answer.get("run", value.get("run"))
        return ModelAnswer(plan, tree=answer["tree"], run=_values(run))
    if isinstance(answer, dict) and "steps" in answer and "task" in answer:
        return ModelAnswer(plan, tree={k: v for k, v in answer.items() if k not in ("plan", "run")})
    if isinstance(answer, dict) and _prose(answer.get("question")):
        return ModelAnswer(plan, question=_prose(answer["question"]))
    if isinstance(answer, dict) and _prose(answer.get("impossible")):
        return ModelAnswer(plan, impossible=_prose(answer["impossible"]), instead=_prose(answer.get("instead")))
    raise NoAnswer('"answer" must hold a "tree", a "question", or "impossible" with "instead"')


def _values(run: Any) -> tuple[Mapping[str, str], ...]:
    if not isinstance(run, list):
        return ()
    found = []
    for one in run[:40]:
        if isinstance(one, dict) and isinstance(one.get("name"), str) and "value" in one:
            words = one.get("words")
            value = {"name": one["name"], "value": str(one["value"]), "words": words if isinstance(words, str) else ""}
            found.append(value)
    return tuple(found)


def _prose(value: Any) -> str:
    return " ".join(value.split())[:MOST_TEXT] if isinstance(value, str) else ""


def _json_in(text: str) -> Any:
    start, end = text.find("{"), text.rfind("}")
    try:
        return json.loads(text[start : end + 1]) if 0 <= start < end else None
    except (ValueError, RecursionError) as error:
        raise NoAnswer(f"this is not JSON: {error}") from error


def _bounded(value: Any) -> None:
    """Refuse what is too deep, too long or too much."""
    left, queue = MOST_NODES, [(value, 0)]
    while queue:
        one, depth = queue.pop()
        left -= 1
        if left < 0 or depth > MOST_DEPTH * 2:
            raise NoAnswer("the answer is too large; write a shorter tree")
        if isinstance(one, str) and len(one) > MOST_TEXT * 2:
            raise NoAnswer("a text of the answer is too long")
        if isinstance(one, dict):
            queue += [(inner, depth + 1) for inner in one.values()]
        elif isinstance(one, list):
            if len(one) > MOST_STEPS * 4:
                raise NoAnswer("a list of the answer is too long")
            queue += [(inner, depth + 1) for inner in one]
