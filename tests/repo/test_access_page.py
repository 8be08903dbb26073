"""The table of docs/access.md is the table by which the engine lets in.

`pytest tests/repo/test_access_page.py --update-golden` rewrites it; read the difference.
"""

import re
from pathlib import Path

from formiga_bt.base.roles import MAY, Deed, Role, roles_that_may
from tests.golden import Wording

PAGE = Path(__file__).parents[2] / "docs" / "access.md"


def table() -> str:
    rows = ["| | " + " | ".join(f"`{role}`" for role in Role) + " |", "|---" * (len(Role) + 1) + "|"]
    rows += [f"| {deed} | " + " | ".join("yes" if deed in MAY[role] else "" for role in Role) + " |" for deed in Deed]
    return "\n".join(rows)


def test_the_table_is_what_the_engine_does(wording: Wording) -> None:
    text = PAGE.read_text(encoding="utf-8")
    block = re.compile(r"(<!-- table: roles -->\n).*?(<!-- end -->)", re.DOTALL)
    assert block.search(text)
    wording.file(PAGE, block.sub(lambda m: f"{m[1]}\n{table()}\n\n{m[2]}", text))


def test_everything_may_be_done_by_somebody() -> None:
    assert [deed for deed in Deed if not roles_that_may(deed)] == []
