"""`formiga lsp` as an editor meets it: a process, a client that speaks the protocol over stdin and stdout."""

import asyncio
import subprocess
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException
from pygls.lsp.client import LanguageClient

from formiga_bt.editor.columns import from_client, to_client

pytestmark = pytest.mark.network

TASK = """\
formiga: 1
task: Look
imports: [lib/flying.yaml, own.yaml]
params:
  target: place
agents:
  drone:
    type: lwd
    near: ${target}
steps:
  - call: FlyTo
    with:
      drone: ${drone}
      to: ${target}
      height: 20 m
  - notify: "šö🚁 ${target} is ${drone.battery} full"
  - call: Own
    with: {drone: "${drone}"}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
OWN = "formiga: 1\nsubtrees:\n  Own:\n    params: {drone: agent}\n    steps:\n      - check: drone.battery > 10 %\n"
PATIENCE_S = 60.0


class Editor:
    """A client with one open file."""

    def __init__(self, client: LanguageClient, folder: Path) -> None:
        self.client = client
        self.folder = folder
        self.uri = (folder / "look.yaml").as_uri()
        self.text = ""
        self.version = 0
        self.reports: asyncio.Queue[lsp.PublishDiagnosticsParams] = asyncio.Queue()

    def open(self, text: str, name: str = "look.yaml") -> None:
        self.uri, self.text, self.version = (self.folder / name).as_uri(), text, 1
        item = lsp.TextDocumentItem(self.uri, "yaml", 1, text)
        self.client.text_document_did_open(lsp.DidOpenTextDocumentParams(item))

    def type(self, text: str) -> None:
        self.version += 1
        self.text = text
        at = lsp.VersionedTextDocumentIdentifier(self.version, self.uri)
        whole = lsp.TextDocumentContentChangeWholeDocument(text)
        self.client.text_document_did_change(lsp.DidChangeTextDocumentParams(at, [whole]))

    def place(self, words: str) -> dict[str, Any]:
        """Return where `|` stands in some words of the text, as a request says it."""
        at = self.text.index(words.replace("|", "")) + words.index("|")
        before = self.text[:at]
        line = before.rpartition("\n")[2]
        position = lsp.Position(before.count("\n"), len(line.encode("utf-16-le")) // 2)
        return {"text_document": lsp.TextDocumentIdentifier(self.uri), "position": position}

    async def report(self, version: int, name: str = "") -> list[lsp.Diagnostic]:
        """Return the problems of a version, as soon as they come."""
        uri = (self.folder / name).as_uri() if name else self.uri
        while True:
            found = await asyncio.wait_for(self.reports.get(), PATIENCE_S)
            if found.uri == uri and found.version == version:
                return list(found.diagnostics)


def with_editor(folder: Path, story: Callable[[Editor], Awaitable[None]], *words: str) -> None:
    """Play a story with a real server process, and see that it leaves with 0."""

    async def play() -> None:
        client = LanguageClient("test", "1")
        editor = Editor(client, folder)

        @client.feature(lsp.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
        def reported(params: lsp.PublishDiagnosticsParams) -> None:
            editor.reports.put_nowait(params)

        await client.start_io(sys.executable, "-m", "formiga_bt", "lsp", *words)
        snippets = lsp.ClientCompletionItemOptions(snippet_support=True)
        able = lsp.TextDocumentClientCapabilities(completion=lsp.CompletionClientCapabilities(completion_item=snippets))
        params = lsp.InitializeParams(lsp.ClientCapabilities(text_document=able), root_uri=folder.as_uri())
        await asyncio.wait_for(client.initialize_async(params), PATIENCE_S)
        client.initialized(lsp.InitializedParams())
        await story(editor)
        await asyncio.wait_for(client.shutdown_async(None), PATIENCE_S)
        client.exit(None)
        server = client._server
        assert server is not None
        assert await asyncio.wait_for(server.wait(), PATIENCE_S) == 0
        await client.stop()

    asyncio.run(play())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "own.yaml").write_text(OWN, encoding="utf-8")
    return tmp_path


def test_problems_come_as_you_type_and_go_when_they_are_mended(folder: Path) -> None:
    async def story(editor: Editor) -> None:
        editor.open(TASK)
        assert await editor.report(1) == []
        editor.type(TASK.replace("20 m", "20"))
        (one,) = await editor.report(2)
        assert (one.code, one.severity, one.source) == ("E017", lsp.DiagnosticSeverity.Error, "formiga")
        assert one.range == lsp.Range(lsp.Position(14, 14), lsp.Position(14, 16))
        assert one.code_description is not None
        assert one.code_description.href.endswith("/errors.md#e017")
        at = lsp.TextDocumentIdentifier(editor.uri)
        found = await editor.client.text_document_code_action_async(
            lsp.CodeActionParams(at, one.range, lsp.CodeActionContext([one]))
        )
        assert found is not None
        (action,) = found
        assert isinstance(action, lsp.CodeAction)
        assert action.title == "Write 20 m"
        assert action.edit is not None
        assert list((action.edit.changes or {})[editor.uri]) == [lsp.TextEdit(one.range, "20 m")]
        editor.type(TASK)
        assert await editor.report(3) == []

    with_editor(folder, story)


def test_it_completes_hovers_and_leads_on_while_a_line_is_unfinished(folder: Path) -> None:
    async def story(editor: Editor) -> None:
        editor.open(TASK)
        await editor.report(1)
        editor.type(TASK.replace("  - call: Own", "  - [\n  - do: drone.\n  - call: Own"))
        found = await editor.client.text_document_completion_async(lsp.CompletionParams(**editor.place("do: drone.|")))
        assert isinstance(found, lsp.CompletionList)
        assert [item.label for item in found.items] == ["TakeOff", "GoTo", "LandIn", "Explore"]
        over = await editor.client.text_document_hover_async(lsp.HoverParams(**editor.place("🚁 ${tar|get}")))
        assert over is not None
        assert isinstance(over.contents, lsp.MarkupContent)
        assert over.contents.value == "**target**: place\n\n*param*"
        line = editor.text[: editor.text.index("🚁")].count("\n")
        assert over.range == lsp.Range(lsp.Position(line, 20), lsp.Position(line, 26))
        goal = await editor.client.text_document_definition_async(lsp.DefinitionParams(**editor.place("call: O|wn")))
        assert isinstance(goal, lsp.Location)
        assert (goal.uri, goal.range.start.line) == ((editor.folder / "own.yaml").as_uri(), 2)

    with_editor(folder, story)


def test_kinds_come_as_snippets(folder: Path) -> None:
    async def story(editor: Editor) -> None:
        editor.open(TASK.replace("  - call: Own", "  - \n  - call: Own"))
        found = await editor.client.text_document_completion_async(lsp.CompletionParams(**editor.place("  - |\n")))
        assert isinstance(found, lsp.CompletionList)
        first = found.items[0]
        assert (first.label, first.insert_text_format) == ("do", lsp.InsertTextFormat.Snippet)
        assert isinstance(first.text_edit, lsp.TextEdit)
        assert first.text_edit.new_text == "do: ${1:drone.Action}"

    with_editor(folder, story)


def test_a_rename_is_carried_out_or_refused_in_words(folder: Path) -> None:
    async def story(editor: Editor) -> None:
        editor.open(TASK)
        await editor.report(1)
        edit = await editor.client.text_document_rename_async(
            lsp.RenameParams(new_name="spot", **editor.place("  tar|get: place"))
        )
        assert edit is not None
        assert edit.changes is not None
        lines = editor.text.split("\n")
        for one in sorted(edit.changes[editor.uri], key=lambda one: (one.range.start.line, -one.range.start.character)):
            text, at = lines[one.range.start.line], one.range
            start, end = (from_client(text, col, "utf-16") for col in (at.start.character, at.end.character))
            lines[at.start.line] = text[:start] + one.new_text + text[end:]
        editor.type("\n".join(lines))
        assert "target" not in editor.text
        assert await editor.report(2) == []
        for words, why in (("call: Fly|To", "no subtree 'FlyTo'"), ("not|ify", "'notify' is not a name")):
            with pytest.raises(JsonRpcException, match=why):
                await editor.client.text_document_prepare_rename_async(lsp.PrepareRenameParams(**editor.place(words)))

    with_editor(folder, story)


def test_an_unsaved_library_counts_in_the_task_that_imports_it(folder: Path) -> None:
    async def story(editor: Editor) -> None:
        editor.open(TASK)
        assert await editor.report(1) == []
        editor.open(OWN.replace("  Own:", "  Other:"), "own.yaml")
        assert await editor.report(1, "own.yaml") == []
        assert [one.code for one in await editor.report(1, "look.yaml")] == ["E050"]

    with_editor(folder, story)


def test_the_outline_and_its_folds(folder: Path) -> None:
    async def story(editor: Editor) -> None:
        editor.open(TASK)
        at = lsp.TextDocumentIdentifier(editor.uri)
        found = await editor.client.text_document_document_symbol_async(lsp.DocumentSymbolParams(at))
        assert found is not None
        steps = next(one for one in found if one.name == "steps")
        assert isinstance(steps, lsp.DocumentSymbol)
        assert steps.children is not None
        assert [one.name for one in steps.children][:2] == [
            "call: FlyTo",
            "notify: šö🚁 ${target} is ${drone.battery} full",
        ]
        folds = await editor.client.text_document_folding_range_async(lsp.FoldingRangeParams(at))
        assert folds is not None
        assert (10, 14) in [(one.start_line, one.end_line) for one in folds]

    with_editor(folder, story)


def test_the_site_of_the_command_line_is_checked_against(folder: Path) -> None:
    async def story(editor: Editor) -> None:
        editor.open(TASK.replace("      to: ${target}", "      to: ${site.places.nowhere}"))
        assert [one.code for one in await editor.report(1)] == ["E011"]

    with_editor(folder, story, "--site", "demo")


def test_a_file_that_cannot_be_read_is_named_before_anything_is_served() -> None:
    command = [sys.executable, "-m", "formiga_bt", "lsp", "--site", "gone.yaml"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
    assert done.returncode == 2
    assert done.stderr == "formiga: cannot read gone.yaml: No such file or directory\n"


@pytest.mark.parametrize(("encoding", "column"), [("utf-16", 4), ("utf-8", 7), ("utf-32", 3)])
def test_columns_count_as_the_editor_counts(encoding: str, column: int) -> None:
    assert to_client("aš🚁b", 3, encoding) == column
    assert from_client("aš🚁b", column, encoding) == 3
