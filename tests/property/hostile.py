"""Texts that nobody should write, by seed, and the promise that check, fmt and fix keep for each of them.

The maker of `benchmarks/fuzz.py` and of the quick part in the suite. Everything comes from one `Random`, so that a seed is a
case.
"""

import gc
import time
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from random import Random
from typing import Final

from formiga_bt.base.diagnostics import Diagnostic, render
from formiga_bt.lang.any_file import check_text
from formiga_bt.lang.loader import load_catalogue, load_site
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.text.fixing import mend
from formiga_bt.lang.text.formatting import format_text

ROOT: Final = Path(__file__).parents[2]
MOST_S: Final = 2.0
ODD: Final = (
    "\u202e",
    "\u200b",
    "\ufeff",
    "\u2028",
    "\x85",
    "\x00",
    "\x07",
    "\ud83d",
    "é",
    "ﬁ",
    "Ａ",
    "٣",
    "²",
    "Ⅷ",
    "ı",
    "\u0301",
    "🚁",
    "\t",
    "\r",
    "\r\n",
    "\x0c",
    "\u00a0",
    "＄{",
    "’",
    "“",
    "\U000e0041",
)
TOKENS: Final = (
    "${",
    "}",
    "[",
    "]",
    "{",
    "}",
    ": ",
    "- ",
    "#",
    "&a",
    "*a",
    "!!python/object:os.system",
    "!x",
    "|",
    ">",
    "'",
    '"',
    "%",
    "@",
    "`",
    "? ",
    "---",
    "...",
    "<<: *a",
    "%YAML 1.1",
    "null",
    "~",
    "yes",
    "on",
    "1e999",
    "-0",
    "0x1F",
    ".inf",
    ".nan",
    "1:30",
    "012",
    "1_000",
    "9" * 400,
    "15",
    "0.5 %",
    "-5 s",
    "1e308 km",
    "99999999999999999999 min",
    "60 m",
    "drone.",
    ".battery",
    "is_set(",
    "formiga: 2",
    "retry: 3",
    "count: 0",
    "max: -1",
    "repeat: 1000000000",
    "every: 0 s",
    "steps:",
    "parallel:",
    "for:",
    "${range(1000)}",
)
EXPRESSIONS: Final = (
    "9**9**9**9",
    "'a' * 10**10",
    "(" * 90 + "1" + ")" * 90,
    "not " * 100 + "true",
    "-" * 300 + "1",
    "[" * 60 + "]" * 60,
    "1 < " * 60 + "1",
    " + ".join(["1"] * 200),
    " and ".join(["true"] * 120),
    "a" * 500,
    "x" * 5000,
    "().__class__.__bases__[0]",
    "lambda: 0",
    "[x for x in range(9)]",
    "f'{1}'",
    "__import__('os')",
    "range(10**9)",
    "range(1000)[999]",
    "1 if 1 else " * 60 + "1",
    "base.lat.lat.lat",
    "circle(base, 5 m, points=10**9)",
    "zigzag(base, base, 1 m, 1000000)",
    "round(1e308 * 1e308)",
    "1 / 0",
    "1 // 0",
    "mod(1, 0)",
    "9007199254740993 * 9007199254740993",
    "split(site.regions.lake, 100000)",
    "circle(base, 1e300 m)",
    "1 2",
    "==",
    "a b c",
    "drone.battery > > 3",
    "'unclosed",
    '"',
    "\\",
    "a\nb",
    "1;2",
    "x := 3",
    "await x",
    "yield",
    "*a",
    "**a",
    "print(1)",
    "a?.b",
    "a ? b : c",
    "!x",
    "a && b",
    "${a}",
    "line(base, base, 100000)",
    "polygon(base, 1 m, 0)",
    "at_height(base, -1e9 m)",
    "[1, 'a', base]",
    "١ + ٢",
    "min()",
    "max([])",
    "first([])",
    "now - now - now",
    "today('99:99')",
    "sunrise(sunrise(base))",
    "nearest(base, [])",
    "abs('x')",
)


class BrokenPromiseError(AssertionError):
    """The promise is broken; the text says how."""


@lru_cache(maxsize=1)
def ground() -> tuple[Catalogue, Site]:
    """Return the catalogue and the site that texts are checked with."""
    catalogue = load_catalogue([ROOT / "actions" / "base.yaml"])[0]
    site = load_site(ROOT / "trees" / "demo-site.yaml", catalogue)[0]
    assert site is not None
    return catalogue, site


