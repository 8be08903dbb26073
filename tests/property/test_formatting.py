"""`formiga fmt` on all that ships, on drawn trees, on nonsense: no meaning changes, no comment is lost, once is enough."""

import re
from collections.abc import Mapping
from pathlib import Path
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import Struct

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.loader import load_catalogue, load_task_text
from formiga_bt.lang.text.document import Listing, Mapping_, Node, Scalar, parse
from formiga_bt.lang.text.formatting import format_text
from tests.property.strategies import load, task_text
from tests.property.test_loader_never_raises import mutated
from tests.shares import in_ci, some

ROOT = Path(__file__).parents[2]
SHIPPED = sorted([*(ROOT / "trees").rglob("*.yaml"), *(ROOT / "actions").glob("*.yaml")])
MUSEUM = sorted(p for p in (ROOT / "tests" / "lang_errors").rglob("*.yaml") if "unreadable" not in p.parts)
CATALOGUE = load_catalogue([ROOT / "actions" / "base.yaml"])[0]
OURS = re.compile(r"# (?:over|at) \d+$", re.MULTILINE)
ALL = [path.read_text(encoding="utf-8") for path in (*SHIPPED, *MUSEUM)]


PASSED_OVER = ("mark", "bundle", "covered", "run", "deadlines", "const", "room")


def meaning(value: Any) -> Any:
    """Return a model without its places in the file, its code and its hash."""
    if isinstance(value, Mark):
        return None
    if isinstance(value, Struct):
        names = value.__struct_fields__
        return {name: meaning(getattr(value, name)) for name in names if name not in PASSED_OVER}
    if isinstance(value, Mapping):
        return {str(key): meaning(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [meaning(one) for one in value]
    return None if callable(value) else value


def words(node: Node | None) -> Any:
    match node:
        case Scalar():
            return node.text
        case Listing():
            return [words(item) for item in node.items]
        case Mapping_():
            return [(entry.key.text, words(entry.value)) for entry in node.entries]
        case _:
            return None


def formatted(text: str) -> str | None:
    done = format_text(text, "task.yaml")
    if done.text is not None:
        assert format_text(done.text, "task.yaml").text == done.text
        assert words(parse(done.text, "")[0]) == words(parse(text, "")[0])
    return done.text


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.name)
def test_what_ships_is_formatted(path: Path) -> None:
    text = path.read_text(encoding="utf-8")

    assert formatted(text) == text


@pytest.mark.parametrize("path", MUSEUM, ids=lambda path: path.name)
def test_mistakes_are_laid_out_without_being_mended(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    done = formatted(text)

    assert done is not None or parse(text, "")[1]


@pytest.mark.parametrize("seed", [*range(20), *in_ci(range(20, 60))])
def test_the_model_of_a_drawn_tree_is_the_same(seed: int) -> None:
    text = task_text(Random(seed))
    before = load(text)
    done = formatted(text)
    assert done is not None
    assert "[{" not in done

    after = load(done)
    assert (before is None) == (after is None)
    assert meaning(before) == meaning(after)


@pytest.mark.parametrize("path", [p for p in SHIPPED if "task:" in p.read_text()], ids=lambda path: path.name)
def test_the_model_of_a_shipped_task_is_the_same_however_it_was_shifted(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    shifted = "\n".join(f"  {x}" for x in text.split("\n"))
    done = formatted(shifted)
    assert done is not None

    first, second = (load_task_text(one, "task.yaml", catalogue=CATALOGUE, folder_=path.parent) for one in (text, done))
    assert meaning(first.task) == meaning(second.task)
    assert meaning(first.diagnostics) == meaning(second.diagnostics)


@settings(max_examples=some(150, 400), deadline=None)
@given(mutated(ALL), st.integers(0, 2**32))
def test_a_mutated_text_with_comments_keeps_its_words_and_comments(text: str, seed: int) -> None:
    dice = Random(seed)
    lines = []
    for number, line in enumerate(text.split("\n")):
        if dice.random() < 0.1:
            lines.append(" " * dice.randint(0, 8) + f"# over {number}" if dice.random() < 0.7 else "")
        lines.append(line + f" # at {number}" if dice.random() < 0.1 else line)
    source = "\n".join(lines)
    done = formatted(source)
    assert done is None or formatted(done) == done
    assert done is None or OURS.findall(done) == OURS.findall(source), "they keep their order"


def test_a_comment_deeper_than_a_mapping_in_braces_is_kept() -> None:
    done = formatted("task: Slip\nparams:\n  b: {type: enum}\n      # over\n  c: text\n")

    assert done == "task: Slip\nparams:\n  b:\n    type: enum\n    # over\n  c: text\n"


def test_comments_below_the_last_item_keep_their_order() -> None:
    head = "steps:\n  - notify: a\n"
    done = formatted(
        f"{head}# one\n  # two\n    # three\n# four\nfinally:\n  - notify: b\n    # five\n  # six\n# seven\n"
    )

    assert done == f"{head}  # one\n  # two\n  # three\n# four\nfinally:\n  - notify: b\n    # five\n  # six\n# seven\n"


@pytest.mark.parametrize("end", ["", "\n", "\n# below\n"])
def test_a_comment_behind_a_long_text_that_ends_the_file_stays_there(end: str) -> None:
    done = formatted(f"task: C\nsteps:\n  - notify: a\n  - check: a >\n      1 m   # why{end}")

    assert done == f"task: C\nsteps:\n  - notify: a\n  - check: a > 1 m  # why\n{end.lstrip()}"


def test_steps_of_every_case_are_written_out() -> None:
    done = formatted("steps:\n  - switch: b\n    cases:\n      1: [{notify: one}]\n    default: [{notify: other}]\n")

    assert done == (
        "steps:\n  - switch: b\n    cases:\n      1:\n        - notify: one\n    default:\n      - notify: other\n"
    )
