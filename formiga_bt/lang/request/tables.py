"""Tables of values (CSV) as nodes: each row below the first one a mapping, with the line and the column of each cell.

A cell is a text between commas, with quotes round it where it has a comma itself; a table whose first row has semicolons, as
spreadsheets of many countries write them, is read by these. A row is one line; empty ones are passed over.
"""

import re
from typing import Final

from formiga_bt.base.bounds import MOST_CELLS
from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.text.document import Entry, Listing, Mapping_, Scalar
from formiga_bt.lang.text.reading import Problems, shorten

_CELL: Final = r'[ \t]*"((?:[^"]|"")*)"[ \t]*(?={sep}|$)|([^{sep}]*)'


def read_table(text: str, file: str, problems: Problems) -> Listing | None:
    """Return the rows of a table, or None if anything of it is wrong, which was reported with its row."""
    lines = text.removeprefix("\ufeff").splitlines()
    first = next((n for n, line in enumerate(lines, 1) if line.strip()), 0)
    if not first:
        problems.add("E008", Mark(file, 1, 1), "the table is empty", "its first row names the columns: id,lat,lng")
        return None
    before = len(problems.found)
    sep = ";" if ";" in lines[first - 1] and "," not in lines[first - 1] else ","
    names = [cell.text for cell in _cells(lines[first - 1], file, first, sep)]
    for name in names:
        if not name or names.count(name) > 1:
            what = "a column has no name" if not name else f"two columns are called '{shorten(name)}'"
            problems.add("E008", Mark(file, first, 1), what, "the first row names each column once")
            return None
    rows: list[Mapping_] = []
    for n, line in enumerate(lines[first:], first + 1):
        if not line.strip():
            continue
        if (len(rows) + 1) * len(names) > MOST_CELLS:
            problems.add("E003", Mark(file, n, 1), f"more than {MOST_CELLS:,} values in one file", "make two of it")
            return None
        cells = _cells(line, file, n, sep)
        if len(cells) != len(names):
            what = f"the first row names {len(names)} columns, this one has {len(cells)}"
            problems.add(
                "E008", Mark(file, n, 1, n, len(line) + 1), what, 'a cell with a comma in it has quotes: "a, b"'
            )
            continue
        entries = [Entry(Scalar(name, cell.mark), cell) for name, cell in zip(names, cells, strict=True)]
        rows.append(Mapping_(tuple(entries), Mark(file, n, 1, n, len(line) + 1)))
    return Listing(tuple(rows), Mark(file, first, 1)) if not problems.has_errors(before) else None


def _cells(line: str, file: str, n: int, sep: str) -> list[Scalar]:
    found: list[Scalar] = []
    at, cell = 0, re.compile(_CELL.format(sep=sep))
    while at <= len(line):
        match = cell.match(line, at)
        assert match is not None, "a cell may be empty"
        quoted = match[1] is not None
        text = match[1].replace('""', '"') if quoted else match[2].strip()
        start = match.start(1) if quoted else match.start(2) + len(match[2]) - len(match[2].lstrip())
        mark = Mark(file, n, start + 1, n, max(start + 2, start + 1 + len(text)))
        found.append(Scalar(text, mark, exact=not quoted))
        at = match.end() + 1
    return found
