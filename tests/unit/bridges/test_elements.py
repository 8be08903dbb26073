"""XML that is read safely, and written so that it is read the same."""

import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from formiga_bt.bridges.elements import MAX_BYTES, MAX_DEPTH, XmlElement, XmlRefused, parse, write
from tests.golden import Wording

BOMB = b"""<?xml version="1.0"?>
<!DOCTYPE lolz [
 <!ENTITY lol "lol">
 <!ENTITY lol2 "&lol;&lol;&lol;&lol;&lol;&lol;&lol;&lol;&lol;&lol;">
]>
<root BTCPP_format="4"><BehaviorTree ID="&lol2;"/></root>"""
FILE_ENTITY = b'<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><root>&x;</root>'


@pytest.mark.parametrize(
    ("data", "place", "said"),
    [
        (BOMB, (2, 16), "a document type (DOCTYPE) is not read"),
        (FILE_ENTITY, (1, 13), "a document type (DOCTYPE) is not read"),
        (b"<root>&x;</root>", (1, 7), "this is not XML: undefined entity"),
        (b"<root>\n<?php 1 ?></root>", (2, 1), "a processing instruction is not read"),
        (b"<a>" * 100_000, (1, 193), f"more than {MAX_DEPTH} levels"),
        (b"<r>" + b"<a/>" * 30_000 + b"</r>", (1, 80_000), "more than 20000 elements"),
        (b"<root>" + b" " * 10_000_000 + b"</root>", (1, 1), "the file is larger than 1 MB"),
        (b"", (1, 1), "this is not XML: no element found"),
        (b"formiga: 1", (1, 1), "this is not XML: syntax error"),
        (b"<root>\n  <a>\n</root>", (3, 3), "this is not XML: mismatched tag"),
        (b'<?xml version="1.0" encoding="klingon"?><r/>', (1, 1), "this encoding is not known"),
        (b"\x00\xff\xfe", (1, 1), "this is not XML: syntax error"),
    ],
    ids=["bomb", "file", "entity", "php", "deep", "many", "large", "empty", "yaml", "tags", "encoding", "noise"],
)
def test_what_could_harm_is_refused_with_its_place(data: bytes, place: tuple[int, int], said: str) -> None:
    with pytest.raises(XmlRefused) as refused:
        parse(data)
    assert ((refused.value.line, refused.value.col), refused.value.message) == (place, said)


def test_nothing_that_is_refused_takes_long() -> None:
    started = time.process_time()
    for data in (b"<!--" * 200_000, b'<a b="' * 150_000, b"<" * MAX_BYTES, b'="' * 400_000):
        with pytest.raises(XmlRefused):
            parse(data)
    assert time.process_time() - started < 10.0


def test_what_btcpp_reads_though_it_is_no_xml_is_read(wording: Wording) -> None:
    root = parse(b'<root>\n<!------ ruler ------>\n<A code="a < 3 && b &amp;&amp; c"/></root>')
    assert [(e.tag, e.line) for e in root.children] == [("A", 3)]
    wording([e.get("code") for e in root.children])


TEXTS = st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=20)


@given(TEXTS, TEXTS, TEXTS)
def test_what_is_written_is_read_again(value: str, text: str, comment: str) -> None:
    element = XmlElement("A", {"b": value}, text=text, comment=comment)
    back = parse(write(XmlElement("root", {}, [element]), comment).encode()).children[0]
    assert (back.attrs, back.text) == (
        {"b": value.replace("\ufffe", "?").replace("\uffff", "?")},
        text.replace("\ufffe", "?"),
    )
