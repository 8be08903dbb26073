"""One line of a results file: a run of the experiment."""

import gzip
from pathlib import Path

import msgspec
from msgspec import Struct


class Judged(Struct, frozen=True, kw_only=True):
    """A task as judged in the simulator."""

    valid: bool
    """It can start: the checker has no error against it and its values are right."""
    passed: bool
    """The product would offer it to a person: checker, dry run and comparison have nothing against it."""
    success: bool
    """The oracles say that it does what was asked."""
    faults: tuple[str, ...] = ()
    """Codes of the oracles."""
    said: str = ""
    """In words."""


class Whose(Struct, frozen=True, kw_only=True):
    """Which model."""

    provider: str
    model: str
    trained_on: str = ""
    """What its training saw, for the column `tuned`."""


class Run(Struct, frozen=True, kw_only=True):
    """One run."""

    provider: str
    model: str
    column: str
    task: str
    run: int
    words: str
    paper_words: bool = False
    trained_on: str = ""
    kind: str = ""
    """task, question, impossible, failed, or error: the provider gave no answer."""
    rounds: int = 0
    prompt_tokens: int = 0
    tokens: int = 0
    seconds_first: float = 0.0
    seconds: float = 0.0
    seconds_checks: float | None = None
    """Of `seconds`, what was not the model's: checker, dry runs, comparison, of all rounds. None: not told apart."""
    problems: tuple[str, ...] = ()
    """Codes of what the product had against the first answer."""
    first: Judged | None = None
    """The first answer."""
    last: Judged | None = None
    """What the loop ended with."""
    ngram_tree: float | None = None
    subtree_match: float | None = None
    flow_match: float | None = None
    mends: int = 0
    """So many things the program put right in the first answer without the model."""
    yaml_first: str = ""
    yaml: str = ""
    values: dict[str, str] = {}
    say: str = ""

    @property
    def key(self) -> tuple[str, str, str, str, int]:
        """Return what makes it the run that it is."""
        return (self.provider, self.model, self.column, self.task, self.run)


def read(path: Path) -> list[Run]:
    """Return the runs of a results file, which may be compressed (`.gz`); a last line that was cut off is passed over."""
    if not path.is_file():
        return []
    found = []
    data = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
    for line in data.split(b"\n"):
        if line.strip():
            try:
                found.append(msgspec.json.decode(line, type=Run))
            except msgspec.DecodeError:
                continue
    return found


def append(path: Path, run: Run) -> None:
    """Add a run to a results file, on a line of its own."""
    path.parent.mkdir(parents=True, exist_ok=True)
    cut = path.is_file() and path.stat().st_size > 0 and not path.read_bytes().endswith(b"\n")
    with path.open("ab") as out:
        out.write((b"\n" if cut else b"") + msgspec.json.encode(run) + b"\n")
