"""The schema for yaml-language-server: completion, hover texts and quick checks while a file is being written.

One closed step object with all keys optional, and `anyOf` of `required: [kind]`: of a `oneOf` the server completes only the
first branch. Which fields `with` has follows from `do` by `if`/`then`. The schema accepts every file that `formiga check`
accepts; what it lets through is still checked by that. Made by `formiga schema --editor`.
"""

from collections.abc import Iterable
from typing import Any, Final

from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.units import LIKELY, UNITS, format_quantity
from formiga_bt.lang import site
from formiga_bt.lang.actions import ACTION
from formiga_bt.lang.catalogue import FILE, TYPE
from formiga_bt.lang.kinds import (
    FORM,
    KINDS,
    LIBRARY,
    MODIFIERS,
    PARAM,
    ROLE,
    SUBTREE,
    TASK,
    Option,
    StepKind,
)
from formiga_bt.lang.model import ActionSpec, Catalogue, FieldSpec, Site
from formiga_bt.lang.params import SIMPLE
from formiga_bt.lang.request.profiles import PROFILE
from formiga_bt.lang.rules.keys import RULE, RULES_FILE
from formiga_bt.lang.scenario.options import SCENARIO
from formiga_bt.lang.site import SITE
from formiga_bt.lang.types import Type
from formiga_bt.rehearsal.cases import options as cases

Schema = dict[str, Any]

_ANY: Final[Schema] = {}
_TEXT: Final[Schema] = {"type": ["string", "number", "boolean"]}
_NAME: Final = "^[A-Za-z][A-Za-z0-9_]*$"
_HOLE: Final = r"\$\{"


def editor_schema(catalogue: Catalogue, where: Site | None = None) -> Schema:
    """Return the schema of all files of the language; the key that a file begins with tells which it is.

    Args:
        catalogue: whose types, actions and fields are completed.
        where: the site whose places, ports and regions are completed.
    """
    maker = _Maker(catalogue, where)
    signs = (
        (("formiga_test",), "test"),
        (("formiga_profile",), "profile"),
        (("formiga_site",), "site"),
        (("formiga_rules",), "rules"),
        (("scenario",), "scenario"),
        (("types",), "catalogue"),
        (("actions",), "catalogue"),
    )
    of_others = [{"required": [*keys]} for keys, _ in signs]
    is_library = {"required": ["subtrees"], "not": {"required": ["task"]}}
    choices: list[Schema] = [
        {"if": {"required": [*keys], **but}, "then": {"$ref": f"#/definitions/{name}"}}
        for keys, name in signs
        for but in [
            {"not": {"required": ["formiga_site"]}} if keys == ("actions",) else {}
        ]  # a site names catalogues, too
    ]
    choices.append({"if": {"not": {"anyOf": [*of_others, is_library]}}, "then": {"$ref": "#/definitions/task"}})
    choices.append({"if": is_library, "then": {"$ref": "#/definitions/library"}})
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "formiga",
        "allOf": choices,
        "definitions": maker.definitions(),
    }


