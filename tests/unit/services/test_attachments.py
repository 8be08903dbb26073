"""Bytes of attachments: kept by their hash, forgotten in time, served so that no browser runs them."""

import json
from hashlib import sha256
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest

from formiga_bt.services.http.file_routes import headers
from formiga_bt.services.kept.attachments import AttachmentStore
from formiga_bt.transport.attachments import MOST_BYTES, FileError
from tests.unit.services.conftest import Service

PHOTO = b"\xff\xd8 a photo"
HASH = sha256(PHOTO).hexdigest()


def digest(data: bytes) -> str:
    return sha256(data).hexdigest()


def test_bytes_are_kept_once_and_given_back(tmp_path: Path) -> None:
    store = AttachmentStore(tmp_path)
    assert (store.get(HASH), store.has(HASH)) == (None, False)
    store.put(HASH, PHOTO)
    store.put(HASH, PHOTO)
    assert (store.get(HASH), store.has(HASH)) == (PHOTO, True)
    assert [one.name for one in (tmp_path / "attachments").iterdir()] == [HASH]
    assert oct((tmp_path / "attachments" / HASH).stat().st_mode & 0o777) == "0o600"


def test_a_wrong_hash_keeps_nothing_and_says_both(tmp_path: Path) -> None:
    store = AttachmentStore(tmp_path)
    with pytest.raises(FileError) as error:
        store.put(HASH, b"other")
    assert HASH in str(error.value)
    assert digest(b"other") in str(error.value)
    assert not store.has(HASH)


@pytest.mark.parametrize("name", ["../token", "", "a" * 63, "A" * 64, f"{HASH}/.."])
def test_no_hash_is_a_path(tmp_path: Path, name: str) -> None:
    (tmp_path / "token").write_text("secret")
    store = AttachmentStore(tmp_path)
    assert (store.get(name), store.has(name)) == (None, False)


def test_bytes_that_changed_on_the_disk_are_not_served(tmp_path: Path) -> None:
    store = AttachmentStore(tmp_path)
    store.put(HASH, PHOTO)
    (tmp_path / "attachments" / HASH).write_bytes(b"rot")
    assert store.get(HASH) is None


def test_the_oldest_go_when_there_is_too_much_or_in_time(tmp_path: Path) -> None:
    clock = [0.0]
    store = AttachmentStore(tmp_path, most=10, kept_s=100.0, now=lambda: clock[0])
    for n in range(4):
        clock[0] += 1.0
        store.put(digest(b"%d 4" % n), b"%d 4" % n)
    assert [store.has(digest(b"%d 4" % n)) for n in range(4)] == [False, True, True, True]
    clock[0] += 200.0
    store.put(digest(b"new"), b"new")
    assert [path.name for path in (tmp_path / "attachments").iterdir()] == [digest(b"new")]


def test_a_file_where_the_folder_should_be_is_an_error_of_the_one_file(tmp_path: Path) -> None:
    (tmp_path / "attachments").write_text("no folder")
    with pytest.raises(FileError, match="not_kept"):
        AttachmentStore(tmp_path).put(HASH, PHOTO)


@pytest.mark.parametrize(
    ("name", "kind", "served", "how"),
    [
        ("roof.jpg", "image/jpeg", "image/jpeg", "inline"),
        ("page.html", "text/html", "application/octet-stream", "attachment"),
        ("p.svg", "image/svg+xml", "application/octet-stream", "attachment"),
        ("log.txt", "text/plain", "text/plain; charset=utf-8", "attachment"),
        ('a";\r\nX: y', "text/plain\r\nX: y", "application/octet-stream", "attachment"),
    ],
)
def test_nothing_is_served_as_what_a_browser_runs(name: str, kind: str, served: str, how: str) -> None:
    found = headers(name, kind)
    assert (found["Content-Type"], found["X-Content-Type-Options"]) == (served, "nosniff")
    assert found["Content-Disposition"].startswith(f"{how};")
    assert "sandbox" in found["Content-Security-Policy"]
    assert not any(one in value for value in found.values() for one in "\r\n")
    assert found["Content-Disposition"].count('"') == 2


def put(service: Service, name: str, data: bytes) -> tuple[int, dict[str, object]]:
    request = Request(
        f"{service.url}/v1/attachments/{name}", data, method="PUT", headers={"Content-Type": "image/jpeg"}
    )
    try:
        with urlopen(request, timeout=10) as answer:
            return answer.status, json.loads(answer.read())
    except HTTPError as error:
        return error.code, json.loads(error.read())


@pytest.mark.network
def test_bytes_pass_the_api_and_come_back(service: Service) -> None:
    large = bytes(3_000_000)
    assert put(service, HASH, PHOTO)[0] == 201
    assert put(service, digest(large), large) == (201, {"sha256": digest(large), "size": 3_000_000})
    with urlopen(f"{service.url}/v1/attachments/{HASH}?name=roof.jpg&media_type=image/jpeg", timeout=10) as answer:
        assert (answer.read(), answer.headers["Content-Type"]) == (PHOTO, "image/jpeg")
    assert service.host.attachments.get(HASH) == PHOTO


@pytest.mark.network
@pytest.mark.parametrize(
    ("name", "data", "status", "code"),
    [
        (HASH, b"other", 422, "bad_hash"),
        ("nonsense", PHOTO, 422, "bad_hash"),
        (HASH, bytes(MOST_BYTES + 1), 413, "too_large"),
    ],
)
def test_bytes_that_are_not_taken_say_why_and_the_engine_goes_on(
    service: Service, name: str, data: bytes, status: int, code: str
) -> None:
    found = put(service, name, data)
    assert (found[0], found[1]["code"]) == (status, code)
    assert service.refused("GET", f"/v1/attachments/{HASH}")["code"] == "no_attachment"
    assert service.get("/v1/health")["status"] == "ok"