@lru_cache(maxsize=1)
def corpus() -> tuple[str, ...]:
    """Return the texts to begin with: all shipped files and the museum of mistakes."""
    folders = ("trees", "trees/lib", "trees/scenarios", "actions", "tests/lang_errors", "tests/lang_errors/cases")
    files = [path for folder in folders for path in sorted((ROOT / folder).glob("*.yaml"))]
    return tuple(path.read_text(encoding="utf-8", errors="replace") for path in files)


# --- texts -------------------------------------------------------------------------------------------------------


def hostile_text(dice: Random) -> str:
    """Return the text of a seed."""
    maker: Callable[[Random], str] = dice.choices(MAKERS, weights=WEIGHTS)[0]
    return maker(dice)


def mutated(dice: Random) -> str:
    """Return a file of the corpus with a few lines or words dropped, doubled, moved, shifted or exchanged."""
    lines = dice.choice(corpus()).split("\n")
    for _ in range(dice.randint(1, 8)):
        at = dice.randrange(len(lines))
        match dice.randrange(8):
            case 0:
                del lines[at]
                lines = lines or [""]
            case 1:
                lines.insert(at, lines[at])
            case 2:
                lines.insert(dice.randrange(len(lines) + 1), lines[at])
            case 3:
                lines[at] = " " * dice.choice((0, 1, 2, 4, 7)) + lines[at].lstrip()
            case 4:
                words = lines[at].split(" ")
                words[dice.randrange(len(words))] = dice.choice(TOKENS)
                lines[at] = " ".join(words)
            case 5:
                col = dice.randint(0, len(lines[at]))
                lines[at] = lines[at][:col] + dice.choice((*TOKENS, *ODD)) + lines[at][col:]
            case 6:
                other = dice.choice(corpus()).split("\n")
                start = dice.randrange(len(other))
                lines[at:at] = other[start : start + dice.randint(1, 6)]
            case _:
                key, colon, _ = lines[at].partition(":")
                lines[at] = f"{key}{colon} {dice.choice(TOKENS)}"
    return "\n".join(lines)


def spliced(dice: Random) -> str:
    """Return a file with a hostile expression where one was."""
    text = dice.choice(corpus())
    expression = (
        dice.choice(EXPRESSIONS)
        if dice.random() < 0.7
        else "".join(dice.choices("()[]+-*/.<>=!'ab1 %$,", k=dice.randint(1, 80)))
    )
    holes = [at for at in range(len(text)) if text.startswith("${", at)]
    if holes and dice.random() < 0.7:
        at = dice.choice(holes)
        end = text.find("}", at)
        return text[: at + 2] + expression + text[end:]
    return text + f"\n  - check: {expression}\n  - wait: ${{{expression}}}\n"


def bytes_(dice: Random) -> str:
    """Return noise, or a file with noise in it."""
    noise = bytes(dice.randrange(256) for _ in range(dice.randint(1, 400))).decode(
        "utf-8", dice.choice(("replace", "surrogateescape"))
    )
    text = dice.choice(corpus()) if dice.random() < 0.6 else ""
    at = dice.randint(0, len(text))
    return text[:at] + noise + text[at:]


def odd(dice: Random) -> str:
    """Return a file with odd characters in it."""
    text = dice.choice(corpus())
    for _ in range(dice.randint(1, 6)):
        at = dice.randint(0, len(text))
        text = text[:at] + dice.choice(ODD) * dice.choice((1, 1, 3)) + text[at:]
    return text


