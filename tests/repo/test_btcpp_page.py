"""The tables of docs/btcpp.md are those of the program (--update-golden rewrites them)."""

import re
from pathlib import Path

import pytest

from formiga_bt.bridges.table import LOSSES, TROUBLES, as_markdown, codes_as_markdown
from tests.golden import Wording

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "btcpp.md"
TABLES = {
    "correspondences": as_markdown(),
    "losses": codes_as_markdown(LOSSES),
    "troubles": codes_as_markdown(TROUBLES),
}


@pytest.mark.parametrize("name", list(TABLES))
def test_a_table_of_the_page_is_that_of_the_program(name: str, wording: Wording) -> None:
    text = PAGE.read_text(encoding="utf-8")
    block = re.compile(rf"(<!-- table: {name} -->\n\n).*?(\n?<!-- end -->)", re.DOTALL)
    assert block.search(text)
    wording.file(PAGE, block.sub(lambda m: f"{m[1]}{TABLES[name]}\n\n<!-- end -->", text))


def test_every_code_that_the_bridge_reports_is_in_its_tables() -> None:
    sources = (ROOT / "formiga_bt" / "bridges").glob("*.py")
    used = {code for path in sources for code in re.findall(r'"([LX]\d\d)"', path.read_text(encoding="utf-8"))}
    assert used == {*LOSSES, *TROUBLES}
