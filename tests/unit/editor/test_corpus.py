"""The files that ship, asked at their positions: nothing raises, what stands there is offered, renaming changes no check."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from formiga_bt.base.packaged import files, folder
from formiga_bt.editor import navigate
from formiga_bt.editor.checks import check
from formiga_bt.editor.complete import complete
from formiga_bt.editor.hover import hover, signatures
from formiga_bt.editor.project import Document, Project, lines_of
from formiga_bt.editor.where import EditorPosition, where
from formiga_bt.lang.text.document import Listing, Mapping_, Node, Scalar, parse
from tests.shares import some

ERRORS = sorted((Path(__file__).parents[2] / "lang_errors").glob("*.yaml"))
SHIPPED = [*files("trees"), *files("actions"), *sorted(folder("trees").rglob("*.test.yaml"))]
TREES = [path for path in files("trees") if "task:" in path.read_text().split("steps:")[0] or path.parent.name == "lib"]
TREES = [path for path in TREES if path.parent.name != "scenarios"]

EACH = some(8, 3)
"""Columns between two positions at which all is asked, other ones in each line."""


def scalars(node: Node, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Scalar, str]]:
    """Iterate over the keys and scalars of a document, each with the keys and lists around it."""
    if isinstance(node, Scalar):
        yield path, node, "value"
    elif isinstance(node, Listing):
        for item in node.items:
            yield from scalars(item, (*path, "-"))
    else:
        for entry in node.entries:
            yield (*path, entry.key.text), entry.key, "key"
            yield from scalars(entry.value, (*path, entry.key.text))


def around(found: EditorPosition) -> tuple[str, ...]:
    return tuple(
        "-" if level.kind == "list" else level.under for level in found.levels if level.kind == "list" or level.under
    )


@pytest.mark.parametrize("path", [*SHIPPED, *ERRORS], ids=lambda path: path.name)
def test_a_position_is_placed_as_the_parser_places_it(path: Path) -> None:
    """Hundreds of files, each key and scalar: the quick reading of the lines around agrees with the YAML parser."""
    text = path.read_text(encoding="utf-8")
    lines = lines_of(text)
    root, _ = parse(text, "x")
    for keys, at, slot in scalars(root) if root is not None else ():
        if not at.text or at.mark.line != at.mark.end_line:
            continue
        start, end = at.mark.col - 1 + at.quoted, at.mark.end_col - 1 - at.quoted
        for col in {start, (start + end) // 2, end}:
            found = where(lines, at.mark.line - 1, col)
            assert found is not None, (at.mark, col)
            assert around(found) == keys
            assert found.text == lines[at.mark.line - 1][start:end]
            assert found.slot in (slot, "word")


def opened(path: Path) -> tuple[Project, Document]:
    project = Project(actions=files("actions"))
    document = Document(path, path.read_text(encoding="utf-8"), 1)
    project.open[path] = document
    found = check(project, document)
    document.diagnostics, document.seen = found.diagnostics, found.seen or document.seen
    document.index()
    return project, document


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.name)
def test_no_request_raises_at_any_position(path: Path) -> None:
    project, document = opened(path)
    for line, text in enumerate(document.lines):
        for col in range(line % EACH, len(text) + 1, EACH):
            complete(project, document, line, col)
            hover(project, document, line, col)
            signatures(project, document, line, col)
            navigate.definition(project, document, line, col)
            navigate.references(document, line, col)


@pytest.mark.parametrize("path", TREES, ids=lambda path: path.name)
def test_no_request_raises_where_a_line_is_cut_off(path: Path) -> None:
    """As while typing: the line ends at the cursor, and often the text is no YAML."""
    project, document = opened(path)
    for line, text in enumerate(document.lines):
        col = len(text) * (line % 5 + 1) // 6
        cut = document.changed("\n".join([*document.lines[:line], text[:col], *document.lines[line + 1 :]]), 2)
        complete(project, cut, line, col)
        hover(project, cut, line, col)
        navigate.definition(project, cut, line, col)


@pytest.mark.parametrize("path", TREES, ids=lambda path: path.name)
def test_each_key_is_offered_where_it_stands(path: Path) -> None:
    project, document = opened(path)
    root, _ = parse(document.text, "x")
    assert isinstance(root, Mapping_)
    free = ("params", "vars", "agents", "subtrees", "for", "with_agents")
    for keys, at, slot in scalars(root):
        parent = keys[-2] if len(keys) > 1 else ""
        own = parent in free or "records" in keys[-3:-1] or "set" in keys[-3:-2]  # names of the author's own
        if slot == "key" and not own:
            found = complete(project, document, at.mark.line - 1, at.mark.col)
            assert at.text in [item.label for item in found], (at.mark, keys)


@pytest.mark.parametrize("path", TREES, ids=lambda path: path.name)
def test_renaming_any_name_changes_no_check(path: Path) -> None:
    project, document = opened(path)
    before = [(one.code, one.mark.line) for one in check(project, document).diagnostics]
    index = document.index()
    assert index is not None
    keys = dict.fromkeys(one.key for one in index.occurrences if one.origin)
    assert keys
    for key in keys:
        one = index.definition(key)
        assert one is not None
        places = navigate.rename(document, one.line, one.start, "Renamed" if one.origin == "subtree" else "renamed")
        lines = list(document.lines)
        for at in sorted(places, key=lambda place: (place.line, -place.start)):
            lines[at.line] = (
                lines[at.line][: at.start]
                + ("Renamed" if one.origin == "subtree" else "renamed")
                + lines[at.line][at.end :]
            )
        after = document.changed("\n".join(lines), 2)
        project.open[path] = after
        assert [(d.code, d.mark.line) for d in check(project, after).diagnostics] == before, key
        project.open[path] = document
