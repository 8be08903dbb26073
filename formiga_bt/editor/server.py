"""Speaks the Language Server Protocol for the rest of this room: messages in and out, no rules of the language.

Requests are answered at once, from the text and the last check. Checks wait until typing pauses and run in a process of their
own (`worker`). The only module that imports `pygls` and `lsprotocol` (the extra `formiga-bt[lsp]`). Called by `formiga lsp`.
"""

import asyncio
import gc
import logging
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any, Final

from lsprotocol import types as lsp
from pygls import uris
from pygls.exceptions import JsonRpcInvalidParams
from pygls.lsp.server import LanguageServer

from formiga_bt import __version__
from formiga_bt.base.packaged import folder
from formiga_bt.editor import navigate
from formiga_bt.editor.columns import from_client, to_client
from formiga_bt.editor.complete import Item, complete
from formiga_bt.editor.hover import hover, signatures
from formiga_bt.editor.index import Symbol
from formiga_bt.editor.project import Document, Project, lines_of
from formiga_bt.editor.report import FileSpan, ShownProblem, shown
from formiga_bt.editor.worker import CheckerProcess, CheckJob, Report
from formiga_bt.lang.site.catalogues import catalogue_file

PAUSE_S: Final = 0.25
"""So long after the last key a file is checked."""
PAUSE_OTHERS_S: Final = 0.75
"""So long after it, the other open files, which may read it."""

SWITCH_S: Final = 0.0005
"""So long the reading of a text may keep the interpreter when an editor asks; Python's own 5 ms add up over a request."""

GARBAGE: Final = (100_000, 20, 50)
"""Looking for garbage as often as Python does takes four times as long as reading a text of 6,000 lines."""

_KINDS: Final = {
    "kind": lsp.CompletionItemKind.Keyword,
    "option": lsp.CompletionItemKind.Property,
    "field": lsp.CompletionItemKind.Field,
    "name": lsp.CompletionItemKind.Variable,
    "helper": lsp.CompletionItemKind.Function,
    "value": lsp.CompletionItemKind.EnumMember,
    "unit": lsp.CompletionItemKind.Unit,
    "action": lsp.CompletionItemKind.Method,
    "subtree": lsp.CompletionItemKind.Module,
    "file": lsp.CompletionItemKind.File,
}
_SYMBOLS: Final = {
    "section": lsp.SymbolKind.Namespace,
    "step": lsp.SymbolKind.Event,
    "param": lsp.SymbolKind.Field,
    "role": lsp.SymbolKind.Object,
    "var": lsp.SymbolKind.Variable,
    "subtree": lsp.SymbolKind.Function,
    "entry": lsp.SymbolKind.Key,
}


