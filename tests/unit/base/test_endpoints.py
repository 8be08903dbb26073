"""Which endpoints only this machine reaches, which are TLS, and at which a site may listen."""

import pytest

from formiga_bt.base.endpoints import is_local, is_tls, open_to_others


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
        ("quic/10.0.0.5:7447", False, True),
        ("tls/127.0.0.1:7447", True, True),
    ],
)
def test_who_reaches_an_endpoint(endpoint: str, local: bool, tls: bool) -> None:
    assert (is_local(endpoint), is_tls(endpoint)) == (local, tls)


@pytest.mark.parametrize(
    ("endpoint", "mode", "insecure", "may"),
    [
        ("tcp/127.0.0.1:7447", "real", False, True),
        ("tls/0.0.0.0:7447", "real", False, True),
        ("tcp/0.0.0.0:7447", "real", False, False),
        ("tcp/0.0.0.0:7447", "real", True, False),
        ("tcp/0.0.0.0:7447", "simulation", False, False),
        ("tcp/0.0.0.0:7447", "simulation", True, True),
    ],
)
def test_where_a_site_may_listen(endpoint: str, mode: str, insecure: bool, may: bool) -> None:
    why, help_ = open_to_others(endpoint, mode, insecure=insecure)
    assert (not why) == (not help_) == may
    assert ("insecure" in help_) == (not may and mode == "simulation")
