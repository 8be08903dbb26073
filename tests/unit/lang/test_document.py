"""YAML text to nodes with marks, and the explanations of what cannot be read."""

import re
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.text.document import Listing, Mapping_, Scalar, parse
from tests.golden import Wording


def only_problem(text):
    root, found = parse(text, "t.yaml")
    assert root is None
    assert len(found) == 1
    return found[0]


def test_scalars_stay_text_and_keep_their_place():
    root, found = parse("a: no\nlist: [on, 12:30, 010]\n", "t.yaml")
    assert found == []
    assert isinstance(root, Mapping_)
    entry = root.get("a")
    assert entry is not None
    assert entry.key.mark == Mark("t.yaml", 1, 1, 1, 2)
    assert entry.value == Scalar("no", Mark("t.yaml", 1, 4, 1, 6))
    listing = root.get("list").value
    assert isinstance(listing, Listing)
    assert [item.text for item in listing.items] == ["on", "12:30", "010"]
    assert listing.mark == Mark("t.yaml", 2, 7, 2, 23)


def test_a_key_without_a_value_is_an_empty_scalar():
    root, found = parse("a:\nb: 1\n", "t.yaml")
    assert found == []
    assert root.get("a").value.text == ""
    assert root.get("missing") is None


def test_nothing_in_the_file_is_no_node():
    assert parse("", "t.yaml") == (None, [])
    assert parse("# only a comment\n", "t.yaml") == (None, [])


def test_a_block_collection_ends_with_its_last_line_of_content():
    root, _ = parse("a:\n  - b\n  - c\n\n# about d\nd: 1\n", "t.yaml")
    assert root.get("a").value.mark == Mark("t.yaml", 2, 3, 3, 6)


@pytest.mark.parametrize(
    ("text", "start", "end", "cols"),
    [
        ("k: ${target}", 2, 8, (6, 12)),
        ("k: '${target}'", 2, 8, (7, 13)),
        ('k: "${target}"', 2, 8, (7, 13)),
    ],
)
def test_mark_at_counts_the_opening_quote(text, start, end, cols):
    root, _ = parse(text, "t.yaml")
    value = root.get("k").value
    mark = value.mark_at(start, end)
    assert (mark.col, mark.end_col) == cols
    assert text[mark.col - 1 : mark.end_col - 1] == value.text[start:end]


@pytest.mark.parametrize("text", ['k: "a\\tb"', "k: 'it''s'", "k: |\n  a b\n", "k: a\n  b\n"])
def test_mark_at_of_folded_or_escaped_text_is_the_whole_scalar(text):
    root, found = parse(text, "t.yaml")
    assert found == []
    value = root.get("k").value
    assert value.mark_at(0, 1) == value.mark


def test_block_and_quoted_styles_are_known():
    root, _ = parse("a: |\n  x\nb: 'y'\nc: z\n", "t.yaml")
    assert [(e.value.block, e.value.quoted) for e in root.entries] == [(True, False), (False, True), (False, False)]


def test_e002_names_the_first_line_and_keeps_the_first_value(wording: Wording):
    root, found = parse("timeout: 1 s\nwait: 2 s\ntimeout: 3 s\n", "t.yaml")
    assert [(d.code, str(d.mark)) for d in found] == [("E002", "t.yaml:3:1")]
    wording([d.message for d in found])
    assert root.get("timeout").value.text == "1 s"


