"""The tables of docs/reference.md are what the tables of the language, the catalogue and the helpers say.

`pytest tests/repo/test_reference.py --update-golden` rewrites the generated tables; read the difference.
"""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest

from formiga_bt.base.heights import parse_heights
from formiga_bt.base.units import LIKELY, UNITS, format_quantity
from formiga_bt.lang import kinds
from formiga_bt.lang.actions import ACTION
from formiga_bt.lang.catalogue import TYPE
from formiga_bt.lang.expr.helpers import REQUIRED, STANDARD, Helper
from formiga_bt.lang.expr.scope import AGENT_FIELDS, PLACE_FIELDS, POSITION_FIELDS, TASK_FIELDS
from formiga_bt.lang.kinds import ENVELOPE, KINDS, Option
from formiga_bt.lang.loader import load_catalogue, load_task_text
from formiga_bt.lang.model import ActionSpec, Catalogue, FieldSpec
from formiga_bt.lang.site import SITE, load_site_text
from formiga_bt.lang.types import Type
from tests.golden import Wording

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference.md"
SUBTREES_PAGE = ROOT / "docs" / "language" / "subtrees.md"
NAMES = (
    "task", "subtree", "param", "role", "kinds", "modifiers", "retry", "clears", "envelope", "units", "fields", "actions",
    "events", "helpers",
)  # fmt: skip
PRINTED = {
    "action": "`role.Action`", "text": "text", "flag": "true or false", "cond": "a condition", "expr": "an expression",
    "name": "a name", "roles": "roles", "map": "names with values", "steps": "steps",
    "words": "a list of words", "word": "a word",
}  # fmt: skip
"""What the value of a key looks like, in words."""


@pytest.fixture(scope="module")
def catalogue() -> Catalogue:
    found, problems, _ = load_catalogue([ROOT / "actions" / "base.yaml"])
    assert problems == []
    return found


def takes(option: Option) -> str:
    """Return what may stand as the value of a key."""
    if option.values:
        return ", ".join(f"`{word}`" for word in option.values)
    if option.form == "value":
        return option.type or "a value"
    return "keys of its own" if option.form == "options" else PRINTED.get(option.form, option.form)


def needs(option: Option) -> str:
    return " **Required.**" if option.required else ""


def keys(options: Iterable[Option]) -> str:
    rows = [f"| `{o.name}` | {takes(o)} | {o.doc}{needs(o)} |" for o in options]
    return "\n".join(["| key | takes | |", "|---|---|---|", *rows])


def step_kinds() -> str:
    rows = []
    for kind in KINDS.values():
        own = Option(kind.name, kind.form, kind.doc, type=kind.type)
        rows.append(f"| **`{kind.name}`** | {takes(own)} | {kind.doc} |")
        rows += [f"| `{o.name}` | {takes(o)} | {o.doc}{needs(o)} |" for o in kind.options]
    return "\n".join(["| kind, its options | takes | |", "|---|---|---|", *rows])


def units() -> str:
    rows = [f"| {name} | {', '.join(f'`{unit}`' for unit, of in UNITS.items() if of[0] == name)} |" for name in LIKELY]
    return "\n".join(["| type | units |", "|---|---|", *rows])


def fields() -> str:
    rows: list[tuple[str, Mapping[str, Type]]] = [
        ("agent", AGENT_FIELDS), ("place", PLACE_FIELDS), ("position", POSITION_FIELDS), ("`task`", TASK_FIELDS.fields)
    ]  # fmt: skip
    told = (f"| {name} | {'; '.join(f'`{one}`: {spoken(of)}' for one, of in known.items())} |" for name, known in rows)
    return "\n".join(["| of | fields |", "|---|---|", *told])


def events(catalogue: Catalogue) -> str:
    rows = []
    for name, of in catalogue.types.items():
        for event, known in of.events.items():
            rows.append(
                f"| {name} | `{event}` | {'; '.join(f'`{n}`: {spoken(t)}' for n, t in known.items()) or 'none'} |"
            )
    return "\n".join(["| agent type | event | fields |", "|---|---|---|", *rows])


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
        "task": keys(kinds.TASK),
        "subtree": keys(kinds.SUBTREE),
        "param": keys(kinds.PARAM),
        "role": keys(kinds.ROLE),
        "kinds": step_kinds(),
        "modifiers": keys(kinds.MODIFIERS),
        "retry": keys(kinds.RETRY),
        "clears": keys(kinds.CLEARS),
        "envelope": keys(ENVELOPE),
        "units": units(),
        "fields": fields(),
        "actions": "\n".join(["| action | fields | result | agent types | |", "|---|---|---|---|---|", *actions]),
        "events": events(catalogue),
        "helpers": "\n".join(["| helper | gives | |", "|---|---|---|", *helpers]),
    }


@pytest.mark.parametrize("name", NAMES)
def test_a_table_of_the_reference_is_what_the_program_says(name: str, catalogue: Catalogue, wording: Wording) -> None:
    table = tables(catalogue)[name]
    text = PAGE.read_text(encoding="utf-8")
    block = re.compile(rf"(<!-- table: {name} -->\n).*?(<!-- end -->)", re.DOTALL)
    assert block.search(text)
    wording.file(PAGE, block.sub(lambda m: f"{m[1]}\n{table}\n\n{m[2]}", text))


def test_the_reference_has_no_table_that_is_not_made(catalogue: Catalogue) -> None:
    assert re.findall(r"<!-- table: (\w+) -->", PAGE.read_text(encoding="utf-8")) == [*NAMES]
    assert set(tables(catalogue)) == set(NAMES)


def test_every_shipped_subtree_is_listed_with_its_params() -> None:
    text = SUBTREES_PAGE.read_text(encoding="utf-8")
    catalogue, _, _ = load_catalogue(sorted((ROOT / "actions").glob("*.yaml")))
    libraries = sorted((ROOT / "trees" / "lib").glob("*.yaml"))
    assert libraries
    for path in libraries:
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
