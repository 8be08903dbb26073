"""Only SQLite opens a journal (docs/adr/0014-only-sqlite-opens-a-journal.md): the code is read for whatever else could."""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

ROOT = Path(__file__).parents[2]
OPENERS: Final = frozenset({
    "open", "fdopen", "read_bytes", "read_text", "write_bytes", "write_text", "touch", "truncate", "mmap", "sendfile",
    "shutil.copy", "copy2", "copyfile", "copytree", "copyfileobj", "shutil.move", "copy_file_range", "file_digest",
    "make_archive", "unpack_archive", "ZipFile", "TarFile", "link", "symlink", "hardlink_to", "symlink_to",
})  # fmt: skip
"""Calls that open a file, or make another name of it."""
JOURNAL_ROOM: Final = {
    "export.py": {"open": 1},  # a table for other programs
    "database.py": {"open": 1},  # the lock file, which SQLite does not know
}
"""The room where journals are: module -> calls of `OPENERS` in it, all else is refused."""
SQLITE: Final = {"formiga_bt/journal/copying.py", "formiga_bt/journal/database.py", "formiga_bt/journal/looking.py"}
"""Modules that may speak to SQLite without SQLAlchemy: they say how a file is opened."""
KNOW_ITS_NAME: Final = {
    "formiga_bt/base/site_folder.py",
    "formiga_bt/services/kept/journaling.py",
    "formiga_bt/services/kept/backup.py",  # the file is passed over; a copy that SQLite made is read
    "formiga_bt/services/kept/restoring.py",  # of a site that no engine has yet
    "formiga_bt/cli/operator/journal.py",
}
"""Modules outside the room that name the file; see to it that they open others only."""


def modules(folder: str, *words: str) -> list[tuple[str, ast.Module]]:
    """Return the modules of a folder in which one of the words stands; without words all."""
    texts = {path: path.read_text(encoding="utf-8") for path in sorted((ROOT / folder).rglob("*.py"))}
    found = {path: text for path, text in texts.items() if not words or any(word in text for word in words)}
    return [(path.relative_to(ROOT).as_posix(), ast.parse(text)) for path, text in found.items()]


def name_of(call: ast.Call) -> str:
    match call.func:
        case ast.Attribute(value=ast.Name(id="shutil"), attr=("copy" | "move") as name):
            return f"shutil.{name}"
        case ast.Attribute(attr=name) | ast.Name(id=name):
            return name
        case _:
            return ""


def openers(tree: ast.AST) -> dict[str, int]:
    """Return how often each opener is called; `re.compile`d patterns and structs have none of these names."""
    found: dict[str, int] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and (name := name_of(node)) in OPENERS:
            found[name] = found.get(name, 0) + 1
    return found


def imported(tree: ast.AST) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {one.name.partition(".")[0] for one in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module.partition(".")[0])
    return names


def strings(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def names_it(tree: ast.AST) -> bool:
    """Return whether code names a journal's file: by the constant, or by a text; prose does not count."""
    found = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom))
    if any((node.module or "").endswith("site_folder") and "JOURNAL" in {n.name for n in node.names} for node in found):
        return True
    return any(" " not in one and ("journal.db" in one or one.endswith(("-wal", "-shm"))) for one in strings(tree))


def test_the_room_of_journals_opens_no_file_itself() -> None:
    found = {Path(name).name: calls for name, tree in modules("formiga_bt/journal") if (calls := openers(tree))}
    assert found == JOURNAL_ROOM


def test_sqlite_is_spoken_to_in_one_place() -> None:
    assert {name for name, tree in modules("formiga_bt", "sqlite3") if "sqlite3" in imported(tree)} == SQLITE
    others = {"apsw", "pysqlite3", "aiosqlite", "sqlean", "duckdb"}
    assert not {name for name, tree in modules("formiga_bt", *others) if others & imported(tree)}


def test_no_journal_is_opened_without_locks_but_where_nothing_can_be_written() -> None:
    words = ("nolock", "vfs=", "immutable", "unix-none", "unix-dotfile")
    found = {
        name for name, tree in modules("formiga_bt", *words) for one in strings(tree) for word in words if word in one
    }
    assert {one for one in found if "sqlite" in (ROOT / one).read_text().lower()} <= {"formiga_bt/journal/looking.py"}


def test_who_knows_the_name_of_the_file_opens_none_by_it() -> None:
    """Modules that name the file are few; in those what is opened is known by heart."""
    found = {
        name
        for folder in ("formiga_bt", "agents_sim")
        for name, tree in modules(folder, "JOURNAL", "journal.db", "-wal", "-shm")
        if not name.startswith("formiga_bt/journal/") and names_it(tree)
    }
    assert found == KNOW_ITS_NAME


@pytest.mark.parametrize(
    "planted",
    [
        "head = path.open('rb').read(16)", "import os\nos.open(file, os.O_RDONLY)", "import shutil\nshutil.copyfile(a, b)",
        "import zipfile\nzipfile.ZipFile(out).write(file)", "import hashlib\nhashlib.file_digest(open(file), 'sha256')",
        "file.read_bytes()",
    ],
)  # fmt: skip
def test_what_would_drop_its_locks_is_found(planted: str) -> None:
    assert openers(ast.parse(planted))
