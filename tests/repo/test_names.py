"""The code names no type and no action of the catalogues that ship: it asks the catalogue what one is and does.

What decides is a mobility, an effect, a field; so a site of one's own types meets the same rules. Searched are constants of the
code, without docstrings and comments. A name that is no word of English (`lwd`, `GoTo`) counts wherever it stands in one, for
what people read of a hint must fit their site, too; a word (`drone`, `Open`) counts only as the whole of one.
"""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import yaml

from formiga_bt.base.asking import CONFIRM

ROOT = Path(__file__).parents[2]

ALLOWED = {
    "base/asking.py": "the language itself asks people: `ask` is this action",
    "base/roles.py": "a role of accounts, of who works in the field: not a type of agents",
}
"""Files of the package that may name what, beside the drafting of missions; each with its reason."""

WORDS = {
    "person": "what an agent is that is asked, whatever its type",
    "door": "where requests come in",
}
"""Words that formiga itself uses for something else."""

DRAFTING = 86
"""Names in formiga_bt/llm, which is to be founded anew on the catalogue. It may only shrink: write here what is left."""


@cache
def shipped() -> frozenset[str]:
    """Return the names of all types and actions that ship."""
    files = [yaml.safe_load(path.read_text()) for path in (ROOT / "actions").glob("*.yaml")]
    return frozenset(name for file in files for group in ("types", "actions") for name in file.get(group, {}))


@cache
def labels() -> frozenset[str]:
    """Return what shipped types are called by people."""
    files = [yaml.safe_load(path.read_text()) for path in (ROOT / "actions").glob("*.yaml")]
    return frozenset(of["label"] for file in files for of in file["types"].values())


def is_word(name: str) -> bool:
    """Return whether a name is a word of English: a type that is called so, an action of one word."""
    return name in labels() or re.fullmatch(r"[A-Z][a-z]+", name) is not None


def constants(path: Path) -> Iterator[tuple[int, str]]:
    """Return the lines and texts of the string constants of a file that are no docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    said = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in said:
            yield node.lineno, node.value


def named(path: Path, names: frozenset[str]) -> list[str]:
    """Return where a file names a type or an action."""
    codes = {name.lower(): name for name in names if not is_word(name)}
    return [
        f"{path.relative_to(ROOT)}:{line}: {name}"
        for line, text in constants(path)
        for name in sorted({*_tokens(text, codes), *names.intersection([text]) - WORDS.keys()})
    ]


def _tokens(text: str, codes: dict[str, str]) -> set[str]:
    """Return the names that stand in a text, in whatever case."""
    return {codes[word] for word in map(str.lower, re.findall(r"\w+", text)) if word in codes}


@cache
def found(of: str) -> list[str]:
    """Return all names in the files of a folder."""
    return [one for path in sorted((ROOT / of).rglob("*.py")) for one in named(path, shipped())]


def test_the_names_are_those_that_ship() -> None:
    assert {"lwd", "hwd", "TakeOff", "Drive", "door", CONFIRM} <= shipped()
    assert not {name for name in ("lwd", "hwd", "TakeOff", "GoTo", "MiniFinder") if is_word(name)}


def test_no_code_names_a_type_or_an_action() -> None:
    inside = [one for one in found("formiga_bt") if not one.startswith("formiga_bt/llm/")]
    elsewhere = [one for one in inside if one.partition(":")[0].removeprefix("formiga_bt/") not in ALLOWED]

    assert elsewhere == []


def test_what_is_allowed_is_still_needed() -> None:
    files = Counter(one.partition(":")[0].removeprefix("formiga_bt/") for one in found("formiga_bt"))

    assert [file for file in ALLOWED if file not in files] == []


def test_the_drafting_of_missions_names_ever_less() -> None:
    left = len([one for one in found("formiga_bt") if one.startswith("formiga_bt/llm/")])

    assert left <= DRAFTING, "ask the catalogue (lang.naming) instead"
    assert left >= DRAFTING, f"fewer names than before: write DRAFTING = {left}"
