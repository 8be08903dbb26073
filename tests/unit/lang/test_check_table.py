"""The table of checks, row by row: each mistake is found, under its code, where it was made, with a word on how to mend it.

The rows are in `tests/lang_errors/check_table.txt`; the exact words of many of them are pinned in the files beside it.
"""

import re
from pathlib import Path

import pytest

from formiga_bt.base.diagnostics import Diagnostic, render
from formiga_bt.lang.loader import load_catalogue, load_site, load_task_text
from formiga_bt.lang.model import Catalogue
from formiga_bt.lang.pages import PageExample, whole

ROOT = Path(__file__).parents[3]
MUSEUM = ROOT / "tests" / "lang_errors"
ROWS = re.findall(
    r"^## (\w\d{3}) (.*?) @ (.*)\n((?:(?!## ).*\n)*)", (MUSEUM / "check_table.txt").read_text("utf-8"), re.MULTILINE
)


@pytest.fixture(scope="module")
def catalogue() -> Catalogue:
    found, problems, _ = load_catalogue([ROOT / "actions" / "base.yaml", MUSEUM / "catalogue" / "kite.yaml"])
    assert not problems
    return found


def check(text: str, catalogue: Catalogue) -> list[Diagnostic]:
    site = load_site(ROOT / "trees" / "demo-site.yaml", catalogue)[0]
    return load_task_text(text, "slip.yaml", catalogue=catalogue, site=site).diagnostics


@pytest.mark.parametrize(("code", "what", "at", "piece"), ROWS, ids=[f"{row[0]} {row[1]}" for row in ROWS])
def test_the_mistake_is_found_where_it_is(code: str, what: str, at: str, piece: str, catalogue: Catalogue) -> None:
    text = piece if piece.startswith(("formiga:", "task:")) else whole(PageExample(piece))
    found = check(text, catalogue)
    said = "\n".join([what, text, *(render(one, {"slip.yaml": text}) for one in found)])
    mine = [one for one in found if one.code == code]
    assert mine, said

    first = mine[0]
    assert text.split("\n")[first.mark.line - 1][first.mark.col - 1 :].startswith(at), said
    assert first.help or re.search(r"did you mean|;|: ", first.message), said
    assert [one.code for one in found if one.severity == "error"] in ([code], []), said


def test_every_code_of_a_task_has_a_row() -> None:
    known = {path.name[:4] for path in MUSEUM.glob("[EW][0-9]*.yaml")}

    assert known - {row[0] for row in ROWS} <= {"E080", "E087", "W076", "W180"}
