"""News go to no address that only looks like another machine's: clouds' secrets, this machine, private nets."""

import pytest

from formiga_bt.services.news.addresses import why_not

NEVER = (
    "169.254.169.254", "169.254.1.1", "fe80::1", "fe80::1%eth0", "fd00:ec2::254", "100.100.100.200", "168.63.129.16",
    "::ffff:169.254.169.254", "64:ff9b::a9fe:a9fe", "2002:a9fe:a9fe::1", "0.0.0.0", "::", "224.0.0.1", "ff02::1",
    "255.255.255.255", "no number", "",
)  # fmt: skip
PRIVATE = ("127.0.0.1", "::1", "10.1.2.3", "192.168.0.9", "172.16.0.1", "fd12::1", "100.64.0.1", "::ffff:127.0.0.1",
           "64:ff9b::7f00:1", "2002:7f00:1::1", "240.0.0.1")  # fmt: skip
PUBLIC = ("93.184.215.14", "2606:2800:21f:cb07:6820:80da:af6b:8b2c", "8.8.8.8")


@pytest.mark.parametrize("address", NEVER)
def test_never(address: str) -> None:
    assert why_not(address, private=False)
    assert why_not(address, private=True)


@pytest.mark.parametrize("address", PRIVATE)
def test_only_where_the_site_says_so(address: str) -> None:
    assert why_not(address, private=False)
    assert not why_not(address, private=True)


@pytest.mark.parametrize("address", PUBLIC)
def test_to_other_machines(address: str) -> None:
    assert not why_not(address, private=False)
