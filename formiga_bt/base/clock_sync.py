"""Whether the kernel's clock is set by something (NTP, PTP, GPS), and how far it may be off, as the kernel itself says.

The standard library has no way to ask; the C library has, on Linux. Nothing is changed, and no rights are needed.
"""

import ctypes
from typing import Final

from msgspec import Struct

UNSYNCHRONISED: Final = 5
"""`TIME_ERROR` of `ntp_gettime(3)`."""


class ClockSync(Struct, frozen=True):
    """What the kernel says of its clock."""

    synchronised: bool
    most_off_s: float
    """It is off by this much at most; only of a synchronised clock it means something."""


class _NtpTime(ctypes.Structure):
    _fields_ = (
        ("sec", ctypes.c_long), ("usec", ctypes.c_long), ("maxerror", ctypes.c_long), ("esterror", ctypes.c_long),
        ("tai", ctypes.c_long), ("reserved", ctypes.c_long * 4),
    )  # fmt: skip


def clock_sync() -> ClockSync | None:
    """Return how the kernel's clock is; None: this system does not say."""
    ask = getattr(ctypes.CDLL(None), "ntp_gettimex", None)
    if ask is None:
        return None
    told = _NtpTime()
    state = ask(ctypes.byref(told))
    return ClockSync(state != UNSYNCHRONISED, told.maxerror / 1e6) if state >= 0 else None