@pytest.mark.parametrize(
    ("text", "place", "message", "mended"),
    [
        ("a: {to: ${target}}", "1:9", 'inside { } write "${target}" in quotes', 'a: {to: "${target}"}'),
        ("a: [${x}, ${y}]", "1:5", 'inside { } write "${x}" in quotes', 'a: ["${x}", "${y}"]'),
        ("notify: Alarm: come", "1:14", "': ' inside a text begins a new key", 'notify: "Alarm: come"'),
        ("x: 1\nwhen: !a.b", "2:7", "'!' begins a YAML tag; the language says 'not'", "when: not a.b"),
        ("a: [!x]", "1:5", "'!' begins a YAML tag; the language says 'not'", "a: [not x]"),
        ('ask: "Alarm" is it?', "1:13", "text goes on after the closing quote", "ask: '\"Alarm\" is it?'"),
        ('ask: "Row #3', "1:11", "' #' begins a comment, the rest of the line is not read", 'ask: "Row #3"'),
        ("ask: 'Row", "1:6", "this quote is never closed", 'ask: "Row"'),
        ("a:\n\t- b", "2:1", "a tab in the indentation", "- b"),
        ("x: @foo", "1:4", "a text cannot begin with '@' unless it stands in quotes", 'x: "@foo"'),
        ("a: ${x ? 1 : 2}", "1:4", "'a ? b : c' is not part of the language", "a: ${1 if x else 2}"),
    ],
)
def test_e001_explains_the_trap_and_mends_the_line(text, place, message, mended):
    problem = only_problem(text)
    assert (problem.code, str(problem.mark), problem.message) == ("E001", f"t.yaml:{place}", message)
    assert problem.help == f"write: {mended}"
    assert problem.fix is not None
    lines = text.split("\n")
    lines[problem.mark.line - 1] = problem.fix.text
    assert parse("\n".join(lines), "t.yaml")[1] == []


def test_text_hidden_behind_a_hash_and_a_digit_is_refused_but_comments_are_not(wording: Wording):
    _, found = parse("ask: Row #3 ready?\n", "t.yaml")
    assert [(d.code, str(d.mark)) for d in found] == [("E001", "t.yaml:1:10")]
    wording([d.help for d in found])
    assert parse("timeout: 30 min # from now\nb: 1 #comment\n", "t.yaml")[1] == []


def test_other_syntax_errors_show_the_parsers_words_and_place(wording: Wording):
    problem = only_problem("a: b\n  c: d\n")
    assert (problem.code, problem.mark.line) == ("E001", 2)
    wording(problem.message)
    assert "indentation" in problem.help


@pytest.mark.parametrize("code", ["202A", "202E", "2066", "2069"])
def test_what_turns_the_direction_of_a_text_is_refused_for_it_hides_what_a_file_says(code):
    said = f"the invisible character U+{code} is not allowed in a task file"
    assert only_problem(f"a: x {chr(int(code, 16))} y # z").message == said


def test_control_characters_are_refused(wording: Wording):
    wording(only_problem("a: \x00").message)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: &x 1\nb: *x\n", "anchors and aliases are not part of the language"),
        ("b: *x\n", "anchors and aliases are not part of the language"),
        ("a: !!python/object:os.system x\n", "tags (words that begin with '!') are not part of the language"),
        ("a: 1\n---\nb: 2\n", "a file holds one document"),
        ("[" * 3000, "nested more than 64 levels deep"),
        ("- " * 65 + "x", "nested more than 64 levels deep"),
        ("[" + "1," * 20_001 + "]", "more than 20,000 values in one file"),
        ("a: " + "x" * 1_000_001, "the file is larger than 1 MB"),
    ],
)
def test_e003_refuses_what_the_language_does_not_have(text, message):
    problem = only_problem(text)
    assert (problem.code, problem.message) == ("E003", message)


def test_sixty_four_levels_are_fine():
    assert parse("[" * 64 + "]" * 64, "t.yaml")[1] == []


def test_a_bomb_is_refused_before_it_is_built():
    lines = ["a: &a [x,x,x,x,x,x,x,x,x]"] + [
        f"{chr(98 + i)}: &{chr(98 + i)} [{f'*{chr(97 + i)},' * 9}]" for i in range(9)
    ]
    began = time.perf_counter()
    assert only_problem("\n".join(lines)).code == "E003"
    assert time.perf_counter() - began < 1.0


yaml_like = st.text(alphabet=st.sampled_from(list("ab:-?[]{}&*!|>'\"%@`#,. \n\t${}01")), max_size=80)


@settings(max_examples=400, deadline=1000)
@given(st.one_of(st.text(max_size=200), yaml_like))
def test_parse_never_raises(text):
    root, found = parse(text, "t.yaml")
    lines = re.split("\r\n|\r|\n", text)
    for problem in found:
        assert problem.code in ("E001", "E002", "E003")
        assert 1 <= problem.mark.line <= len(lines)
    assert root is not None or found or not text.strip() or "#" in text or text.strip("\ufeff \n-.") == ""
