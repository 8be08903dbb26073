"""What docs/editors.md tells people to paste is well-formed, and starts the server that there is."""

import json
import re
import tomllib
from pathlib import Path

from formiga_bt.editor.server import Server, make

PAGE = (Path(__file__).parents[2] / "docs" / "editors.md").read_text(encoding="utf-8")


def fenced(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


def test_each_editor_starts_formiga_lsp() -> None:
    code = json.loads(fenced("json")[0])
    assert [code["glspc.server.command"], *code["glspc.server.commandArguments"]] == ["formiga", "lsp"]
    helix = tomllib.loads(fenced("toml")[0])["language-server"]["formiga"]
    assert [helix["command"], *helix["args"]] == ["formiga", "lsp"]
    assert "cmd = { 'formiga', 'lsp' }" in fenced("lua")[0]
    assert "yaml.schemas" in json.loads(fenced("json")[1])


def test_the_page_tells_of_every_request_that_is_answered() -> None:
    told = {
        "textDocument/completion": "completion",
        "textDocument/hover": "hover",
        "textDocument/signatureHelp": "signature help",
        "textDocument/codeAction": "quick fix",
        "textDocument/definition": "definition",
        "textDocument/references": "references",
        "textDocument/documentHighlight": "references",
        "textDocument/prepareRename": "rename",
        "textDocument/rename": "rename",
        "textDocument/documentSymbol": "outline",
        "textDocument/foldingRange": "folding",
    }
    features = make(Server()).protocol.fm.features
    answered = {name for name in features if name.startswith("textDocument/") and "/did" not in name}
    assert answered == set(told)
    assert [word for word in told.values() if word not in PAGE] == []
