"""Which addresses news may be sent to: looked at for each connection, after the name was resolved.

A name that resolves to something else the next time, or a number in another form, comes past no check that reads the URL alone.
"""

import asyncio
import ipaddress
import socket
from typing import Final

Address = ipaddress.IPv4Address | ipaddress.IPv6Address

METADATA: Final = frozenset(
    ipaddress.ip_address(one) for one in ("100.100.100.200", "168.63.129.16", "fd00:ec2::254", "fd20:ce::254")
)
"""Where clouds tell machines their secrets, beside the link-local 169.254.169.254."""
NAT64: Final = ipaddress.ip_network("64:ff9b::/96")


CONNECT_S: Final = 5.0
"""So long one address is tried."""


class ForbiddenAddressError(OSError):
    """Nothing is sent there."""


def why_not(text: str, *, private: bool) -> str:
    """Return why nothing is sent to an address, or an empty text.

    Args:
        text: the address, as numbers.
        private: whether those of this machine and of private nets will do.
    """
    try:
        address = _inner(ipaddress.ip_address(text.partition("%")[0]))
    except ValueError:
        return "its address is none"
    if address.is_link_local or address in METADATA:
        return "its address is link-local, or one where a cloud keeps secrets"
    if address.is_multicast or address.is_unspecified or address == ipaddress.IPv4Address("255.255.255.255"):
        return "its address is not one machine's"
    if address.is_global or private:
        return ""
    return "its address is private, or of this machine: say private: true if that is meant"


def _inner(address: Address) -> Address:
    """Return the IPv4 address that an IPv6 one stands for, if it does."""
    if isinstance(address, ipaddress.IPv4Address):
        return address
    if address in NAT64:
        return ipaddress.IPv4Address(int(address) & 0xFFFF_FFFF)
    teredo = address.teredo
    return address.ipv4_mapped or address.sixtofour or (teredo[1] if teredo is not None else address)


async def allowed(host: str, port: int, *, private: bool) -> str:
    """Return the first address of a host that something may be sent to.

    Raises:
        OSError: there is none.
    """
    last = OSError()
    for *_, at in await asyncio.get_running_loop().getaddrinfo(host, port, type=socket.SOCK_STREAM):
        why = why_not(str(at[0]), private=private)
        if not why:
            return str(at[0])
        last = ForbiddenAddressError(why)
    raise last


async def connected(host: str, port: int, *, private: bool) -> socket.socket:
    """Return a connection to the first address of a host that takes one.

    Args:
        host: a name, or an address.
        port: of TCP.
        private: as of `why_not`.

    Raises:
        OSError: there is none, or nothing may be sent there.
    """
    loop = asyncio.get_running_loop()
    last = OSError()
    for family, kind, proto, _, at in await loop.getaddrinfo(host, port, type=socket.SOCK_STREAM):
        if why := why_not(str(at[0]), private=private):
            last = ForbiddenAddressError(why)
            continue
        sock = socket.socket(family, kind, proto)
        sock.setblocking(False)
        try:
            async with asyncio.timeout(CONNECT_S):
                await loop.sock_connect(sock, at)
        except OSError as error:  # a TimeoutError, too
            sock.close()
            last = error
        except BaseException:
            sock.close()
            raise
        else:
            return sock
    raise last
