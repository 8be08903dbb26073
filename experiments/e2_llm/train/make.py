"""Makes the training file: `python -m experiments.e2_llm.train.make --pairs 6000 --seed 1 --out pairs.jsonl`.

The first row says what made it; then come the practices, each a row with its system prompt, followed by the rows of its pairs.
The same seed gives the same file, byte for byte, with the same version of the project.
"""

import argparse
import hashlib
import json
import re
import sys
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import msgspec

from experiments.e2_llm.train.leaks import LEAST_STEPS, THRESHOLD, WINDOW
from experiments.e2_llm.train.pairs import Maker, Pair

FORMAT = 1


def rows_of(maker: Maker, pairs: int, progress: Any = None) -> Iterable[dict[str, Any]]:
    """Return the rows of so many pairs."""
    yield {
        "format": FORMAT,
        "seed": maker.seed,
        "pairs": pairs,
        "window": WINDOW,
        "threshold": THRESHOLD,
        "least_steps": LEAST_STEPS,
    }
    done = 0
    for made in maker.practices():
        kept = made.pairs[: pairs - done]
        if kept:
            yield {"site": made.practice.number, "system": made.practice.system}
            yield from (msgspec.to_builtins(one) for one in kept)
        done += len(kept)
        if progress is not None:
            progress(done)
        if done >= pairs:
            return


def statistics(pairs: Sequence[Pair], systems: Sequence[str]) -> str:
    """Return what a file has, in a few lines. Tokens are about four characters of an answer, three of Spanish."""
    kinds = Counter(one.kind for one in pairs)
    words = Counter(word for one in pairs for word in re.findall(r"[^\W\d_]+", one.request.casefold()))
    shapes = Counter(one.shape for one in pairs if one.shape)
    same = len(pairs) - len({one.request.casefold() for one in pairs})
    asked, answered = _spread(len(one.request) / 4 for one in pairs), _spread(len(one.answer) / 3.4 for one in pairs)
    return "\n".join(
        [
            f"{len(pairs)} pairs on {len(systems)} sites; {sum(one.held for one in pairs)} held out; "
            f"{sum(one.language == 'es' for one in pairs)} in Spanish; {sum(one.wide for one in pairs)} in wide words; "
            f"{same} twice",
            "kinds: " + ", ".join(f"{kind} {count}" for kind, count in kinds.most_common()),
            f"tokens, about: prompt {_spread(len(one) / 4 for one in systems)}, request {asked}, answer {answered}",
            f"words: {len(words)} different of {words.total()}; shapes of trees: {len(shapes)}, "
            f"the commonest {max(shapes.values(), default=0)} times",
        ]
    )


def _spread(values: Iterable[float]) -> str:
    found = sorted(values)
    if not found:
        return "-"
    return f"{found[0]:.0f} to {found[-1]:.0f} (median {found[len(found) // 2]:.0f})"


def read_pairs(path: Path) -> tuple[dict[str, Any], dict[int, str], list[Pair]]:
    """Return the first row, the system prompts by site, and the pairs of a file."""
    first, *rows = (json.loads(line) for line in path.read_text(encoding="utf-8").splitlines())
    if first.get("format") != FORMAT:
        raise SystemExit(
            f"{path} is no training file of this version; make it again: python -m experiments.e2_llm.train.make"
        )
    systems = {row["site"]: row["system"] for row in rows if "system" in row}
    return first, systems, [msgspec.convert(row, Pair) for row in rows if "request" in row]


def main(arguments: Sequence[str] | None = None) -> None:
    """Make a training file, and say what is in it."""
    parser = argparse.ArgumentParser(
        prog="python -m experiments.e2_llm.train.make", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--pairs", type=int, required=True, help="how many")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True, help="a .jsonl file")
    given = parser.parse_args(arguments)
    began = time.monotonic()

    def progress(done: int) -> None:
        rate = done / (time.monotonic() - began)
        if sys.stderr.isatty() or done % 100 < 6:
            end = "\r" if sys.stderr.isatty() else "\n"
            sys.stderr.write(f"{done} of {given.pairs} pairs, {rate:.1f} a second{end}")

    maker = Maker(given.seed)
    given.out.parent.mkdir(parents=True, exist_ok=True)
    partial = given.out.with_suffix(".partial")
    with partial.open("w", encoding="utf-8") as file:
        for row in rows_of(maker, given.pairs, progress):
            file.write(json.dumps(row, ensure_ascii=False) + "\n")
    partial.rename(given.out)
    _, systems, pairs = read_pairs(given.out)
    digest = hashlib.sha256(given.out.read_bytes()).hexdigest()
    left_out = ", ".join(f"{why}: {count}" for why, count in maker.dropped.most_common())
    seconds = time.monotonic() - began
    sys.stdout.write(statistics(pairs, list(systems.values())))
    sys.stdout.write(
        f"\nleft out: {left_out}\n{seconds:.0f} s, {len(pairs) / seconds:.1f} pairs a second; SHA-256 {digest}\n"
    )


if __name__ == "__main__":
    main()
