"""Who may call: this machine without a token, no web pages, nobody else without the token."""

from collections.abc import Callable
from http.client import HTTPConnection
from pathlib import Path

import pytest

from formiga_bt.base.endpoints import is_loopback
from formiga_bt.base.errors import SiteError
from formiga_bt.client.calls import LocalConnection
from formiga_bt.services.http import server
from tests.golden import Wording
from tests.unit.services.conftest import Service, Start, make_real

pytestmark = pytest.mark.network


def status(service: Service, **headers: str) -> int:
    given = {name.replace("_", "-"): value for name, value in headers.items()}
    return service.call("POST", "/v1/admin/nothing", {}, given)[0]


@pytest.mark.parametrize(
    ("headers", "expected"),
    [
        ({}, 404),
        ({"Origin": "https://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Sec_Fetch_Site": "cross-site"}, 403),
        ({"Sec_Fetch_Site": "same-site"}, 403),
        ({"Sec_Fetch_Site": "same-origin"}, 404),
        ({"Host": "evil.example:8420"}, 403),
        ({"Host": "localhost:8420"}, 404),
        ({"Host": "127.0.0.1.evil.example"}, 403),
        ({"Authorization": "Bearer wrong"}, 401),
    ],
)
def test_pages_of_other_origins_are_kept_out(service: Service, headers: dict[str, str], expected: int) -> None:
    assert status(service, **headers) == expected


def test_our_own_origin_may_call(service: Service) -> None:
    assert status(service, Origin=service.url) == 404


def test_the_token_is_asked_for_where_it_is_wanted(start: Start, tmp_path: Path) -> None:
    with start() as service:
        pass
    token_file = tmp_path / ".formiga" / "meadow" / "token"
    token = token_file.read_text().strip()
    assert token_file.stat().st_mode & 0o077 == 0
    assert status_of_a_wanting_engine(start, f"Bearer {token}") == [401, 401, 404]
    assert service.host.runtime_folder == token_file.parent


def status_of_a_wanting_engine(start: Start, word: str) -> list[int]:
    from formiga_bt.services.http import api

    with start() as service:
        asked = api.guarded(api.application(service.host), token=word.split()[1], needs_token=True)
        sock = server.listen("127.0.0.1:0")
        wanting = server.HttpServer(asked, sock)
        wanting.start()
        try:
            found = []
            for headers in ({}, {"Authorization": "Basic x"}, {"Authorization": word}):
                connection = HTTPConnection(*sock.getsockname()[:2], timeout=5)
                connection.request("GET", "/v1/nothing", headers=headers)
                found.append(connection.getresponse().status)
                connection.close()
            return found
        finally:
            wanting.stop()


def test_in_mode_real_every_door_wants_the_token_but_for_stops_at_the_local_one(tmp_path: Path, start: Start) -> None:
    """Any process of the machine could approve and fly on a real site, by HTTP on the loopback."""
    make_real(tmp_path)
    with start() as service:
        token = service.headers.pop("Authorization")
        folder, port = service.host.runtime_folder, int(service.url.rpartition(":")[2])
        doors: list[Callable[[], HTTPConnection]] = [
            lambda: HTTPConnection("127.0.0.1", port, timeout=5),
            lambda: LocalConnection(str(folder / "door")),
        ]
        found = []
        for door in doors:
            for method, path, body in ASKED:
                for word in ("", "Bearer wrong", token):
                    connection = door()
                    headers = {"Content-Type": "application/json"} | ({"Authorization": word} if word else {})
                    connection.request(method, path, body, headers)
                    found.append(connection.getresponse().status)
                    connection.close()
    stop, other = [200, 401, 200], [401, 401, 200]
    assert found == [*other * len(ASKED), *other * (len(ASKED) - 1), *stop]


ASKED = (
    ("GET", "/v1/agents", None),
    ("GET", "/v1/openapi.json", None),
    ("GET", "/v1/pilots", None),
    ("POST", "/v1/orders", b'{"order": "land"}'),
)


@pytest.mark.parametrize(
    ("host", "own"),
    [("127.0.0.1", True), ("[::1]", True), ("localhost", True), ("127.0.0.1.x", False), ("10.0.0.1", False)],
)
def test_what_the_loopback_is(host: str, own: bool) -> None:
    assert is_loopback(host) is own


@pytest.mark.parametrize("text", ["8420", "127.0.0.1", "127.0.0.1:x", ":80", "127.0.0.1:70000"])
def test_an_address_is_host_and_port(text: str) -> None:
    with pytest.raises(SiteError, match="is not HOST:PORT"):
        server.read_address(text)


def test_a_taken_port_is_told_at_once(service: Service, wording: Wording) -> None:
    with pytest.raises(SiteError) as refused:
        server.listen(service.url.removeprefix("http://"))
    wording(refused.value)