class _Maker:
    """Makes the definitions for one catalogue."""

    def __init__(self, catalogue: Catalogue, where: Site | None) -> None:
        self._catalogue = catalogue
        self._where = where
        self._actions = {name: spec for name, spec in catalogue.actions.items() if not spec.cuts}

    def definitions(self) -> Schema:
        """Return every definition by its name."""
        found: Schema = {
            "step": self._step(),
            "steps": {"type": "array", "minItems": 1, "items": {"$ref": "#/definitions/step"}},
            "param": self._param(),
            "form_field": self._object(FORM),
            "role": self._object(ROLE, required=()),
            "subtree": self._object(SUBTREE),
            "task": self._object(TASK),
            "library": self._object(LIBRARY),
            "site": self._site_file(),
            "rules": self._rules_file(),
            "scenario": self._object(SCENARIO),
            "profile": self._object(PROFILE),
            "test": self._test(),
            "catalogue": self._catalogue_file(),
        }
        for name, spec in self._actions.items():
            found[f"with_{name}"] = self._fields(spec)
        return found

    # --- objects -------------------------------------------------------------------------------------------------

    def _object(self, options: Iterable[Option], *, required: Iterable[str] | None = None) -> Schema:
        """Return a closed object with these options."""
        options = list(options)
        must = [option.name for option in options if option.required] if required is None else list(required)
        schema: Schema = {
            "type": "object",
            "additionalProperties": False,
            "properties": {option.name: self._option(option) for option in options},
        }
        return {**schema, "required": must} if must else schema

    def _option(self, option: Option) -> Schema:
        special = self._special(option.name, option.form)
        schema = special if special is not None else self._form(option.form, option)
        return {"description": option.doc, **schema} if option.doc else schema

    def _special(self, name: str, form: str) -> Schema | None:
        """Return the schema of a key whose meaning its form does not tell."""
        types = self._type_names()
        known: dict[str, Schema] = {
            "params": _map({"$ref": "#/definitions/param"}),
            "agents": _map({"$ref": "#/definitions/role"}),
            "with_agents": _map({"$ref": "#/definitions/role"}),
            "subtrees": _map({"$ref": "#/definitions/subtree"}),
            "records": _map(_map({"anyOf": [{"type": "string"}, {"type": "object"}]})),
            "form": _map({"anyOf": [{"type": "string"}, {"$ref": "#/definitions/form_field"}]}),
            "cases": _map({"$ref": "#/definitions/steps"}),
        }
        if form == "map" and name in known:
            return known[name]
        if name == "with_resource":
            named = {"type": "string", "examples": list(self._where.resources) if self._where is not None else []}
            counted = _map({"type": "integer", "minimum": 1})
            return {"anyOf": [named, {"type": "array", "items": {"anyOf": [named, counted]}}, counted]}
        if form == "value" and name == "agents":
            return {"type": "array"}
        if form == "words" and name in ("any_of", "of"):
            return {"type": "array", "items": {"type": "string", "examples": types}}
        return None

    def _form(self, form: str, of: Option | StepKind) -> Schema:
        values = list(of.values) if isinstance(of, Option) else []
        keys = of.keys if isinstance(of, Option) else ()
        match form:
            case "action":
                return self._do()
            case "text" | "expr":
                return dict(_TEXT)
            case "cond":
                return {"type": ["string", "boolean"]}
            case "word":
                return {"type": "string", **({"enum": values} if values else {})}
            case "words" | "roles":
                return {"type": "array", "items": dict(_TEXT)}
            case "flag":
                return {"type": "boolean"}
            case "name":
                return {"type": "string", **({"examples": self._type_names()} if of.name == "type" else {})}
            case "map":
                return {"type": "object"}
            case "steps":
                return {"$ref": "#/definitions/steps"}
            case "options":
                return self._object(keys) if keys else {"type": "object"}
            case _:
                schema = _value(of.type)
                return {"anyOf": [schema, self._object(keys)]} if keys else schema

    def _type_names(self) -> list[str]:
        return list(self._catalogue.types)

    # --- steps ---------------------------------------------------------------------------------------------------

    def _step(self) -> Schema:
        """Return the one step object: every key of every kind, and that one kind must be there."""
        properties: Schema = {}
        merged: dict[str, list[tuple[str, Option]]] = {}
        for kind in KINDS.values():
            special = self._special(kind.name, kind.form)
            properties[kind.name] = {
                "description": _said_of(kind),
                **(special if special is not None else self._form(kind.form, kind)),
            }
            for option in kind.options:
                merged.setdefault(option.name, []).append((kind.name, option))
        for name, uses in merged.items():
            if name not in properties:
                properties[name] = self._merged(uses)
        for option in MODIFIERS:
            properties[option.name] = self._option(option)
        return {
            "type": "object",
            "additionalProperties": False,
            "properties": properties,
            "anyOf": [{"required": [kind.name]} for kind in KINDS.values()],
            "allOf": [self._fields_of(name) for name in self._actions],
        }

    def _merged(self, uses: list[tuple[str, Option]]) -> Schema:
        """Return an option that several kinds have."""
        texts: dict[str, list[str]] = {}
        shapes: list[Schema] = []
        for kind, option in uses:
            texts.setdefault(option.doc, []).append(kind)
            shape = {key: value for key, value in self._option(option).items() if key != "description"}
            shapes += [shape] if shape not in shapes else []
        said = "\n\n".join(f"{text} (of {', '.join(kinds)})" for text, kinds in texts.items())
        return {"description": said, **(shapes[0] if len(shapes) == 1 else {"anyOf": shapes})}

    def _do(self) -> Schema:
        names = "|".join(self._actions)
        found = {f"{type_}.{name}" for type_ in self._type_names() for name in self._of(type_)}
        return {"type": "string", "pattern": rf"^\s*[A-Za-z]\w*\.({names})\s*$", "examples": sorted(found)}

    def _of(self, type_: str) -> list[str]:
        return [name for name in self._catalogue.types[type_].actions if name in self._actions and name != CONFIRM]

    def _fields_of(self, name: str) -> Schema:
        pattern = rf"\.{name}\s*$"
        return {
            "if": {"required": ["do"], "properties": {"do": {"type": "string", "pattern": pattern}}},
            "then": {"properties": {"with": {"$ref": f"#/definitions/with_{name}"}}},
        }

    def _fields(self, spec: ActionSpec) -> Schema:
        properties = {name: self._field(field) for name, field in spec.fields.items()}
        said = {"description": spec.help} if spec.help else {}
        return {"type": "object", "additionalProperties": False, **said, "properties": properties}

    def _field(self, field: FieldSpec) -> Schema:
        notes = [field.help] if field.help else []
        for word, bound in (("At least", field.min), ("At most", field.max)):
            if bound is not None:
                notes.append(f"{word} {_quantity(field.type, bound)}.")
        if field.default is not None:
            notes.append(f"Default: {field.default.source.removeprefix('${').removesuffix('}')}.")
        elif field.optional:
            notes.append("May be left out.")
        notes.append(f"({field.type})")
        return {"description": " ".join(notes), **_value(field.type.name), **self._places(field.type)}

    def _places(self, of: Type) -> Schema:
        here = self._where
        if of.name == "position":
            return {"examples": ["${above(target, 60 m)}"]}
        if here is None or of.name not in ("place", "region"):
            return {}
        return {"examples": [*here.places, *here.ports] if of.name == "place" else list(here.regions)}

    # --- other mappings ------------------------------------------------------------------------------------------

    def _param(self) -> Schema:
        types = [*SIMPLE, "enum"]
        listed = {"type": "object", "additionalProperties": False, "required": ["list"], "properties": {"list": {}}}
        short = {"type": "string", "pattern": _NAME, "examples": list(SIMPLE)}
        long = self._object(PARAM)
        long["properties"]["type"] = {
            "description": "The type.",
            "anyOf": [{"type": "string", "pattern": _NAME, "examples": types}, listed],
        }
        return {"anyOf": [short, listed, long]}

    def _site_file(self) -> Schema:
        schema = self._object(SITE)
        keys: Schema = schema["properties"]
        agent = self._object(site.AGENT)
        agent["properties"]["type"]["examples"] = self._type_names()
        closer = {
            "base": self._object(site.BASE),
            "ports": _map(self._object(site.PORT)),
            "resources": _map({"anyOf": [self._object(site.RESOURCE), {"type": "null"}]}),
            "rules": _map(self._rule()),
            "news": _map(self._channel()),
            "terrain": self._object(site.TERRAIN),
            "allocator": self._object(site.ALLOCATOR),
            "agents": _map(agent),
            "pilots": {"type": "array", "items": self._object(site.PILOT)},
            "people": _map({"type": "array", "items": {"type": "string"}}),
        }
        for name, one in closer.items():
            keys[name] = {"description": keys[name]["description"], **one}
        return schema

    def _channel(self) -> Schema:
        schema = self._object(site.CHANNEL)
        ways = (
            ("webhook", site.WEBHOOK, ("url", "secret")),
            ("mail", site.MAIL, ("password",)),
            ("mqtt", site.MQTT, ("password",)),
        )
        for way, table, secrets in ways:
            inner = self._object(table)
            for key in secrets:
                told = inner["properties"][key]["description"]
                inner["properties"][key] = {"description": told, **self._object(site.SECRET)}
            told = schema["properties"][way]["description"]
            schema["properties"][way] = {"description": told, **inner}
        return schema

    def _rule(self) -> Schema:
        schema = self._object(RULE)
        ids = {"type": "array", "items": {"type": "string"}}
        schema["properties"]["of"] = {
            "description": schema["properties"]["of"]["description"],
            "anyOf": [{"type": "string"}, ids],
        }
        return schema

    def _rules_file(self) -> Schema:
        schema = self._object(RULES_FILE)
        schema["properties"]["rules"] = {"description": "The rules by name.", **_map(self._rule())}
        return schema

    def _test(self) -> Schema:
        case = self._object(cases.CASE)
        case["properties"]["agents"] = {"type": "object"}
        case["properties"]["params"] = {"type": "object"}
        case["properties"]["expect"] = {"description": "What must have come.", **self._object(cases.EXPECT)}
        schema = self._object(cases.FILE)
        schema["properties"]["cases"] = {"type": "array", "items": case}
        return schema

    def _catalogue_file(self) -> Schema:
        schema = self._object(FILE)
        action = self._object(ACTION)
        action["properties"]["fields"] = _map({"$ref": "#/definitions/param"})
        one = {"anyOf": [self._object(TYPE), {"type": "null"}]}
        schema["properties"]["types"] = _map(one)
        schema["properties"]["actions"] = _map({"anyOf": [action, {"type": "null"}]})
        return schema


def _map(of: Schema) -> Schema:
    return {"type": "object", "additionalProperties": of}


def _said_of(kind: StepKind) -> str:
    must = [option.name for option in kind.options if option.required]
    return kind.doc + (f" Needs {', '.join(must)}." if must else "")


def _quantity(of: Type, value: float) -> str:
    return format_quantity(of.name, value) if of.name in LIKELY else f"{value:g}"


def _value(type_: str) -> Schema:
    """Return the schema of a literal or `${...}` of a type; quantities without a unit are flagged at once."""
    if type_ in LIKELY:
        units = "|".join(unit for unit, (name, _) in UNITS.items() if name == type_)
        return {"type": "string", "pattern": rf"{_HOLE}|^\s*[+-]?[0-9][0-9.eE+-]*\s*({units})\s*$"}
    if type_ == "bool":
        return {"anyOf": [{"type": "boolean"}, {"type": "string", "pattern": _HOLE}]}
    if type_ in ("text", "enum", "agent"):
        return dict(_TEXT)
    if type_ in ("int", "number"):
        return {"type": ["number", "string"]}
    return dict(_ANY)