def bomb(dice: Random) -> str:
    """Return a text that grows when it is read, or nests beyond reason."""
    deep = dice.choice((30, 63, 64, 65, 500, 20_000))
    head = "formiga: 1\ntask: Bomb\nagents:\n  drone: {type: lwd}\n"
    match dice.randrange(9):
        case 0:
            rows = [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 12)]
            return "a0: &a0 [x, x]\n" + "\n".join(rows)
        case 1:
            return head + "steps: " + "[" * deep + "]" * dice.choice((deep, 0))
        case 2:
            return head + "steps:\n" + "".join(f"{'  ' * n}- sequence:\n" for n in range(1, min(deep, 500)))
        case 3:
            return head + "steps: " + '{"sequence": [' * min(deep, 3000) + "]}" * min(deep, 3000)
        case 4:
            calls = "\n".join(
                f"  S{n}:\n    steps:\n" + f"      - call: S{n + 1}\n" * dice.choice((2, 10, 30))
                for n in range(dice.choice((5, 20, 60)))
            )
            last = calls.count("\n  S") + 1
            return f"{head}steps:\n  - call: S0\nsubtrees:\n{calls}  S{last}:\n    steps:\n      - wait: 1 s\n"
        case 5:
            return head + "steps:\n" + "".join(f'  - for: {{i{n}: "${{range(1000)}}"}}\n' for n in range(200))
        case 6:
            loops = "".join(
                f'{"    " * n}  - for: {{i{n}: "${{range(1000)}}"}}\n{"    " * n}    steps:\n'
                for n in range(dice.choice((2, 8, 14)))
            )
            depth = loops.count("for:")
            return f"{head}steps:\n{loops}{'    ' * depth}  - wait: 1 s\n"
        case 7:
            loops = "".join(f"{'    ' * n}  - repeat: 1000\n{'    ' * n}    steps:\n" for n in range(10))
            return f"{head}steps:\n{loops}{'    ' * 10}  - do: drone.TakeOff\n{'    ' * 10}  - do: drone.LandIn\n"
        case _:
            return (
                head
                + "vars:\n"
                + "".join(f"  v{n}: ${{v{n + 1}}}\n" for n in range(dice.choice((50, 900))))
                + "steps: []\n"
            )


def long(dice: Random) -> str:
    """Return a text with very long lines or very many of them."""
    size = dice.choice((100_000, 999_000, 1_100_000))
    head = "formiga: 1\ntask: Long\nagents:\n  drone: {type: lwd}\nsteps:\n"
    match dice.randrange(8):
        case 0:
            return head + "  - notify: " + dice.choice(("x", "x ", "${", "'", "é", "{", "\\")) * (size // 2)
        case 1:
            return head + f"  - check: {'a' * size}"
        case 2:
            return head + "  - wait: 1 s\n" * min(size // 14, 19_000)
        case 3:
            return head + "  - do: drone.TakeOff\n  - do: drone.LandIn\n    with: {at: '${drone.home}'}\n" * 2_500
        case 4:
            return head + "  - notify: hello # " + "#" * size
        case 5:
            return "x" * size
        case 6:
            return "\n" * size
        case _:
            return head + "  - {wait: 1 s" + ", wait: 1 s" * min(size // 20, 9_000) + "}"


MAKERS: Final[tuple[Callable[[Random], str], ...]] = (mutated, spliced, bytes_, odd, bomb, long)
WEIGHTS: Final = (50, 25, 8, 8, 5, 4)


# --- the promise -------------------------------------------------------------------------------------------------


def try_all(text: str) -> float:
    """Check, lay out and mend a text; return the longest time that one of them took, seconds.

    Raises:
        BrokenPromiseError: one took too long, or a problem has no place. Anything else that is raised breaks the promise too.
    """
    catalogue, site = ground()
    path = ROOT / "trees" / "hostile.yaml"

    def check(one: str) -> list[Diagnostic]:
        return check_text(one, path, catalogue, [ROOT / "actions" / "base.yaml"], site)

    slowest = 0.0
    found: list[Diagnostic] = []
    for what in ("check", "fmt", "fix"):
        gc.disable()  # else what other tests of this process left is looked through meanwhile
        began = time.process_time()
        try:
            if what == "check":
                found = check(text)
            elif what == "fmt":
                found = format_text(text, str(path)).diagnostics
            elif len(text) < 20_000:
                found = list(mend(text, str(path), check).left)
        finally:
            gc.enable()
        seconds = time.process_time() - began
        slowest = max(slowest, seconds)
        if seconds > MOST_S * (4 if what == "fix" else 1):  # it checks again and again
            raise BrokenPromiseError(f"{what} took {seconds:.1f} s")
        _placed(found, text, str(path))
    return slowest


def _placed(found: list[Diagnostic], text: str, file: str) -> None:
    for one in found[:200]:
        mark = one.mark
        if mark.file == file and not (
            1
            <= mark.line
            <= text.count("\n")
            + text.count("\r")
            + text.count("\x85")
            + text.count("\u2028")
            + text.count("\u2029")
            + 2
            and mark.col >= 1
        ):
            raise BrokenPromiseError(f"{one.code} at {mark.line}:{mark.col} is outside the file")
        if not one.message or not render(one, {file: text}):
            raise BrokenPromiseError(f"{one.code} says nothing")
