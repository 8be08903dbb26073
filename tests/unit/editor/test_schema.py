"""The editor schema takes every file that ships and every right example of the docs, and refuses what it can see."""

from pathlib import Path
from typing import Any

import jsonschema
import pytest

from formiga_bt.base.packaged import files
from formiga_bt.editor.schema import editor_schema
from formiga_bt.lang.kinds import KINDS, MODIFIERS
from formiga_bt.lang.loader import load_catalogue, load_site
from formiga_bt.lang.pages import pages, whole
from tests.unit.editor.core_schema_json import as_json

ROOT = Path(__file__).parents[3]
CATALOGUE = load_catalogue(files("actions"))[0]
SITE = load_site(ROOT / "trees" / "demo-site.yaml", CATALOGUE)[0]
SCHEMA = editor_schema(CATALOGUE, SITE)
CHECK = jsonschema.Draft7Validator(SCHEMA)
SHIPPED = sorted([*(ROOT / "trees").rglob("*.yaml"), *(ROOT / "actions").glob("*.yaml")])
HEAD = "formiga: 1\ntask: Example\n"


def problems(text: str) -> list[str]:
    return [f"{list(error.absolute_path)}: {error.message[:200]}" for error in CHECK.iter_errors(as_json(text))]


def test_it_is_a_schema() -> None:
    jsonschema.Draft7Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.name)
def test_what_ships_is_valid(path: Path) -> None:
    assert problems(path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "code", [code for code, page in pages().items() if page.right and page.right.of != "catalogue"]
)
def test_the_right_examples_of_the_docs_are_valid(code: str) -> None:
    example = pages()[code].right
    assert example is not None
    assert problems(whole(example)) == []


@pytest.mark.parametrize(
    "text",
    [
        HEAD + "stepz: []\n",
        HEAD + "steps:\n  - dance: 3\n",
        HEAD + "steps:\n  - timeout: 3 s\n",
        HEAD + "steps:\n  - wait: 15\n",
        HEAD + "steps:\n  - wait: 15 m\n",
        HEAD + "steps:\n  - do: drone.Takeoff\n",
        HEAD + "steps:\n  - do: hwd.CutMotors\n",
        HEAD + "steps:\n  - do: drone.GoTo\n    with:\n      too: ${base}\n",
        HEAD + "steps:\n  - ask: Ready?\n    of: picker\n",
        HEAD + "steps:\n  - notify: Hello.\n    severity: loud\n",
        HEAD + "steps:\n  - parallel:\n      - sequence:\n          - slep: 3 s\n",
        HEAD + "priority: urgent\nsteps:\n  - wait: 1 s\n",
        HEAD + "params: {a: {type: 3}}\nsteps:\n  - wait: 1 s\n",
        HEAD + "agents: {d: {typ: lwd}}\nsteps:\n  - wait: 1 s\n",
        "formiga_site: 1\nname: here\nbase: {lat: 66.5, long: 25.7}\n",
        "formiga_test: 1\ntask: circle.yaml\ncases: [{name: once}]\n",
        "scenario: one\nagents: []\n",
        "types: {lwd: {extend: drone}}\n",
    ],
)
def test_what_is_wrong_is_refused(text: str) -> None:
    assert problems(text)


def test_every_kind_and_modifier_of_this_version_has_a_text_to_show() -> None:
    step: Any = SCHEMA["definitions"]["step"]
    kinds = list(KINDS.values())

    assert [one["required"] for one in step["anyOf"]] == [[kind.name] for kind in kinds]
    assert [name for name, one in step["properties"].items() if not one.get("description")] == []
    assert {kind.name for kind in kinds} | {option.name for option in MODIFIERS} <= set(step["properties"])
