"""Names of files, and their bytes, are looked at wherever they come in."""

from hashlib import sha256

import pytest
from msgspec.structs import replace

from formiga_bt.transport.attachments import (
    MOST_BYTES,
    MOST_NAMED,
    FileError,
    attachment_of,
    check_bytes,
    fault_of,
    usable,
)

GOOD = attachment_of("roof 1.jpg", b"bytes", "image/jpeg")


def test_a_file_is_named_by_its_bytes() -> None:
    assert (GOOD.size, GOOD.sha256) == (5, sha256(b"bytes").hexdigest())
    assert fault_of(GOOD) == ""
    check_bytes(GOOD.sha256, b"bytes")


@pytest.mark.parametrize(
    "name", ["", "../../etc/passwd", "a/b", "a\\b", ".hidden", "a\nb", "x" * 101, " a", "con:1", "a\x00"]
)
def test_no_name_is_a_path(name: str) -> None:
    assert fault_of(replace(GOOD, name=name))
    with pytest.raises(FileError):
        attachment_of(name, b"")


@pytest.mark.parametrize(
    "wrong",
    [
        {"media_type": "image"}, {"media_type": "text/html\r\nX: y"}, {"sha256": "abc"}, {"sha256": GOOD.sha256.upper()},
        {"size": -1}, {"size": MOST_BYTES + 1}, {"uri": "file:///etc/passwd"}, {"uri": "javascript:alert(1)"},
    ],
)  # fmt: skip
def test_what_cannot_be_served_is_refused(wrong: dict[str, object]) -> None:
    assert fault_of(replace(GOOD, **wrong))


def test_the_rest_of_an_event_stands() -> None:
    good, bad = usable([replace(GOOD, name="../x"), GOOD, *[replace(GOOD, name=f"{n}.jpg") for n in range(MOST_NAMED)]])
    assert (len(good), len(bad)) == (MOST_NAMED, 2)
    assert "../x" in bad[0]


@pytest.mark.parametrize(
    ("digest", "data", "code"),
    [
        (GOOD.sha256, b"other", "bad_hash"), ("../x", b"bytes", "bad_hash"), (GOOD.sha256.upper(), b"bytes", "bad_hash"),
        (GOOD.sha256, bytes(MOST_BYTES + 1), "too_large"),
    ],
)  # fmt: skip
def test_other_bytes_than_those_of_the_hash_are_refused(digest: str, data: bytes, code: str) -> None:
    with pytest.raises(FileError) as error:
        check_bytes(digest, data)
    assert str(error.value).partition(":")[0] == code
