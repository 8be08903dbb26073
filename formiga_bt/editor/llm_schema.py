"""The schema of a task in JSON form, for decoders that let a model write nothing else.

Such decoders know little of JSON Schema, and pass over what they do not know: so there are closed objects, `anyOf`, `const`,
`enum` and recursive `$ref` into `$defs` only; no patterns, formats, lengths, bounds, and no maps with free keys. Each action of
the catalogue is a step of its own. What the schema lets through is not yet right: `lang.llm_in.load_task_json` checks it.
Made by `formiga schema --llm`.
"""

from collections.abc import Iterable
from typing import Any, Final

from formiga_bt.base.asking import CONFIRM
from formiga_bt.lang.json_form.words import NAMED, POINTS, RECORDS, VALUED, field_key
from formiga_bt.lang.kinds import KINDS, MODIFIERS, RECORD_FIELD, TASK, Option
from formiga_bt.lang.model import ActionSpec, Catalogue

Schema = dict[str, Any]

_STRING: Final[Schema] = {"type": "string"}


def llm_schema(catalogue: Catalogue, *, strict: bool = False) -> Schema:
    """Return the schema of a task.

    Args:
        catalogue: whose types and actions may be used.
        strict: every key is required, and null stands for "not given", as some services want it.
    """
    maker = _Maker(catalogue)
    schema = {**maker.object(TASK), "$defs": maker.definitions()}
    return _strictly(schema) if strict else schema


class _Maker:
    def __init__(self, catalogue: Catalogue) -> None:
        self._catalogue = catalogue

    def definitions(self) -> Schema:
        """Return what the schema refers to."""
        actions = [spec for name, spec in self._catalogue.actions.items() if not spec.cuts and name != CONFIRM]
        kinds = [kind for kind in KINDS.values() if kind.name != "do"]
        branches = [f"do_{spec.name}" for spec in actions] + [f"step_{kind.name}" for kind in kinds]
        found: Schema = {
            "step": {"anyOf": [{"$ref": f"#/$defs/{name}"} for name in branches]},
            "value": self._value(),
        }
        for spec in actions:
            found[f"do_{spec.name}"] = self._action(spec)
        for kind in kinds:
            this = Option(kind.name, kind.form, kind.doc, kind.type, required=True)
            found[f"step_{kind.name}"] = self.object((this, *kind.options, *MODIFIERS))
        return found

    def object(self, options: Iterable[Option], more: Schema | None = None) -> Schema:
        """Return a closed object with these options."""
        options = list(options)
        return _closed(
            {**(more or {}), **{option.name: self._option(option) for option in options}},
            [*(more or {}), *(option.name for option in options if option.required)],
        )

    def _option(self, option: Option) -> Schema:
        schema = self._shape(option)
        return {"description": option.doc, **schema} if option.doc and "$ref" not in schema else schema

    def _shape(self, option: Option) -> Schema:
        name, form = option.name, option.form
        if form == "map" and name in NAMED:
            return _array(self._named(name))
        if form == "map" and name == RECORDS:
            return _array(_closed({"name": _STRING, "fields": _array(self.object(RECORD_FIELD, {"name": _STRING}))}))
        if form == "map" and name in VALUED:
            return _array(_closed({"name": _STRING, "value": {"$ref": "#/$defs/value"}}))
        if form == "map":
            return _array(_closed({"value": _STRING, "steps": _array({"$ref": "#/$defs/step"})}))
        if form == "steps":
            return _array({"$ref": "#/$defs/step"})
        if form == "options":
            return self.object(option.keys)
        if form == "flag":
            return {"type": "boolean"}
        if form in ("words", "roles"):
            types = list(self._catalogue.types)
            return _array({"enum": types} if name in ("any_of", "of") and form == "words" else _STRING)
        if form == "word" and option.values:
            return {"enum": list(option.values)}
        if name == "formiga":
            return {"const": 1}
        if form == "value":
            value: Schema = {"$ref": "#/$defs/value"}
            return {"anyOf": [value, self.object(option.keys)]} if option.keys else value
        return dict(_STRING)

    def _named(self, name: str) -> Schema:
        schema = self.object(NAMED[name], {"name": _STRING})
        if name == "params":
            schema["properties"]["type"] = {"anyOf": [_STRING, _closed({"list": _STRING})]}
        elif name in ("agents", "with_agents"):
            schema["properties"]["type"] = {"enum": list(self._catalogue.types)}
        return schema

    def _action(self, spec: ActionSpec) -> Schema:
        fields = {field_key(name): {"$ref": "#/$defs/value"} for name in spec.fields}
        must = [field_key(n) for n, f in spec.fields.items() if not f.optional and f.default is None]
        options = [o for o in (*KINDS["do"].options, *MODIFIERS) if o.name != "with"]
        rest = {option.name: self._option(option) for option in options}
        schema = _closed(
            {"action": {"const": spec.name}, "agent": _STRING, **fields, **rest}, ["action", "agent", *must]
        )
        return {"description": spec.help, **schema} if spec.help else schema

    def _value(self) -> Schema:
        plain = {"anyOf": [_STRING, {"type": "number"}, {"type": "boolean"}, *map(_point, POINTS)]}
        return {
            "anyOf": [
                _closed({"expr": _STRING}),
                _closed({"lit": plain}),
                _closed({"text": _STRING}),
                _closed({"list": _array({"$ref": "#/$defs/value"})}),
                _closed({"record": _array(_closed({"name": _STRING, "value": {"$ref": "#/$defs/value"}}))}),
            ]
        }


def _point(keys: tuple[str, ...]) -> Schema:
    scalar: Schema = {"anyOf": [_STRING, {"type": "number"}]}
    return _closed(dict.fromkeys(keys, scalar))


def _closed(properties: Schema, required: list[str] | None = None) -> Schema:
    return {
        "type": "object",
        "additionalProperties": False,
        "properties": properties,
        "required": list(properties) if required is None else required,
    }


def _array(items: Schema) -> Schema:
    return {"type": "array", "items": items}


def _strictly(schema: Any) -> Any:
    """Return the schema with every key required, and null allowed where a key need not be."""
    if isinstance(schema, list):
        return [_strictly(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    if schema.get("type") != "object" or "properties" not in schema:
        return {key: _strictly(value) for key, value in schema.items()}
    must = schema.get("required", [])
    properties = {
        name: _strictly(one) if name in must else {"anyOf": [_strictly(one), {"type": "null"}]}
        for name, one in schema["properties"].items()
    }
    rest = {key: _strictly(value) for key, value in schema.items() if key not in ("properties", "required")}
    return {**rest, "properties": properties, "required": list(properties)}