class Server(LanguageServer):
    """A language server with the files of one editor.

    Args:
        actions: catalogue files that are added to those of a site.
        site: the site of all files; None = a `site.yaml` beside or above each file.
    """

    def __init__(self, actions: Sequence[Path] = (), site: Path | None = None) -> None:
        super().__init__("formiga", __version__)
        self.project = Project(actions, site)
        self.documents: dict[str, Document] = {}
        self.reports: dict[str, tuple[int, list[ShownProblem]]] = {}
        self._actions = tuple(actions)
        self._site = site
        self._due: dict[str, asyncio.TimerHandle] = {}
        self.checker = CheckerProcess()
        self._checks = ThreadPoolExecutor(1, "check")
        self._texts = ThreadPoolExecutor(1, "read")

    # --- documents ----------------------------------------------------------------------------------------------

    def configure(self, root: str | None, options: object) -> None:
        """Take the folder of the editor and its `{site, actions}`, which count where the command line says nothing."""
        base = Path(root) if root else None
        given = options if isinstance(options, dict) else {}
        site, actions = given.get("site"), given.get("actions")
        place = base or Path.cwd()
        the_site = self._site or (place / site if isinstance(site, str) and site else None)
        the_actions = self._actions
        if not the_actions and isinstance(actions, list):
            the_actions = tuple(catalogue_file(one, place) or place / one for one in actions if isinstance(one, str))
        self.project = Project(the_actions, the_site, base)

    def put(self, uri: str, version: int, pause_s: float) -> None:
        """Take a file's text from the editor, and check it after a pause."""
        text = self.workspace.get_text_document(uri).source
        known = self.documents.get(uri)
        document = known.changed(text, version) if known is not None else Document(path_of(uri), text, version)
        self.documents[uri] = document
        self.project.open[document.path] = document
        self.checker.overtake(document.path)
        self.check_soon(uri, pause_s)
        for other in self.documents:
            if other != uri:
                self.check_soon(other, PAUSE_OTHERS_S)

    def close(self, uri: str) -> None:
        """Forget a file and what was wrong with it."""
        document = self.documents.pop(uri, None)
        if document is not None:
            self.project.open.pop(document.path, None)
        if uri in self._due:
            self._due.pop(uri).cancel()
        self.reports.pop(uri, None)
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, []))

    def check_all(self) -> None:
        """Check every open file: something on the disk has changed."""
        for uri in self.documents:
            self.check_soon(uri, PAUSE_S)

    def check_soon(self, uri: str, pause_s: float) -> None:
        """Check a file after a pause in which nothing else asks for it."""
        if uri in self._due:
            self._due.pop(uri).cancel()
        self._due[uri] = asyncio.get_running_loop().call_later(pause_s, self._start, uri)

    def _start(self, uri: str) -> None:
        self._due.pop(uri, None)
        document = self.documents.get(uri)
        if document is None:
            return
        loop = asyncio.get_running_loop()
        loop.run_in_executor(self._texts, document.index)
        loop.run_in_executor(self._checks, self._check, uri, document).add_done_callback(
            lambda done: self._finish(uri, document, done)
        )

    def _check(self, uri: str, document: Document) -> Report | None:
        """In the thread that waits for checks: have a file checked, unless the editor has a newer text already."""
        if self.documents.get(uri) is not document:
            return None
        project = self.project
        texts = {path: (one.version, one.text) for path, one in list(project.open.items())}
        return self.checker.check(CheckJob(project.actions, project.site, project.root, document.path, texts))

    def _finish(self, uri: str, document: Document, done: "asyncio.Future[Report | None]") -> None:
        error = done.exception()
        if error is not None:
            logging.getLogger(__name__).error("cannot check %s", document.path, exc_info=error)
            return
        report, present = done.result(), self.documents.get(uri)
        if report is None or present is None:
            return
        found = report.checked(document, self.project.catalogue(document.path), self.project.site_of(document.path))
        if found.seen is not None:
            present.seen = found.seen
        if present is not document:
            return
        problems = shown(self.project, document, found.diagnostics)
        self.reports[uri] = (found.version, problems)
        told = [self.diagnostic(one) for one in problems]
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, told, found.version))

    # --- positions ----------------------------------------------------------------------------------------------

    @property
    def encoding(self) -> str:
        """Return how the editor counts columns."""
        agreed = self.workspace.position_encoding
        return agreed.value if isinstance(agreed, lsp.PositionEncodingKind) else agreed or "utf-16"

    def position(self, document: Document, at: lsp.Position) -> tuple[int, int]:
        """Return a position of the editor as line and column in characters."""
        text = document.lines[at.line] if at.line < len(document.lines) else ""
        return at.line, from_client(text, at.character, self.encoding)

    def range(self, path: Path, line: int, start: int, end_line: int, end: int) -> lsp.Range:
        """Return a stretch in characters as the editor counts it."""
        encoding = self.encoding
        lines = self.lines(path)
        first = lines[line] if line < len(lines) else ""
        last = lines[end_line] if end_line < len(lines) else ""
        return lsp.Range(
            lsp.Position(line, to_client(first, start, encoding)),
            lsp.Position(end_line, to_client(last, end, encoding)),
        )

    def lines(self, path: Path) -> list[str]:
        """Return the lines of a file, open or not."""
        document = self.project.open.get(path)
        if document is not None:
            return document.lines
        try:
            return lines_of(self.project.read(path))
        except (OSError, UnicodeDecodeError):
            return []

    def location(self, span: FileSpan) -> lsp.Location:
        """Return where a stretch is."""
        found = self.range(span.path, span.line, span.start, span.end_line, span.end)
        return lsp.Location(self.uri_of(span.path), found)

    def uri_of(self, path: Path) -> str:
        """Return the address of a file, as the editor wrote it if it is open."""
        known = next((uri for uri, document in self.documents.items() if document.path == path), None)
        return known or path.absolute().as_uri()

    def diagnostic(self, one: ShownProblem) -> lsp.Diagnostic:
        """Return a problem in the protocol's words."""
        severity = lsp.DiagnosticSeverity.Error if one.severity == "error" else lsp.DiagnosticSeverity.Warning
        page = folder("docs") / "errors.md"
        tags = [lsp.DiagnosticTag.Unnecessary] if one.code == "W060" else None
        return lsp.Diagnostic(
            self.location(one.span).range,
            one.message,
            severity,
            one.code,
            lsp.CodeDescription(f"{page.as_uri()}#{one.code.lower()}") if page.is_file() else None,
            "formiga",
            tags,
            [lsp.DiagnosticRelatedInformation(self.location(at), said) for at, said in one.related] or None,
        )


