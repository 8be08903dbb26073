"""The tables of docs/language.md are what the catalogue, the registry of helpers and the shipped libraries say.

`UPDATE_EXPECTED=1 pytest tests/repo/test_reference.py` rewrites the generated tables; read the difference.
"""

import os
import re
from pathlib import Path

import pytest

from formiga_bt.heights import parse_heights
from formiga_bt.lang.actions import ACTION
from formiga_bt.lang.catalogue import TYPE
from formiga_bt.lang.helpers import REQUIRED, STANDARD, Helper
from formiga_bt.lang.kinds import ENVELOPE
from formiga_bt.lang.loader import load_catalogue, load_task_text
from formiga_bt.lang.model import ActionSpec, Catalogue, FieldSpec
from formiga_bt.lang.site import SITE, load_site_text
from formiga_bt.lang.types import Type
from formiga_bt.units import LIKELY, format_quantity

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "docs" / "language.md"


@pytest.fixture(scope="module")
def catalogue() -> Catalogue:
    found, problems, _ = load_catalogue([ROOT / "actions" / "base.yaml"])
    assert problems == []
    return found


def spoken(type_: Type) -> str:
    return str(type_).replace("$", "")


def field(spec: FieldSpec) -> str:
    notes = [spoken(spec.type)]
    for word, bound in (("min", spec.min), ("max", spec.max)):
        if bound is not None:
            notes.append(f"{word} {format_quantity(spec.type.name, bound) if spec.type.name in LIKELY else bound}")
    if spec.default is not None:
        notes.append(f"default {spec.default.source.removeprefix('${').removesuffix('}')}")
    elif spec.optional:
        notes.append("optional")
    return f"`{spec.name}`: {', '.join(notes)}"


def action(spec: ActionSpec, catalogue: Catalogue) -> str:
    fields = "; ".join(map(field, spec.fields.values())) or "none"
    result = "; ".join(f"`{name}`: {spoken(of)}" for name, of in spec.result.items()) or "nothing"
    types = ", ".join(name for name, of in catalogue.types.items() if spec.name in of.actions)
    return f"| `{spec.name}` | {fields} | {result} | {types} | {spec.help} |"


def argument(helper: Helper) -> str:
    shown = []
    for arg in helper.args:
        default = "" if arg.default is REQUIRED else f" = {arg.default:g}"
        shown.append(f"{arg.name}{'...' if arg.rest else ''}: {spoken(arg.type)}{default}")
    return f"| `{helper.name}({', '.join(shown)})` | {spoken(helper.returns)} | {helper.help} |"


def tables(catalogue: Catalogue) -> dict[str, str]:
    actions = [action(spec, catalogue) for spec in catalogue.actions.values()]
    helpers = [argument(helper) for name in STANDARD.names() for helper in STANDARD.forms(name)]
    return {
        "actions": "\n".join(["| action | fields | result | agent types | |", "|---|---|---|---|---|", *actions]),
        "helpers": "\n".join(["| helper | gives | |", "|---|---|---|", *helpers]),
    }


@pytest.mark.parametrize("name", ["actions", "helpers"])
def test_a_table_of_the_guide_is_what_the_program_says(name: str, catalogue: Catalogue) -> None:
    table = tables(catalogue)[name]
    text = GUIDE.read_text(encoding="utf-8")
    block = re.compile(rf"(<!-- table: {name} -->\n\n).*?(\n\n<!-- end -->)", re.DOTALL)
    if os.environ.get("UPDATE_EXPECTED"):
        GUIDE.write_text(block.sub(lambda m: m[1] + table + m[2], text), encoding="utf-8")
        text = GUIDE.read_text(encoding="utf-8")
    found = block.search(text)
    assert found is not None
    assert found[0].split("\n\n", 1)[1].removesuffix("\n\n<!-- end -->") == table


def test_every_shipped_subtree_is_listed_with_its_params(catalogue: Catalogue) -> None:
    text = GUIDE.read_text(encoding="utf-8")
    files = sorted((ROOT / "trees" / "lib").glob("*.yaml"))
    assert files
    for path in files:
        task = f"formiga: 1\ntask: All\nimports: [lib/{path.name}]\nsteps:\n  - wait: 1 s\n"
        loaded = load_task_text(task, "all.yaml", catalogue=catalogue, library=[ROOT / "trees"])
        assert loaded.task is not None
        assert f"`lib/{path.name}`" in text
        for subtree in loaded.task.subtrees.values():
            params = ", ".join(f"{param.name}: {param.type}" for param in subtree.params.values())
            assert f"| `{subtree.name}` | `{params}` |" in text


SITE_PAGE = ROOT / "docs" / "site.md"


def test_the_page_of_sites_names_every_key_of_sites_types_actions_and_limits() -> None:
    text = SITE_PAGE.read_text(encoding="utf-8")
    named = {word for cell in re.findall(r"^\| ([^|]+) \|", text, re.MULTILINE) for word in re.findall(r"`(\w+)", cell)}
    keys = {option.name for option in (*SITE, *TYPE, *ACTION, *ENVELOPE)}
    assert keys - named == set()


def test_the_examples_of_the_page_of_sites_check_without_a_warning(tmp_path: Path) -> None:
    text = SITE_PAGE.read_text(encoding="utf-8")
    site, more = re.findall(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    (tmp_path / "crane.yaml").write_text(more, encoding="utf-8")
    catalogue, problems, _ = load_catalogue([ROOT / "actions" / "base.yaml", tmp_path / "crane.yaml"])
    assert problems == []
    found, problems, _ = load_site_text(site, "site.yaml", catalogue)
    assert problems == []
    assert found is not None


def test_the_height_file_of_the_page_of_sites_can_be_read() -> None:
    text = SITE_PAGE.read_text(encoding="utf-8")
    grid = re.search(r"^```\n(ncols.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert grid is not None
    assert parse_heights(grid[1], 120.0).ground_m(0.0, -50.0) == 0.0
