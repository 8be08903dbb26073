"""The open files of an editor, what they are checked against, and what the last check of each saw.

A file that is open is read from the editor, also where another file imports it. Everything here is data in, data out; the
server decides when to check.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock

from formiga_bt.base.diagnostics import Diagnostic, Mark
from formiga_bt.base.near_site import site_near
from formiga_bt.base.packaged import folder
from formiga_bt.editor.grammar import FileKind, file_kind
from formiga_bt.editor.index import FileIndex, build
from formiga_bt.editor.seen import Seen
from formiga_bt.lang.catalogue import load_catalogue
from formiga_bt.lang.files import importable
from formiga_bt.lang.model import Catalogue, Param, Site
from formiga_bt.lang.own_records import read_records
from formiga_bt.lang.params import read_params
from formiga_bt.lang.request.neighbours import Neighbours
from formiga_bt.lang.site import load_site, load_site_text
from formiga_bt.lang.site.catalogues import catalogue_file, catalogue_files
from formiga_bt.lang.site.libraries import library_folders
from formiga_bt.lang.steps.requests import task_params
from formiga_bt.lang.text.document import Mapping_, Scalar, parse
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.world import World


@dataclass(frozen=True, slots=True)
class Signature:
    """A subtree that a file may call, or a task that it may request."""

    name: str
    params: Mapping[str, Param]
    path: Path
    mark: Mark
    imported: bool


def lines_of(text: str) -> list[str]:
    """Return the lines of a text as editors count them."""
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


@dataclass(slots=True)
class Document:
    """A file as the editor has it."""

    path: Path
    text: str
    version: int
    lines: list[str] = field(default_factory=list)
    kind: FileKind = "task"
    diagnostics: tuple[Diagnostic, ...] = ()
    checked: int = -1
    """The version that `diagnostics` are of."""
    seen: Seen = field(default_factory=Seen)
    _index: FileIndex | None = None
    _good: FileIndex = field(default_factory=FileIndex)
    _lock: Lock = field(default_factory=Lock)

    def __post_init__(self) -> None:
        self.lines = lines_of(self.text)
        self.kind = file_kind(self.lines, self.path.name)

    def index(self) -> FileIndex | None:
        """Return the names of this version; None where it is no YAML."""
        with self._lock:
            if self._index is None:
                root, _ = parse(self.text, str(self.path))
                self._index = build(root, self.lines, self.kind)
                if root is not None:
                    self._good = self._index
        return self._index if self._index.root is not None else None

    def last_index(self) -> FileIndex:
        """Return the names of this version, or of the last one that could be read."""
        return self.index() or self._good

    def last_known(self) -> FileIndex:
        """Return the names of the last version that was read, without reading the present one."""
        return self._index if self._index is not None and self._index.root is not None else self._good

    def changed(self, text: str, version: int) -> "Document":
        """Return the document with another text; what is known of the last one is kept until the next check."""
        after = Document(self.path, text, version, diagnostics=self.diagnostics, checked=self.checked, seen=self.seen)
        after._good = self.last_known()
        return after


class Project:
    """Open files, and the catalogue and sites that they are checked against.

    Args:
        actions: catalogue files that are added to those of a site.
        site: the site of all files; None = a `site.yaml` in the folder of a file or above it.
        root: sites are not looked for above this folder.
    """

    def __init__(self, actions: Sequence[Path] = (), site: Path | None = None, root: Path | None = None) -> None:
        self.actions = tuple((catalogue_file(str(path), Path()) or path).resolve() for path in actions)
        self.site = site.resolve() if site is not None else None
        self.root = root.resolve() if root is not None else None
        self.open: dict[Path, Document] = {}
        self._catalogues: dict[tuple[Path, ...], tuple[object, Catalogue]] = {}
        self._sites: dict[Path, tuple[object, Site | None]] = {}
        self._units: dict[Path, tuple[object, FileIndex]] = {}

    # --- files --------------------------------------------------------------------------------------------------

    def read(self, path: Path) -> str:
        """Return the text of a file: the editor's, where it is open."""
        document = self.open.get(path.resolve())
        return document.text if document is not None else path.read_text(encoding="utf-8")

    def stamp(self, path: Path) -> object:
        """Return what changes whenever the text of a file does."""
        document = self.open.get(path.resolve())
        if document is not None:
            return ("open", document.version, hash(document.text))
        try:
            return path.stat().st_mtime_ns
        except OSError:
            return None

    def folders(self, path: Path) -> tuple[Path, ...]:
        """Return the folders where tasks and sites are looked up that a file names."""
        return (path.parent, folder("trees"))

    def importable(self, path: Path) -> list[str]:
        """Return the words by which a file can import libraries."""
        return importable(path.parent, self.catalogue(path).libraries, (folder("trees"),))

    # --- the world ----------------------------------------------------------------------------------------------

    def catalogue_files(self, path: Path) -> tuple[Path, ...]:
        """Return the catalogues of the site that a file is checked against; of a site, its own."""
        return catalogue_files(*self._site_text(path), self.actions)

    def _site_text(self, path: Path) -> tuple[str, str]:
        """Return the text of the site that a file is checked against, "" if there is none, and its file's name."""
        document = self.open.get(path.resolve())
        is_site = document is not None and document.kind == "site"
        file = path if is_site else self.site or self._site_near(path)
        text = ""
        with suppress(OSError, UnicodeDecodeError):
            text = self.read(file) if file is not None else ""
        return text, str(file)

    def catalogue(self, path: Path) -> Catalogue:
        """Return the agent types and actions for a file, read again when one of their files changed."""
        text, file = self._site_text(path)
        files, libraries = catalogue_files(text, file, self.actions), library_folders(text, file)
        stamps = tuple(self.stamp(one) for one in files)
        known = self._catalogues.get((*files, *libraries))
        if known is None or known[0] != stamps:
            catalogue = load_catalogue(files, read=self.read, libraries=libraries)[0]
            known = self._catalogues[*files, *libraries] = (stamps, catalogue)
        return known[1]

    def site_of(self, path: Path) -> Site | None:
        """Return the site that a file is checked against, if there is a readable one."""
        file = self.site or self._site_near(path)
        if file is None:
            return None
        catalogue = self.catalogue(path)
        stamp = (self.stamp(file), catalogue.digest)
        known = self._sites.get(file)
        if known is None or known[0] != stamp:
            document = self.open.get(file)
            loaded = load_site_text(document.text, str(file), catalogue) if document else load_site(file, catalogue)
            known = self._sites[file] = (stamp, loaded[0] or (known[1] if known else None))
        return known[1]

    def _site_near(self, path: Path) -> Path | None:
        return site_near(path.parent, self.root)

    # --- subtrees -----------------------------------------------------------------------------------------------

    def subtrees(self, document: Document) -> dict[str, Signature]:
        """Return the subtrees that a file may call, by name."""
        index = document.last_known() if document.last_known().root is not None else document.last_index()
        found = self._signatures(index, document.path, imported=False)
        for path in self.imports(document, index).values():
            for name, signature in self._signatures(self._unit(path), path, imported=True).items():
                found.setdefault(name, signature)
        return found

    def task_names(self, document: Document) -> list[str]:
        """Return the names of the tasks that a file may request."""
        own = document.last_known().root
        named = own.get("task") if isinstance(own, Mapping_) else None
        mine = named.value.text if named is not None and isinstance(named.value, Scalar) else ""
        return [name for name in self._neighbours(document).names() if name != mine]

    def task(self, document: Document, name: str) -> Signature | None:
        """Return a task that a file may request; None if there is none of that name."""
        neighbours = self._neighbours(document)
        mark = neighbours.mark(name)
        params = task_params(neighbours, name, World(self.catalogue(document.path), None))
        if mark is None or params is None:
            return None
        return Signature(name, params, Path(neighbours.path(name)), mark, True)

    def _neighbours(self, document: Document) -> Neighbours:
        own = self.catalogue(document.path).libraries
        return Neighbours(document.path.parent, (folder("trees"),), self.read, own=own)

    def imports(self, document: Document, index: FileIndex | None = None) -> dict[str, Path]:
        """Return the files that a file imports, by the words that name them."""
        index = index or document.last_known()
        entry = index.root.get("imports") if isinstance(index.root, Mapping_) else None
        items = getattr(entry.value, "items", ()) if entry is not None else ()
        found = {}
        for item in items:
            path = self.locate(document.path, item.text) if isinstance(item, Scalar) else None
            if path is not None:
                found[item.text] = path
        return found

    def locate(self, path: Path, word: str) -> Path | None:
        """Return the file that an import of `path` means, or None."""
        if not word or "\0" in word or Path(word).is_absolute():
            return None
        places = (path.parent, *self.catalogue(path).libraries, folder("trees"))
        return next((place / word for place in places if (place / word).is_file()), None)

    def _unit(self, path: Path) -> FileIndex:
        document = self.open.get(path.resolve())
        if document is not None:
            return document.last_index()
        stamp = self.stamp(path)
        known = self._units.get(path)
        if known is None or known[0] != stamp:
            try:
                text = self.read(path)
            except (OSError, UnicodeDecodeError):
                text = ""
            known = self._units[path] = (stamp, build(parse(text, str(path))[0], text.splitlines(), "library"))
        return known[1]

    def _signatures(self, index: FileIndex, path: Path, *, imported: bool) -> dict[str, Signature]:
        catalogue = self.catalogue(path)
        own = index.root.get("records") if isinstance(index.root, Mapping_) else None
        records = read_records(own.value, Problems(), catalogue.records) if own is not None else catalogue.records
        world = World(catalogue, None, records=records)
        found = {}
        for name, entry in index.subtrees().items():
            params = entry.value.get("params") if isinstance(entry.value, Mapping_) else None
            read = read_params(params.value, world, Problems()) if params is not None else {}
            found[name] = Signature(name, read, path, entry.key.mark, imported)
        return found