def path_of(uri: str) -> Path:
    """Return the file of an address; of one that is no file (`untitled:`), a name in the present folder."""
    found = uris.to_fs_path(uri) if uri.startswith("file:") else None
    return Path(found) if found else Path.cwd() / (uri.rpartition("/")[2].rpartition(":")[2] or "untitled.yaml")


def serve(actions: Sequence[Path] = (), site: Path | None = None) -> None:
    """Serve one editor over stdin and stdout until it leaves. What anything prints meanwhile goes to stderr."""
    with os.fdopen(os.dup(sys.stdin.fileno()), "rb") as words_in:
        words_out = os.fdopen(os.dup(sys.stdout.fileno()), "wb")  # the server closes it
        sys.setswitchinterval(SWITCH_S)
        gc.set_threshold(*GARBAGE)
        with redirect_stdout(sys.stderr):
            server = make(Server(actions, site))
            server.checker.warm_up()
            try:
                server.start_io(words_in, words_out)
            finally:
                server.checker.stop()


def make(server: Server) -> Server:
    """Return the server with all that it answers."""
    _add_documents(server)
    _add_writing(server)
    _add_names(server)
    _add_outline(server)
    return server


def _add_documents(server: Server) -> None:
    @server.feature(lsp.INITIALIZED)
    def initialized(ls: Server, _params: lsp.InitializedParams) -> None:
        """Nothing to do: `initialize` said all."""

    @server.feature(lsp.INITIALIZE)
    def initialize(ls: Server, params: lsp.InitializeParams) -> None:
        ls.configure(ls.workspace.root_path, params.initialization_options)

    @server.feature(lsp.TEXT_DOCUMENT_DID_OPEN)
    def opened(ls: Server, params: lsp.DidOpenTextDocumentParams) -> None:
        ls.put(params.text_document.uri, params.text_document.version, 0.0)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CHANGE)
    def changed(ls: Server, params: lsp.DidChangeTextDocumentParams) -> None:
        ls.put(params.text_document.uri, params.text_document.version or 0, PAUSE_S)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CLOSE)
    def closed(ls: Server, params: lsp.DidCloseTextDocumentParams) -> None:
        ls.close(params.text_document.uri)

    @server.feature(lsp.TEXT_DOCUMENT_DID_SAVE)
    def saved(ls: Server, _params: lsp.DidSaveTextDocumentParams) -> None:
        ls.check_all()

    @server.feature(lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    def watched(ls: Server, _params: lsp.DidChangeWatchedFilesParams) -> None:
        ls.check_all()


def _add_writing(server: Server) -> None:
    triggers = [".", " ", ":", "{", "[", "'", "/", "-"]

    @server.feature(lsp.TEXT_DOCUMENT_COMPLETION, lsp.CompletionOptions(trigger_characters=triggers))
    def completion(ls: Server, params: lsp.CompletionParams) -> lsp.CompletionList | None:
        document = ls.documents.get(params.text_document.uri)
        if document is None:
            return None
        line, col = ls.position(document, params.position)
        found = complete(ls.project, document, line, col)
        return lsp.CompletionList(False, [_item(ls, document, line, item) for item in found])

    @server.feature(lsp.TEXT_DOCUMENT_HOVER)
    def hovered(ls: Server, params: lsp.HoverParams) -> lsp.Hover | None:
        document = ls.documents.get(params.text_document.uri)
        if document is None:
            return None
        line, col = ls.position(document, params.position)
        found = hover(ls.project, document, line, col)
        if found is None:
            return None
        text = lsp.MarkupContent(lsp.MarkupKind.Markdown, found.text)
        return lsp.Hover(text, ls.range(document.path, line, found.start, line, found.end))

    @server.feature(lsp.TEXT_DOCUMENT_SIGNATURE_HELP, lsp.SignatureHelpOptions(["(", ","]))
    def signature_help(ls: Server, params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
        document = ls.documents.get(params.text_document.uri)
        found = signatures(ls.project, document, *ls.position(document, params.position)) if document else None
        if found is None:
            return None
        shown_ = [
            lsp.SignatureInformation(
                form.signature, form.help, [lsp.ParameterInformation(f"{arg.name}") for arg in form.args]
            )
            for form in found.forms
        ]
        return lsp.SignatureHelp(shown_, 0, found.argument)

    @server.feature(
        lsp.TEXT_DOCUMENT_CODE_ACTION, lsp.CodeActionOptions(code_action_kinds=[lsp.CodeActionKind.QuickFix])
    )
    def code_action(ls: Server, params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        uri = params.text_document.uri
        document, (version, problems) = ls.documents.get(uri), ls.reports.get(uri, (-1, []))
        if document is None or version != document.version:
            return []
        first, last = params.range.start.line, params.range.end.line
        near = [one for one in problems if one.span.line <= last and one.span.end_line >= first]
        return [action for one in near if (action := _mend(ls, document, one)) is not None]


def _item(ls: Server, document: Document, line: int, item: Item) -> lsp.CompletionItem:
    place = ls.range(document.path, line, item.start, line, item.end)
    capable = ls.client_capabilities.text_document
    completion = capable.completion.completion_item if capable and capable.completion else None
    snippets = item.snippet and bool(completion and completion.snippet_support)
    text = item.insert if snippets or not item.snippet else item.label
    return lsp.CompletionItem(
        item.label,
        kind=_KINDS[item.what],
        detail=item.detail or None,
        documentation=item.doc or None,
        sort_text=f"{item.order:06d}",
        filter_text=item.insert if item.insert.startswith("${") else item.label,
        insert_text_format=lsp.InsertTextFormat.Snippet if snippets else lsp.InsertTextFormat.PlainText,
        insert_text_mode=lsp.InsertTextMode.AdjustIndentation,
        text_edit=lsp.TextEdit(place, text),
    )


def _mend(ls: Server, document: Document, one: ShownProblem) -> lsp.CodeAction | None:
    """Return the action that mends a problem, if it has a mend in this file."""
    if one.fix is None or one.fix.mark.file != str(document.path):
        return None
    mark = one.fix.mark
    place = ls.range(document.path, mark.line - 1, mark.col - 1, max(mark.end_line, mark.line) - 1, mark.end_col - 1)
    edit = lsp.WorkspaceEdit(changes={ls.uri_of(document.path): [lsp.TextEdit(place, one.fix.text)]})
    shown_ = " ".join(one.fix.text.split())
    title = f"Write {shown_[:60]}" if shown_ else "Remove this"
    return lsp.CodeAction(title, lsp.CodeActionKind.QuickFix, [ls.diagnostic(one)], is_preferred=True, edit=edit)


def _add_names(server: Server) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_DEFINITION)
    def definition(ls: Server, params: lsp.DefinitionParams) -> lsp.Location | None:
        document = ls.documents.get(params.text_document.uri)
        if document is None:
            return None
        found = navigate.definition(ls.project, document, *ls.position(document, params.position))
        return _location(ls, found) if found is not None else None

    @server.feature(lsp.TEXT_DOCUMENT_REFERENCES)
    def references(ls: Server, params: lsp.ReferenceParams) -> list[lsp.Location]:
        document = ls.documents.get(params.text_document.uri)
        if document is None:
            return []
        line, col = ls.position(document, params.position)
        with_own = params.context.include_declaration
        return [_location(ls, at) for at in navigate.references(document, line, col, with_definition=with_own)]

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    def highlight(ls: Server, params: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
        document = ls.documents.get(params.text_document.uri)
        if document is None:
            return []
        found = navigate.references(document, *ls.position(document, params.position))
        return [lsp.DocumentHighlight(_location(ls, at).range) for at in found]

    @server.feature(lsp.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepare(ls: Server, params: lsp.PrepareRenameParams) -> lsp.PrepareRenamePlaceholder | None:
        document = ls.documents.get(params.text_document.uri)
        if document is None:
            return None
        try:
            one = navigate.renamable(document, *ls.position(document, params.position))
        except navigate.CannotRename as why:
            raise JsonRpcInvalidParams(str(why)) from why
        return lsp.PrepareRenamePlaceholder(ls.range(document.path, one.line, one.start, one.line, one.end), one.name)

    @server.feature(lsp.TEXT_DOCUMENT_RENAME, lsp.RenameOptions(prepare_provider=True))
    def rename(ls: Server, params: lsp.RenameParams) -> lsp.WorkspaceEdit | None:
        document = ls.documents.get(params.text_document.uri)
        if document is None:
            return None
        line, col = ls.position(document, params.position)
        try:
            places = navigate.rename(document, line, col, params.new_name)
        except navigate.CannotRename as why:
            raise JsonRpcInvalidParams(str(why)) from why
        edits: list[Any] = [lsp.TextEdit(_location(ls, at).range, params.new_name) for at in places]
        return lsp.WorkspaceEdit(changes={params.text_document.uri: edits})


def _location(ls: Server, at: navigate.LineColumns) -> lsp.Location:
    return ls.location(FileSpan(at.path, at.line, at.start, at.line, at.end))


def _add_outline(server: Server) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def symbols(ls: Server, params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
        document = ls.documents.get(params.text_document.uri)
        index = document.index() if document is not None else None
        return [_symbol(ls, document, one) for one in index.symbols()] if document is not None and index else []

    @server.feature(lsp.TEXT_DOCUMENT_FOLDING_RANGE)
    def folding(ls: Server, params: lsp.FoldingRangeParams) -> list[lsp.FoldingRange]:
        document = ls.documents.get(params.text_document.uri)
        index = document.index() if document is not None else None
        return [lsp.FoldingRange(first, last) for first, last in folds(index.symbols())] if index is not None else []


def folds(symbols: Sequence[Symbol]) -> list[tuple[int, int]]:
    """Return the first and last line (0-based) of each entry of the outline that has several, once each."""
    found: dict[tuple[int, int], None] = {}
    for one in symbols:
        if one.mark.end_line > one.mark.line:
            found[one.mark.line - 1, one.mark.end_line - 1] = None
        found.update(dict.fromkeys(folds(one.children)))
    return list(found)


def _symbol(ls: Server, document: Document, one: Symbol) -> lsp.DocumentSymbol:
    def range_(mark: Any) -> lsp.Range:
        return ls.range(document.path, mark.line - 1, mark.col - 1, mark.end_line - 1, mark.end_col - 1)

    children = [_symbol(ls, document, child) for child in one.children]
    return lsp.DocumentSymbol(
        one.name or "-", _SYMBOLS[one.what], range_(one.mark), range_(one.at), one.detail or None, None, None, children
    )
