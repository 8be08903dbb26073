"""Trees of others become task files: the text and the remarks are pinned (--update-golden rewrites them)."""

from collections import Counter
from itertools import cycle
from pathlib import Path

import pytest

from formiga_bt.bridges.btcpp_in import import_btcpp
from formiga_bt.bridges.elements import parse as parse_xml
from formiga_bt.bridges.elements import write
from formiga_bt.bridges.table import TROUBLES
from formiga_bt.cli.inputs import CheckWorld
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.text.document import parse
from tests.golden import Wording
from tests.shares import some
from tests.unit.bridges.conftest import ROOT

FOREIGN = sorted((ROOT / "tests" / "unit" / "bridges" / "foreign").glob("*.xml"))
LEFT_TO_PEOPLE = {"E020", "E021", "W060", "E043"}
"""Types and actions that only the reader can name; what a file never uses, or never reaches."""


@pytest.mark.parametrize("path", FOREIGN, ids=lambda path: path.stem)
def test_the_text_and_the_remarks_are_these(path: Path, world: CheckWorld, wording: Wording) -> None:
    done = import_btcpp(path.read_bytes(), path.name, world.catalogue)
    remarks = "".join(f"# {d.mark}: {d.code}: {d.message}\n" for d in done.found)
    wording.file(path.with_suffix(".expected.yaml"), remarks + done.text)


@pytest.mark.parametrize("path", FOREIGN, ids=lambda path: path.stem)
def test_what_is_left_to_mend_is_what_only_people_know(path: Path, world: CheckWorld) -> None:
    done = import_btcpp(path.read_bytes(), path.name, world.catalogue)
    assert {d.code for d in done.found} <= set(TROUBLES)
    found = load_task_text(done.text, "task.yaml", catalogue=world.catalogue).diagnostics
    assert {d.code for d in found} <= LEFT_TO_PEOPLE


def test_a_file_without_trees_is_refused(wording: Wording) -> None:
    done = import_btcpp(b"<root>\n</root>", "none.xml")
    assert done.text == ""
    wording([f"{d.mark}: {d.code}: {d.message}" for d in done.found])


def test_a_tree_that_calls_itself_is_cut_there(wording: Wording) -> None:
    xml = (
        b'<root BTCPP_format="4"><BehaviorTree ID="A"><Sequence><Go/><SubTree ID="A"/></Sequence></BehaviorTree></root>'
    )
    done = import_btcpp(xml, "a.xml")
    assert "X08" in {d.code for d in done.found}
    wording(done.text)
    assert [one.code for one in done.errors] == ["X08"]


def test_names_and_texts_of_a_file_cannot_add_lines_to_the_task() -> None:
    xml = (
        b'<root BTCPP_format="4"><BehaviorTree ID="A"><Sequence name="x&#10;on_failure: []">'
        b'<Go text="a&#10;b: [" _description="# &#10;- wait: 1 s"/></Sequence></BehaviorTree></root>'
    )
    text = import_btcpp(xml, "a.xml").text
    assert "\non_failure" not in text
    assert "\n- wait" not in text
    assert '"a\\nb: ["' in text


ODD_VALUES = (
    "",
    "{x}",
    "-1",
    "abc",
    "[1",
    "${{a: b}}",
    "pause",
    "guard",
    "1e400",
    "'",
    "a := b := c",
    "\u2028",
    "!" * 3000,
)

EACH = some(1, 2)
"""So often an attribute of an element gets odd values in one file, each time other ones."""


@pytest.mark.parametrize("path", FOREIGN, ids=lambda path: path.stem)
def test_a_file_with_odd_values_becomes_yaml_or_is_refused(path: Path, world: CheckWorld) -> None:
    root = parse_xml(path.read_bytes())
    odd_values = cycle(ODD_VALUES)
    seen = Counter[tuple[str, str]]()
    for element in root.walk():
        for name in [*element.attrs, "_formiga", "_skipIf", "_formiga_when"]:
            seen[element.tag, name] += 1
            if seen[element.tag, name] > EACH:
                continue
            before = dict(element.attrs)
            for odd in (next(odd_values), next(odd_values)):
                element.attrs[name] = odd
                done = import_btcpp(write(root).encode(), "odd.xml", world.catalogue)
                assert (not done.text) or parse(done.text, "odd.yaml")[1] == [], (element.tag, name, odd)
            element.attrs = before
