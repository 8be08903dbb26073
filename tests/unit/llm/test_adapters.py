"""What an adapter's file says of itself, and which adapter ships for which model."""

import struct
from collections.abc import Mapping
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from formiga_bt.llm import adapters
from formiga_bt.llm.errors import UnusableModel
from formiga_bt.llm.models import OnDisk
from tests.golden import Wording


def text(said: str) -> bytes:
    return struct.pack("<Q", len(said.encode())) + said.encode()


def gguf(about: Mapping[str, str | float | list[str]]) -> bytes:
    """Return the head of a GGUF file."""
    found = b"GGUF" + struct.pack("<IQQ", 3, 0, len(about))
    for key, value in about.items():
        found += text(key)
        if isinstance(value, str):
            found += struct.pack("<I", 8) + text(value)
        elif isinstance(value, float):
            found += struct.pack("<If", 6, value)
        else:
            found += struct.pack("<IIQ", 9, 8, len(value)) + b"".join(map(text, value))
    return found


def test_texts_are_read_whatever_stands_between_them(tmp_path: Path) -> None:
    path = tmp_path / "a.gguf"
    path.write_bytes(gguf({"a": "one", "alpha": 2.0, "words": ["x", "yy"], "formiga.prompt": "brief-1"}) + b"tensors")

    assert adapters.about(path) == {"a": "one", "formiga.prompt": "brief-1"}


@given(st.binary(max_size=60))
def test_any_other_file_is_refused_in_words(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "any.gguf"
    for head in (data, b"GGUF" + data, gguf({"a": "one"})[:-2] + data):
        path.write_bytes(head)
        try:
            assert isinstance(adapters.about(path), dict)
        except UnusableModel as error:
            assert "is no GGUF file" in str(error)  # noqa: PT017


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(UnusableModel, match="No such file"):
        adapters.about(tmp_path / "nowhere.gguf")


def test_an_adapter_is_used_with_the_very_file_it_was_made_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(adapters, "FOLDER", tmp_path)
    (tmp_path / "tiny.gguf").write_bytes(gguf({"formiga.base_sha256": "abc"}))

    def of(sha256: str, name: str = "tiny") -> Path | None:
        return adapters.shipped(OnDisk(name=name, file=tmp_path / "model.gguf", size=1, sha256=sha256))

    assert of("abc") == tmp_path / "tiny.gguf"
    assert of("def") is None
    assert of("abc", "other") is None


def test_a_package_with_the_card_alone_says_how_to_get_the_adapter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr(adapters, "FOLDER", tmp_path)
    (tmp_path / "tiny.md").write_text("# a card")
    wording(adapters.absent("tiny"))
    assert adapters.absent("other") == ""
    (tmp_path / "tiny.gguf").write_bytes(b"GGUF")
    assert adapters.absent("tiny") == ""
