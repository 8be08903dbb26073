"""The table of keys tells of every key that there is, and the documentation tells of the table."""

from pathlib import Path

from formiga_bt.show.watch.aim import ABORT, FOR_ALL, FOR_MACHINES, ORDERS
from formiga_bt.show.watch.keys import TABLE, help_lines
from tests.golden import Wording

PAGE = (Path(__file__).parents[4] / "docs" / "seeing.md").read_text(encoding="utf-8")


def test_the_table_has_every_key_that_orders_once() -> None:
    told = [key.key for key in TABLE if key.group == "order"]
    assert sorted(told) == sorted(["1 ... 9", *ORDERS, *FOR_ALL, *FOR_MACHINES, ABORT])


def test_the_documentation_tells_of_every_key() -> None:
    section = PAGE.partition("`formiga watch`\n")[2].partition("\n## ")[0]
    assert [key.key for key in TABLE if len(key.key) == 1 and f"`{key.key}`" not in section] == []
    assert "`1` ... `9`" in section


def test_the_help_has_a_line_for_each_key_and_says_what_is_asked_first(wording: Wording) -> None:
    lines = help_lines(False)
    wording(lines)
    assert sum(line.startswith("  ") for line in lines) == len(TABLE)
    wording(help_lines(True))
