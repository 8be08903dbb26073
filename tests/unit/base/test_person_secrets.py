"""Secrets of people as they are kept: hashes with a salt, a file that is its owner's alone, and no way in by a broken one."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.base.durable import PRIVATE_FILE
from formiga_bt.base.errors import FormigaError, SiteError, TaskError
from formiga_bt.base.person_secrets import (
    LEAST_N,
    SECRETS,
    find_secret,
    hashed,
    prepared,
    read_secrets,
    set_unusable_aside,
    write_secret,
)
from formiga_bt.base.private_files import changing
from tests.golden import Wording

SECRET = "a long one, with ä"
CHEAP = (LEAST_N, 8, 1)


def test_only_a_salted_hash_is_kept_in_a_file_of_its_owners(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        with changing(tmp_path):
            write_secret(tmp_path, "ann", hashed(SECRET))
            write_secret(tmp_path, "bob", hashed(SECRET, CHEAP))
    finally:
        os.umask(before)
    file = tmp_path / SECRETS
    assert file.stat().st_mode & 0o777 == PRIVATE_FILE
    assert SECRET not in file.read_text(encoding="utf-8")
    found = read_secrets(tmp_path)
    assert [one.fits(SECRET) for one in found.values()] == [True, True]
    assert [one.fits(SECRET + " ") for one in found.values()] == [False, False]
    assert (found["ann"].n, found["bob"].n) == (2**15, LEAST_N)
    assert found["ann"].salt != found["bob"].salt
    assert found["ann"].hash not in repr(found)


def test_how_it_was_typed_does_not_matter_what_it_says_does(tmp_path: Path) -> None:
    one = hashed(prepared("a long one, with a\u0308"), CHEAP)
    assert one.fits("a long one, with \u00e4")
    assert not one.fits("")
    assert not one.fits(SECRET * 1000)
    assert not one.fits("\udcff" * 20)


@pytest.mark.parametrize(
    "secret", ["", "short", "x" * 11, "x" * 201, " twelve letters", "twelve\nletters", "twelve\x00letters"]
)
def test_what_is_no_secret_is_refused_and_not_repeated(secret: str) -> None:
    with pytest.raises(FormigaError) as refused:
        prepared(secret)
    assert not secret or secret not in str(refused.value)


def change(**what: Any) -> Callable[[dict[str, Any]], Any]:
    def changed(said: dict[str, Any]) -> Any:
        said["people"]["ann"].update(what)
        return said

    return changed


BROKEN: list[Callable[[dict[str, Any]], Any]] = [
    lambda said: [said],
    lambda said: {},
    lambda said: {"people": [said["people"]]},
    lambda said: {"people": {"ann": "x"}},
    lambda said: {"people": {"ann": {**said["people"]["ann"], "more": 1}}},
    change(n=2), change(n=2**30), change(n=LEAST_N + 1), change(n=True), change(n="16384"), change(n=float(LEAST_N)),
    change(r=0), change(r=10**6), change(p=-1), change(p=10**9), change(kdf="md5"),
    change(salt=""), change(salt="zz"), change(salt=7), change(hash=""), change(hash="ab"), change(hash=None),
]  # fmt: skip


@pytest.mark.parametrize("broken", BROKEN)
def test_a_file_that_cannot_be_used_lets_nobody_in(
    tmp_path: Path, broken: Callable[[dict[str, Any]], Any], wording: Wording
) -> None:
    write_secret(tmp_path, "ann", hashed(SECRET, CHEAP))
    file = tmp_path / SECRETS
    file.write_text(json.dumps(broken(json.loads(file.read_text()))))
    with pytest.raises(SiteError) as refused:
        find_secret(tmp_path, "ann", SECRET)
    wording(refused.value)
    with pytest.raises(SiteError):
        write_secret(tmp_path, "bob", hashed(SECRET, CHEAP))
    aside = set_unusable_aside(tmp_path)
    assert aside is not None
    assert (aside / SECRETS).exists()
    assert read_secrets(tmp_path) == {}


@pytest.mark.parametrize("kind", ["text", "bytes", "folder", "pipe", "nowhere", "large"])
def test_whatever_stands_there_is_read_without_waiting(tmp_path: Path, kind: str) -> None:
    file = tmp_path / SECRETS
    match kind:
        case "text":
            file.write_text('{"people": {')
        case "bytes":
            file.write_bytes(b"\xff\x00")
        case "folder":
            file.mkdir()
        case "pipe":
            os.mkfifo(file)
        case "nowhere":
            file.symlink_to(tmp_path / "nowhere")
        case _:
            file.write_text(" " * 1_000_001)
    with pytest.raises(SiteError):
        read_secrets(tmp_path)


def test_what_is_missing_is_said(tmp_path: Path, wording: Wording) -> None:
    assert read_secrets(tmp_path) == {}
    assert set_unusable_aside(tmp_path) is None
    with pytest.raises(TaskError) as unset:
        find_secret(tmp_path, "ann", SECRET)
    wording(unset.value)
    write_secret(tmp_path, "ann", hashed(SECRET, CHEAP))
    with pytest.raises(TaskError) as unsaid:
        find_secret(tmp_path, "ann", "")
    wording(unsaid.value)
    assert unset.value.code == unsaid.value.code == "secret_missing"
