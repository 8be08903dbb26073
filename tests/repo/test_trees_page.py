"""docs/trees.md is what the shipped trees say of themselves; the examples of docs/testing.md are played.

`pytest tests/repo/test_trees_page.py --update-golden` rewrites the list; read the difference.
"""

import re
from pathlib import Path

import pytest

from formiga_bt.base.units import LIKELY, format_quantity
from formiga_bt.lang.model import Param, Role, Task
from formiga_bt.lang.request.profiles import load_profile
from formiga_bt.rehearsal.cases.judging import judge
from formiga_bt.rehearsal.cases.options import AGENT, ANSWER, CASE, DURING, EXPECT, GOAL
from formiga_bt.rehearsal.cases.reading import load_cases
from formiga_bt.rehearsal.cases.running import play
from formiga_bt.rehearsal.testing import packaged_task, packaged_world
from tests.golden import Wording

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "trees.md"
GUIDE = (ROOT / "docs" / "testing.md").read_text(encoding="utf-8")
ORDER = (
    "move_task", "explore_region", "pick_up", "watch_dog_sos", "watch_dog_request",
    "circle", "triangle", "zig_zag", "patrol_and_escort", "delivery",
)  # fmt: skip
WAREHOUSE = ("tote_run", "ward_delivery", "find_and_fetch")
CATALOGUE = packaged_world()[1]


def value(param: Param) -> str:
    """Return what holds for a parameter that is not given."""
    if param.default is None:
        return "optional" if param.optional else "required"
    if not param.default.is_const:
        return param.default.source.removeprefix("${").removesuffix("}")
    const = param.default.const
    if isinstance(const, bool):
        return "true" if const else "false"
    return format_quantity(param.type.name, const) if param.type.name in LIKELY else str(const)


def row(param: Param) -> str:
    kind = " or ".join(param.type.of) if param.type.name == "agent" else str(param.type)
    also = ", ".join(f"`{alias}`" for alias in param.aliases)
    return f"| `{param.name}` | {kind} | {value(param)} | {param.label or param.help} | {also} |"


def crew(role: Role) -> str:
    count = f"{role.count} " if role.count else ""
    return f"{count}{' or '.join(role.types)} (`{role.name}`)"


def section(title: str, name: str, folder: str = "") -> str:
    task: Task = packaged_task(f"{folder}trees/{name}", f"{folder}site.yaml") if folder else packaged_task(name)
    file = f"trees/{folder}trees/{name}.yaml" if folder else f"trees/{name}.yaml"
    rows = "\n".join(map(row, task.params.values()))
    others = f" Also called {', '.join(f'`{alias}`' for alias in task.aliases)}." if task.aliases else ""
    lines = [
        f"{title} {task.name}",
        f"{task.description}",
        f"![The tree of {task.name}](pictures/trees/{name}.svg)",
        f"File `{file}`, priority {task.priority}. Needs: {', '.join(map(crew, task.roles.values()))}.{others}",
        f"| parameter | type | without it | what | also called |\n|---|---|---|---|---|\n{rows}",
    ]
    return "\n\n".join(lines)


HEAD = """# The ten missions

They ship with formiga_bt, in `trees/`, each with a test file beside it ([testing.md](testing.md)). Try one:
`formiga dryrun Circle`, and see it: `formiga show Circle` ([seeing.md](seeing.md)).
The values without a parameter are those of the paper's text; `--profile paper-code` gives those of its code.

This page is made from the files.
"""


MORE = """## Missions of a warehouse

For ground robots, a lift, a door and a drone, on the site `trees/warehouse/site.yaml`. See them all at once, each machine a
process of its own: `formiga demo --scenario warehouse`.
"""


def test_the_page_is_what_the_files_say(wording: Wording) -> None:
    ten = "\n\n".join(section(f"## T{i + 1}", name) for i, name in enumerate(ORDER))
    more = "\n\n".join(section("###", name, "warehouse/") for name in WAREHOUSE)
    text = f"{HEAD}\n{ten}\n\n{MORE}\n{more}\n"

    wording.file(PAGE, text)


def test_the_example_of_a_test_file_passes(tmp_path: Path) -> None:
    (example,) = re.findall(r"^```yaml\n(formiga_test: 1\n.*?)^```", GUIDE, re.MULTILINE | re.DOTALL)
    file = tmp_path / "example.test.yaml"
    file.write_text(example, encoding="utf-8")
    loaded = load_cases(file, catalogue=CATALOGUE)

    assert loaded.diagnostics == []
    assert loaded.cases is not None
    for case in loaded.cases.cases:
        assert [str(one) for one in judge(case, play(loaded.cases, case))] == []


def test_the_example_of_a_profile_can_be_read(tmp_path: Path) -> None:
    (example,) = re.findall(r"^```yaml\n(formiga_profile: 1\n.*?)^```", GUIDE, re.MULTILINE | re.DOTALL)
    file = tmp_path / "windy.yaml"
    file.write_text(example, encoding="utf-8")
    profile = load_profile(file).profile

    assert profile is not None
    assert profile.texts("Circle") == {"radius": "8 m", "altitude": "15 m"}


@pytest.mark.parametrize(
    "options",
    [CASE, AGENT, ANSWER, GOAL, DURING, EXPECT],
    ids=["case", "agent", "answer", "goal", "during", "expect"],
)
def test_the_guide_names_every_key(options: tuple) -> None:  # type: ignore[type-arg]
    assert [option.name for option in options if not re.search(rf"`{option.name}\b", GUIDE)] == []
