"""Whatever an author or a model writes, the loader answers with a task or with located errors, never with an exception."""

from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from formiga_bt.base.diagnostics import render
from formiga_bt.lang.loader import Loaded, load_catalogue, load_task_text
from formiga_bt.lang.site import load_site_text

ROOT = Path(__file__).parents[2]
CATALOGUE = load_catalogue([ROOT / "actions" / "base.yaml"])[0]
MUSEUM = sorted((ROOT / "tests" / "lang_errors").glob("*.yaml"))
TASKS = [p.read_text() for p in (*(ROOT / "trees").glob("*.yaml"), *MUSEUM) if "site" not in p.name]
SITES = [
    p.read_text() for p in (ROOT / "trees" / "demo-site.yaml", *MUSEUM) if "site" in p.name and "of_site" not in p.name
]
WORDS = sorted({word for text in TASKS for word in text.split()})
SNIPPETS = st.one_of(
    st.sampled_from(WORDS),
    st.sampled_from(
        ["[]", "{}", "''", "null", "${", "}", "- ", ":", "${base}", "15", "0.5 %", "if:", "&a", "!x", "\t", "\n"]
    ),
    st.text(max_size=6),
)


@st.composite
def mutated(draw: st.DrawFn, texts: list[str]) -> str:
    """Return a text with a few lines dropped, doubled, moved, shifted, or words exchanged."""
    lines = draw(st.sampled_from(texts)).split("\n")
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(lines) - 1))
        match draw(st.sampled_from(["drop", "double", "move", "shift", "word", "insert"])):
            case "drop":
                lines = lines[:at] + lines[at + 1 :] or [""]
            case "double":
                lines.insert(at, lines[at])
            case "move":
                lines.insert(draw(st.integers(0, len(lines))), lines[at])
            case "shift":
                lines[at] = draw(st.sampled_from(["  ", "    ", ""])) + lines[at].lstrip()
            case "word":
                words = lines[at].split(" ")
                words[draw(st.integers(0, len(words) - 1))] = draw(SNIPPETS)
                lines[at] = " ".join(words)
            case _:
                col = draw(st.integers(0, len(lines[at])))
                lines[at] = lines[at][:col] + draw(SNIPPETS) + lines[at][col:]
    return "\n".join(lines)


def check(loaded: Loaded) -> None:
    errors = [d for d in loaded.diagnostics if d.severity == "error"]
    assert (loaded.task is None) == bool(errors)
    for found in loaded.diagnostics:
        assert found.mark.file in loaded.sources
        assert found.mark.line >= 1
        assert found.mark.col >= 1
        assert found.message
        assert render(found, loaded.sources)


@settings(max_examples=300, deadline=None)
@given(mutated(TASKS))
def test_a_mutated_task_is_read_or_refused_with_a_place(text: str) -> None:
    check(load_task_text(text, "task.yaml", catalogue=CATALOGUE))


@settings(max_examples=100, deadline=None)
@given(mutated(SITES))
def test_a_mutated_site_is_read_or_refused_with_a_place(text: str) -> None:
    site, found, sources = load_site_text(text, str(ROOT / "tests" / "lang_errors" / "site.yaml"), CATALOGUE)

    assert (site is None) == any(d.severity == "error" for d in found)
    assert all(d.mark.line >= 1 and d.mark.col >= 1 for d in found)
    assert render(found[0], sources) if found else True


@settings(max_examples=30, deadline=None)
@given(mutated(TASKS))
def test_reading_twice_says_the_same(text: str) -> None:
    first, second = (load_task_text(text, "task.yaml", catalogue=CATALOGUE) for _ in range(2))

    assert first.diagnostics == second.diagnostics
