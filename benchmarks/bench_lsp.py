"""What the language server answers on a task of 2,000 steps, alone and while it checks the file; over stdin and stdout.

python benchmarks/bench_lsp.py [--steps N] [--rounds N]
"""

import argparse
import asyncio
import statistics
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from lsprotocol import types as lsp
from pygls.lsp.client import LanguageClient

HEAD = """\
formiga: 1
task: Big
imports: [lib/flying.yaml]
params:
  target: place
  height: {type: distance, default: 60 m}
agents:
  drone:
    type: hwd
    near: ${target}
steps:
  - do: drone.TakeOff
"""
LEG = """\
  - do: drone.GoTo
    name: Leg %d
    with:
      to: ${above(offset(target, east=%d m), height)}
    timeout: 5 min
  - check: drone.battery > 30 %% and distance(target, base) < 9 km
"""
TAIL = "  - call: ReturnHome\n    with: {drone: '${drone}'}\n"


def task_of(steps: int) -> str:
    """Return a task of so many steps, about three lines each."""
    return HEAD + "".join(LEG % (i, i % 50) for i in range((steps - 2) // 2)) + TAIL


class Typist:
    """Types into the last leg, and asks."""

    def __init__(self, client: LanguageClient, uri: str, text: str) -> None:
        self.client = client
        self.uri = uri
        self.text = text
        self.version = 1
        self.line = text.rindex("above(")
        self.line, self.col = (
            text.count("\n", 0, self.line),
            text.index("above(") - text.rindex("\n", 0, text.index("above(")),
        )

    def type(self) -> None:
        """Change one line in the middle and one at the end: what was read of the file is stale."""
        self.version += 1
        at = lsp.VersionedTextDocumentIdentifier(self.version, self.uri)
        start = lsp.Position(self.line - 2, 12)
        change = lsp.TextDocumentContentChangePartial(lsp.Range(start, start), "x")
        self.client.text_document_did_change(lsp.DidChangeTextDocumentParams(at, [change]))

    @property
    def place(self) -> dict[str, Any]:
        return {
            "text_document": lsp.TextDocumentIdentifier(self.uri),
            "position": lsp.Position(self.line, self.col + 1),
        }

    def requests(self) -> dict[str, Callable[[], Awaitable[object]]]:
        client, at = self.client, lsp.TextDocumentIdentifier(self.uri)
        return {
            "completion": lambda: client.text_document_completion_async(lsp.CompletionParams(**self.place)),
            "hover": lambda: client.text_document_hover_async(lsp.HoverParams(**self.place)),
            "signature help": lambda: client.text_document_signature_help_async(lsp.SignatureHelpParams(**self.place)),
            "definition": lambda: client.text_document_definition_async(lsp.DefinitionParams(**self.place)),
            "references": lambda: client.text_document_references_async(
                lsp.ReferenceParams(lsp.ReferenceContext(True), **self.place)
            ),
            "rename": lambda: client.text_document_rename_async(
                lsp.RenameParams(new_name="spot", text_document=at, position=lsp.Position(4, 3))
            ),
            "symbols": lambda: client.text_document_document_symbol_async(lsp.DocumentSymbolParams(at)),
        }


async def measure(steps: int, rounds: int) -> None:
    """Start a server, open the file, and print medians and the worst of each request."""
    client = LanguageClient("bench", "1")
    checked: asyncio.Queue[int] = asyncio.Queue()

    @client.feature(lsp.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
    def reported(params: lsp.PublishDiagnosticsParams) -> None:
        checked.put_nowait(params.version or 0)

    await client.start_io(sys.executable, "-m", "formiga_bt", "lsp")
    await client.initialize_async(lsp.InitializeParams(lsp.ClientCapabilities()))
    client.initialized(lsp.InitializedParams())
    with tempfile.TemporaryDirectory() as folder:
        file, text = Path(folder) / "big.yaml", task_of(steps)
        file.write_text(text, encoding="utf-8")
        typist = Typist(client, file.as_uri(), text)
        start = time.perf_counter()
        client.text_document_did_open(lsp.DidOpenTextDocumentParams(lsp.TextDocumentItem(typist.uri, "yaml", 1, text)))
        await checked.get()
        print(f"{steps} steps, {text.count(chr(10))} lines; full check {time.perf_counter() - start:.2f} s")
        print(f"{'':16} {'at rest':>20} {'while it checks':>22}")
        for name, ask in typist.requests().items():
            await ask()
            rest = [await took_ms(ask) for _ in range(rounds)]
            busy = []
            for _ in range(rounds):
                typist.type()
                await asyncio.sleep(0.5)  # the pause after which a check begins is over
                busy.append(await took_ms(ask))
                while await checked.get() != typist.version:
                    pass
            print(f"{name:16} {spread(rest):>20} {spread(busy):>22}")
    await client.shutdown_async(None)
    client.exit(None)
    await client.stop()


async def took_ms(ask: Callable[[], Awaitable[object]]) -> float:
    """Return how long a request took, milliseconds."""
    start = time.perf_counter()
    await ask()
    return (time.perf_counter() - start) * 1e3


def spread(times: list[float]) -> str:
    return f"{statistics.median(times):6.1f} ms (max {max(times):4.0f})"


def main() -> None:
    """Read the command line and measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    asyncio.run(measure(given.steps, given.rounds))


if __name__ == "__main__":
    main()
