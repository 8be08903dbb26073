"""The JSON form for language models: every shipped task has it, it means the same, and mistakes are told with JSON paths."""

import json
from pathlib import Path
from random import Random
from typing import Any

import jsonschema
import pytest

from formiga_bt.editor.llm_schema import llm_schema
from formiga_bt.lang.json_form.reading import LoadedJson, load_task_json, to_yaml
from formiga_bt.lang.json_form.writing import from_yaml
from formiga_bt.lang.loader import load_catalogue, load_site, load_task
from formiga_bt.lang.text.formatting import format_text
from tests.golden import Wording
from tests.property.strategies import load, task_text
from tests.property.test_formatting import meaning

ROOT = Path(__file__).parents[3]
CATALOGUE = load_catalogue([ROOT / "actions" / "base.yaml"])[0]
SITE = load_site(ROOT / "trees" / "demo-site.yaml", CATALOGUE)[0]
TREES = [p for p in sorted((ROOT / "trees").glob("*.yaml")) if "\ntask: " in p.read_text() and ".test" not in p.name]
SCHEMA = llm_schema(CATALOGUE)
STRICT = llm_schema(CATALOGUE, strict=True)
Check = jsonschema.Draft202012Validator
"""By its own call each time, `jsonschema.validate` would check the schema itself anew, which one test does."""
ALLOWED = {"type", "properties", "required", "additionalProperties", "items", "anyOf", "$ref", "$defs", "enum", "const"}


def read(data: Any) -> LoadedJson:
    return load_task_json(data, catalogue=CATALOGUE, site=SITE, library=[ROOT / "trees"])


def fits(data: Any, schema: Any, root: Any) -> bool:
    """Return whether an object has only keys of a closed object, and its constants; or what is no object, a schema of none."""
    if "$ref" in schema:
        return fits(data, root["$defs"][schema["$ref"].rpartition("/")[2]], root)
    if "anyOf" in schema:
        return any(fits(data, one, root) for one in schema["anyOf"])
    if not isinstance(data, dict):
        return "properties" not in schema
    keys = schema.get("properties", {})
    return set(data) <= set(keys) and all(data.get(k) == one["const"] for k, one in keys.items() if "const" in one)


def filled(data: Any, schema: Any, root: Any) -> Any:
    """Return data with null for each key of a strict schema that it leaves out."""
    if "$ref" in schema:
        return filled(data, root["$defs"][schema["$ref"].rpartition("/")[2]], root)
    if "anyOf" in schema:
        fitting = [one for one in schema["anyOf"] if fits(data, one, root)]
        return filled(data, fitting[0], root) if fitting else data
    if isinstance(data, list):
        return [filled(one, schema["items"], root) for one in data]
    if isinstance(data, dict) and "properties" in schema:
        extra = {key: value for key, value in data.items() if key not in schema["properties"]}
        keys = schema["properties"]
        return extra | {k: filled(data[k], s, root) if k in data else None for k, s in keys.items()}
    return data


