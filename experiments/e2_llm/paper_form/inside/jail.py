"""The walls around generated code: limits of the kernel, a filter of system calls, and an audit hook.

The filter (seccomp) is the wall: after it the process can read its standard input, write its standard output, have memory and
threads, and end. It can open no file, make no socket, start no process, send no signal. The audit hook and the short list of
builtins only make errors readable: they are no jail. Where there is no such filter, nothing is run.
"""

import ctypes
import platform
import resource
import sys
from typing import Any, Final

_LOAD, _EQUAL, _ANY_BIT, _RETURN = 0x20, 0x15, 0x45, 0x06
_ALLOW, _KILL, _ERRNO = 0x7FFF0000, 0x80000000, 0x00050000
_EPERM, _ENOSYS = 1, 38
_NUMBER, _ARCH, _ARG0, _ARG2 = 0, 4, 16, 32
_CLONE_THREAD, _PROT_EXEC = 0x00010000, 4
_NO_NEW_PRIVS, _SET_SECCOMP, _DEATH_SIGNAL, _FILTER, _SIGKILL = 38, 22, 1, 2, 9

_PLAIN: Final = (
    "close", "fstat", "lseek", "munmap", "brk", "rt_sigaction", "rt_sigprocmask", "rt_sigreturn", "sched_yield", "mremap",
    "madvise", "nanosleep", "getpid", "exit", "futex", "exit_group", "clock_gettime", "clock_nanosleep", "set_robust_list",
    "rseq", "getrandom", "gettid", "sigaltstack", "restart_syscall",
)  # fmt: skip
_NUMBERS: Final[dict[str, tuple[int, dict[str, int]]]] = {
    "x86_64": (0xC000003E, {
        "read": 0, "write": 1, "close": 3, "fstat": 5, "lseek": 8, "mmap": 9, "mprotect": 10, "munmap": 11, "brk": 12,
        "rt_sigaction": 13, "rt_sigprocmask": 14, "rt_sigreturn": 15, "sched_yield": 24, "mremap": 25, "madvise": 28,
        "nanosleep": 35, "getpid": 39, "clone": 56, "exit": 60, "sigaltstack": 131, "gettid": 186, "futex": 202,
        "restart_syscall": 219, "clock_gettime": 228, "clock_nanosleep": 230, "exit_group": 231, "set_robust_list": 273,
        "getrandom": 318, "rseq": 334, "clone3": 435,
    }),
    "aarch64": (0xC00000B7, {
        "close": 57, "lseek": 62, "read": 63, "write": 64, "fstat": 80, "exit": 93, "exit_group": 94, "futex": 98,
        "set_robust_list": 99, "nanosleep": 101, "clock_gettime": 113, "clock_nanosleep": 115, "sched_yield": 124,
        "restart_syscall": 128, "sigaltstack": 132, "rt_sigaction": 134, "rt_sigprocmask": 135, "rt_sigreturn": 139,
        "getpid": 172, "gettid": 178, "brk": 214, "munmap": 215, "mremap": 216, "clone": 220, "mmap": 222, "mprotect": 226,
        "madvise": 233, "getrandom": 278, "rseq": 293, "clone3": 435,
    }),
}  # fmt: skip
_FORBIDDEN_EVENTS: Final = (
    "open", "os.", "socket.", "subprocess.", "ctypes.", "shutil.", "import", "gc.", "pty.", "fcntl.", "mmap.", "cpython.run_",
    "marshal.", "pickle.", "signal.", "sys.addaudithook", "tempfile.", "glob.", "pathlib.", "urllib.",
)  # fmt: skip


class NoJailError(Exception):
    """The walls cannot be put up here."""


class _Line(ctypes.Structure):
    _fields_ = (("code", ctypes.c_ushort), ("yes", ctypes.c_ubyte), ("no", ctypes.c_ubyte), ("k", ctypes.c_uint32))


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("lines", ctypes.POINTER(_Line)))


def lock_up(*, cpu_s: int, memory_mb: int, audit: bool = True) -> None:
    """Put up all walls around this process, for ever; without `audit` only those of the kernel.

    Raises:
        NoJailError: one of them cannot be put up.
    """
    _limit(cpu_s, memory_mb)
    _filter_calls()
    try:
        open("/proc/self/status", "rb").close()
    except OSError:
        if audit:
            sys.addaudithook(_refuse)
        return
    raise NoJailError("the filter of system calls does not hold: a file could be opened")


def _limit(cpu_s: int, memory_mb: int) -> None:
    for what, most in (
        (resource.RLIMIT_CPU, cpu_s),
        (resource.RLIMIT_AS, memory_mb << 20),
        (resource.RLIMIT_FSIZE, 0),
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_NOFILE, 3),
    ):
        resource.setrlimit(what, (most, most))
    resource.setrlimit(resource.RLIMIT_NPROC, (64, 64))


def _filter_calls() -> None:
    known = _NUMBERS.get(platform.machine()) if sys.platform == "linux" else None
    if known is None:
        raise NoJailError(f"generated programs run on Linux with x86_64 or aarch64 only, not on {platform.machine()}")
    lines = _lines(*known)
    array = (_Line * len(lines))(*(_Line(*one) for one in lines))
    program = _Program(len(lines), array)
    prctl = ctypes.CDLL(None, use_errno=True).prctl
    prctl(_DEATH_SIGNAL, _SIGKILL, 0, 0, 0)
    if prctl(_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 or prctl(_SET_SECCOMP, _FILTER, ctypes.byref(program), 0, 0) != 0:
        raise NoJailError(f"this kernel takes no filter of system calls (seccomp): error {ctypes.get_errno()}")


def _lines(arch: int, of: dict[str, int]) -> list[tuple[int, int, int, int]]:
    """Return the filter: what is not named fails with EPERM; a call of another architecture kills."""
    allow, deny = (_RETURN, 0, 0, _ALLOW), (_RETURN, 0, 0, _ERRNO | _EPERM)
    found = [(_LOAD, 0, 0, _ARCH), (_EQUAL, 1, 0, arch), (_RETURN, 0, 0, _KILL), (_LOAD, 0, 0, _NUMBER)]
    for name in _PLAIN:
        found += [(_EQUAL, 0, 1, of[name]), allow]
    found += [
        (_EQUAL, 0, 1, of["clone3"]),
        (_RETURN, 0, 0, _ERRNO | _ENOSYS),
    ]  # so that clone is tried, whose flags show
    for name, argument, test, value, fits in (
        ("read", _ARG0, _EQUAL, 0, True),
        ("write", _ARG0, _EQUAL, 1, True),
        ("clone", _ARG0, _ANY_BIT, _CLONE_THREAD, True),
        ("mmap", _ARG2, _ANY_BIT, _PROT_EXEC, False),
        ("mprotect", _ARG2, _ANY_BIT, _PROT_EXEC, False),
    ):
        yes, no = (allow, deny) if fits else (deny, allow)
        found += [(_EQUAL, 0, 4, of[name]), (_LOAD, 0, 0, argument), (test, 0, 1, value), yes, no]
    return [*found, deny]


def _refuse(event: str, _given: Any) -> None:
    if event.startswith(_FORBIDDEN_EVENTS):
        raise PermissionError(f"{event} is not for generated programs")
