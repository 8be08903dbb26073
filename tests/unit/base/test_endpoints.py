"""Which endpoints only this machine reaches, which are TLS, and at which a site may listen."""

import pytest

from formiga_bt.base.endpoints import check_connect, is_local, is_tls, open_to_others, reached_at
from formiga_bt.base.errors import TransportError


@pytest.mark.parametrize(
    ("endpoint", "local", "tls"),
    [
        ("tcp/127.0.0.1:7447", True, False),
        ("tcp/127.9.0.1:0", True, False),
        ("udp/localhost:7447", True, False),
        ("tcp/[::1]:7447", True, False),
        ("tcp/127.0.0.1:7447?prio=1-3#iface=eth0", True, False),
        ("unixsock-stream/run/door", True, False),
        ("tcp/0.0.0.0:7447", False, False),
        ("tcp/[::]:7447", False, False),
        ("tcp/10.0.0.5:7447", False, False),
        ("tcp/localhost.evil.example:7447", False, False),
        ("tcp/10.0.0.5:7447#a=127.0.0.1:1", False, False),
        ("tcp/127.0.0.1.nip.io:7447", False, False),
        ("ws/0.0.0.0:80", False, False),
        ("serial//dev/ttyS0", False, False),
        ("127.0.0.1:7447", False, False),
        ("", False, False),
        ("tls/0.0.0.0:7447#listen_certificate_file=a.pem", False, True),
        ("quic/10.0.0.5:7447", False, False),
        ("tls/127.0.0.1:7447", True, True),
    ],
)
def test_who_reaches_an_endpoint(endpoint: str, local: bool, tls: bool) -> None:
    assert (is_local(endpoint), is_tls(endpoint)) == (local, tls)


@pytest.mark.parametrize(
    ("endpoint", "mode", "insecure", "keys", "may"),
    [
        ("tcp/127.0.0.1:7447", "real", False, False, True),
        ("tls/0.0.0.0:7447", "real", False, True, True),
        ("tls/0.0.0.0:0", "real", False, True, False),
        ("tls/0.0.0.0:7447", "real", False, False, False),
        ("tls/127.0.0.1:7447", "simulation", True, False, False),
        ("tls/0.0.0.0:7447#enable_mtls=false", "simulation", False, True, False),
        ("tcp/127.0.0.1:7447", "simulation", False, True, False),
        ("tcp/0.0.0.0:7447", "simulation", True, True, False),
        ("tcp/0.0.0.0:7447", "real", False, False, False),
        ("tcp/0.0.0.0:7447", "real", True, False, False),
        ("tcp/0.0.0.0:7447", "simulation", False, False, False),
        ("tcp/0.0.0.0:7447", "simulation", True, False, True),
    ],
)
def test_where_a_site_may_listen(endpoint: str, mode: str, insecure: bool, keys: bool, may: bool) -> None:
    why, help_ = open_to_others(endpoint, mode, insecure=insecure, keys=keys)
    assert (not why) == (not help_) == may
    assert ("insecure" in help_) == (endpoint == "tcp/0.0.0.0:7447" and not may and mode == "simulation" and not keys)


@pytest.mark.parametrize(
    ("endpoint", "keys", "insecure", "may"),
    [
        ("tcp/127.0.0.1:7447", False, False, True),
        ("tcp/10.0.0.5:7447", False, False, False),
        ("tcp/10.0.0.5:7447", False, True, True),
        ("tcp/127.0.0.1:7447", True, False, False),
        ("tcp/10.0.0.5:7447", True, True, False),
        ("tls/10.0.0.5:7447", True, False, True),
        ("tls/10.0.0.5:7447", False, True, False),
    ],
)
def test_where_an_agent_connects(endpoint: str, keys: bool, insecure: bool, may: bool) -> None:
    if may:
        check_connect(endpoint, keys=keys, insecure=insecure)
        return
    with pytest.raises(TransportError) as error:
        check_connect(endpoint, keys=keys, insecure=insecure)
    assert error.value.help


def test_a_listener_everywhere_is_reached_on_this_machine() -> None:
    at = {
        "tls/0.0.0.0:1": "tls/127.0.0.1:1",
        "tls/[::]:1": "tls/[::1]:1",
        "tls/engine.example:1": "tls/engine.example:1",
    }
    assert {one: reached_at(one) for one in at} == at
    assert reached_at("unixsock-stream/run/door") == "unixsock-stream/run/door"