@pytest.mark.parametrize("path", TREES, ids=lambda path: path.stem)
def test_a_shipped_tree_goes_to_json_and_back(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    data = from_yaml(text, CATALOGUE)
    Check(SCHEMA).validate(data)
    done = read(json.dumps(data))

    assert not done.problems, [(p.path, p.diagnostic.message) for p in done.problems]
    first = load_task(path, catalogue=CATALOGUE, site=SITE, library=[ROOT / "trees"]).task
    assert done.task is not None
    assert meaning(done.task) | {"files": 0} == meaning(first) | {"files": 0}
    assert format_text(done.yaml, "task.yaml").text == done.yaml


@pytest.mark.parametrize("seed", range(40))
def test_a_drawn_tree_goes_to_json_and_back(seed: int) -> None:
    text = format_text(task_text(Random(seed)), "").text
    assert text is not None
    again, _ = to_yaml(from_yaml(text, CATALOGUE))

    assert meaning(load(again)) == meaning(load(text))


@pytest.mark.parametrize("path", TREES[:4], ids=lambda path: path.stem)
def test_a_strict_schema_takes_null_for_what_is_not_given(path: Path) -> None:
    data = from_yaml(path.read_text(encoding="utf-8"), CATALOGUE)
    with pytest.raises(jsonschema.ValidationError):
        Check(STRICT).validate(data)
    full = filled(data, STRICT, STRICT)
    Check(STRICT).validate(full)

    assert meaning(read(full).task) == meaning(read(data).task) is not None


def walk(schema: Any, *, names: bool = False) -> list[str]:
    if isinstance(schema, list):
        return [key for one in schema for key in walk(one)]
    if not isinstance(schema, dict):
        return []
    own = [] if names else list(schema)
    inside = [walk(v, names=not names and k in ("properties", "$defs")) for k, v in schema.items() if k != "enum"]
    return own + [key for keys in inside for key in keys]


@pytest.mark.parametrize("strict", [False, True])
def test_the_schema_has_only_what_every_decoder_knows(strict: bool) -> None:
    schema = llm_schema(CATALOGUE, strict=strict)
    jsonschema.Draft202012Validator.check_schema(schema)

    assert set(walk(schema)) <= ALLOWED | {"description"}
    assert json.dumps(schema).count('"additionalProperties": true') == 0


def test_each_action_of_the_catalogue_is_a_step_of_its_own() -> None:
    steps = {one["$ref"].rpartition("/")[2] for one in SCHEMA["$defs"]["step"]["anyOf"]}

    assert {"do_GoTo", "do_TakeOff", "do_Explore", "do_MiniFinder", "step_ask", "step_parallel"} <= steps
    assert not {"do_CutMotors", "do_Confirm", "step_do"} & steps
    assert SCHEMA["$defs"]["do_GoTo"]["required"] == ["action", "agent", "to"]


TASK: dict[str, Any] = {
    "formiga": 1,
    "task": "Look",
    "params": [{"name": "target", "type": "place"}],
    "agents": [{"name": "drone", "type": "lwd", "near": {"expr": "target"}}],
    "steps": [
        {"action": "TakeOff", "agent": "drone", "altitude": {"lit": "30 m"}},
        {"action": "GoTo", "agent": "drone", "to": {"expr": "above(target, 30 m)"}, "timeout": {"lit": "5 min"}},
        {"action": "LandIn", "agent": "drone", "at": {"expr": "target"}},
    ],
}


def changed(*path: Any, to: Any) -> Any:
    data = json.loads(json.dumps(TASK))
    at = data
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = to
    return data


@pytest.mark.parametrize(
    ("data", "path", "code", "message"),
    [
        (changed("steps", 1, "to", to={"expr": "target"}), "$.steps[1].to.expr", "E066", "'target' is on the ground"),
        (changed("steps", 1, "timeout", to={"lit": 15}), "$.steps[1].timeout.lit", "E017", "needs a unit"),
        (changed("steps", 0, "action", to="Takeoff"), "$.steps[0]", "E021", "did you mean 'TakeOff'?"),
        (changed("steps", 2, to={"wait": {"lit": "1 s"}}), "$.steps[1]", "E031", "can still be airborne"),
        (changed("steps", 1, "agent", to="dron"), "$.steps[1]", "E020", "did you mean 'drone'?"),
        (changed("agents", 0, "type", to="lwdd"), "$.agents[0].type", "E020", "did you mean 'lwd'?"),
        (changed("steps", 0, "timeot", to={"lit": "1 s"}), "$.steps[0].timeot.lit", "E022", "no field 'timeot'"),
        (changed("task", to="look"), "$.task", "E008", "CamelCase"),
        (changed("steps", 1, "to", to=None), "$.steps[1]", "E022", "GoTo needs 'to'"),
        (changed("steps", 1, "to", to={"place": 1}), "$.steps[1].to.place", "E008", "a value is"),
        (changed("params", to={"target": "place"}), "$.params", "E008", "must be a list"),
        ("{", "$", "E008", "this is not JSON"),
        ([], "$", "E008", "a task is a JSON object"),
    ],
)
def test_a_mistake_is_told_with_its_place_in_the_json(data: Any, path: str, code: str, message: str) -> None:
    assert read(TASK).problems == []
    (problem,) = read(data).problems

    assert (problem.path, problem.diagnostic.code) == (path, code)
    assert message in problem.diagnostic.message


def test_lines_in_messages_become_paths(wording: Wording) -> None:
    twice = [*TASK["params"], {"name": "target", "type": "place"}]
    (problem,) = read(changed("params", to=twice)).problems

    assert problem.path == "$.params[1]"
    wording(problem.diagnostic.message)


def test_lines_of_other_files_stay_lines(wording: Wording) -> None:
    up, _, down = TASK["steps"]
    drone, to = {"name": "drone", "value": {"expr": "drone"}}, {"name": "to", "value": {"expr": "target"}}
    tried = {"sequence": [{"call": "FlyOver", "with": [drone, to]}, down]}
    steps = [up, {"fallback": [tried, {"wait": {"lit": "1 s"}}]}]
    problems = read(changed("steps", to=steps) | {"imports": ["lib/flying.yaml"]}).problems
    (problem,) = (one for one in problems if one.diagnostic.code == "E031")

    wording(problem.diagnostic.message)


def test_texts_that_look_like_yaml_stay_texts() -> None:
    said = "- [x]: {y} # no\n'quoted' \"twice\""
    data = changed("steps", to=[{"notify": said}, {"fail": "no: never", "code": "off"}])
    done = read({**data, "agents": None, "params": None})

    assert done.problems == []
    assert done.task is not None
    assert done.task.steps[0].text.const == said  # type: ignore[attr-defined]
