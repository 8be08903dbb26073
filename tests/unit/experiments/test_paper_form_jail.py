"""Hostile programs in the paper's form do no harm: the kernel holds them, and the experiment goes on."""

import json
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

import experiments.e2_llm.paper_form.child as child_module
from experiments.e2_llm.fly import Scene, world_of
from experiments.e2_llm.paper_form.child import Child, GoneError, Limits, NoSandboxError, check_sandbox
from experiments.e2_llm.paper_form.flight import PaperFleet, TaskOverError, WrongCallError
from experiments.e2_llm.paper_form.fly import fly_program
from tests.golden import Wording

pytestmark = pytest.mark.network
WORLD = world_of()
ROOT = Path(__file__).parents[3]
LOCKED = """
import ctypes, json, mmap, os, resource, signal, socket, subprocess, sys, threading, time
sys.path.insert(0, {root!r})
from experiments.e2_llm.paper_form.inside.jail import lock_up
libc = ctypes.CDLL(None, use_errno=True)
def raw(*call):
    if libc.syscall(*call) == -1:
        raise OSError(ctypes.get_errno(), "refused")
    return "done"
lock_up(cpu_s=5, memory_mb=512, audit={audit})
try:
    found = repr({attempt})
except BaseException as error:
    found = type(error).__name__
print(json.dumps(found))
"""
"""All modules are at hand, no check of names: what is left is the jail."""


def attempt(text: str, *, audit: bool) -> str:
    code = LOCKED.format(root=str(ROOT), audit=audit, attempt=text)
    done = subprocess.run([sys.executable, "-I", "-S", "-B", "-c", code], capture_output=True, timeout=30, check=False)
    return str(json.loads(done.stdout)) if done.stdout else f"died: {done.returncode}"


KERNEL = [
    ("open('/etc/passwd').read()", "PermissionError"),
    ("open('/tmp/formiga-jail', 'w').write('x')", "PermissionError"),
    ("os.open('/dev/mem', os.O_RDWR)", "PermissionError"),
    ("os.listdir('/')", "PermissionError"),
    ("os.unlink('/tmp/formiga-jail')", "PermissionError"),
    ("os.chmod('/tmp', 0)", "PermissionError"),
    ("socket.socket()", "PermissionError"),
    ("subprocess.run(['true'])", "PermissionError"),
    ("os.fork()", "PermissionError"),
    ("os.execv('/bin/true', ['true'])", "PermissionError"),
    ("os.kill(os.getpid(), signal.SIGKILL)", "PermissionError"),
    ("os.pipe()", "PermissionError"),
    ("os.dup2(1, 5)", "PermissionError"),
    ("os.write(2, b'x')", "PermissionError"),
    ("resource.setrlimit(resource.RLIMIT_CPU, (9, 9))", "ValueError"),
    ("mmap.mmap(-1, 4096, prot=mmap.PROT_READ | mmap.PROT_EXEC)", "PermissionError"),
    ("libc.system(b'true') == 0", "False"),
    ("raw(101, 0, 0, 0, 0)", "PermissionError"),  # ptrace
    ("raw(319, b'x', 0)", "PermissionError"),  # memfd_create
    ("raw(425, 1, 0)", "PermissionError"),  # io_uring_setup
    ("raw(157, 22, 0, 0)", "PermissionError"),  # prctl: no other filter
    ("raw(56, 17, 0, 0, 0, 0)", "PermissionError"),  # clone without CLONE_THREAD
    ("raw(435, 0, 0)", "OSError"),  # clone3: there is none
]
"""Numbers of system calls are those of x86_64."""


@pytest.mark.parametrize(("text", "found"), KERNEL, ids=[row[0][:40] for row in KERNEL])
def test_the_kernel_refuses(text: str, found: str) -> None:
    assert attempt(text, audit=False) == found


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("time.sleep(0.01)", "None"),
        ("[one.start() or one.join() for one in [threading.Thread(target=int)]]", "[None]"),
        ("len(bytearray(50 << 20))", str(50 << 20)),
    ],
)
def test_the_kernel_leaves_what_programs_need(text: str, found: str) -> None:
    assert attempt(text, audit=True) == found


@pytest.mark.parametrize("text", ["open('/etc/passwd')", "__import__('wave')", "os.system('true')", "socket.socket()"])
def test_the_audit_hook_refuses_too(text: str) -> None:
    assert attempt(text, audit=True) == "PermissionError"


def test_what_no_wall_stops_ends_the_process_and_nothing_else() -> None:
    assert attempt("os._exit(3)", audit=True) == "died: 3"
    assert attempt("os.abort()", audit=True).startswith("died: -")
    assert attempt("bytearray(5 << 30)", audit=True) == "MemoryError"


PROGRAMS = [
    ("open('/etc/passwd')", "REFUSED check", "there is no open"),
    ("import os\nos._exit(0)", "REFUSED check", "there is no module os"),
    ("__import__('os')", "REFUSED check", "__import__ is not for tasks"),
    ("().__class__.__base__.__subclasses__()", "REFUSED check", ".__class__ is not for tasks"),
    ("(x for x in []).gi_frame", "REFUSED check", ".gi_frame is not for tasks"),
    ("try:\n    1 / 0\nexcept Exception as e:\n    e.__traceback__", "REFUSED check", ".__traceback__ is not for tasks"),
    ("getattr((), '__cla' + 'ss__')", "FAILED exception", "names with __ are not for tasks"),
    ("class S(str):\n    def startswith(self, *a):\n        return False\ngetattr((), S('__class__'))", "FAILED exception",
     "names with __ are not for tasks"),
    ("'{0.__class__.__base__}'.format(())", "SUCCEEDED ", ""),  # a text, no more
    ("threading.Thread._t.__init__.x", "FAILED exception", "AttributeError"),
    ("def f():\n    f()\nf()", "FAILED exception", "RecursionError"),
    ("x = 'a' * 10**10", "FAILED exception", "MemoryError"),
    ("x = [[]]\nfor one in x:\n    x.append([0] * 1000000)", "FAILED ", ""),
    ("10 ** 10 ** 8 % 7", "FAILED program_died", "ended by signal"),
    ("for i in range(99):\n    threading.Thread(target=time.sleep, args=(9,)).start()", "FAILED exception",
     "more than 32 threads"),
    ("while True:\n    find_landing_port('lwd_1')", "UNFINISHED too_many_calls", "more than 2000 calls"),
    ("find_landing_port('x' * 100000)", "FAILED program_died", "it said a line "),
    ("select_robot(None, Cartesian_Coordinates(1e300, 0, 0), ['lwd'])", "FAILED exception", "1e+300 is too far away"),
    ("while True:\n    try:\n        time.sleep(900)\n    except:\n        pass", "UNFINISHED too_long", "2 h"),
    ("action_client('watcher', 'watcher_1', 'Confirm', True, task)", "FAILED exception", "there is no action server"),
]  # fmt: skip


@pytest.mark.parametrize(("code", "status", "text"), PROGRAMS, ids=[row[0][:40] for row in PROGRAMS])
def test_hostile_programs_end_as_faults(code: str, status: str, text: str) -> None:
    flown = fly_program(code, WORLD, limits=Limits(cpu_s=1, wall_s=20.0, memory_mb=256, calls=2000))

    assert f"{flown.status} {flown.code}".startswith(status), flown.reason
    assert text in flown.reason
    assert flown.movers() == ()


def test_wall_time_is_bounded_whatever_the_process_does(wording: Wording) -> None:
    flown = fly_program("for one in iter(int, 1):\n    pass", WORLD, limits=Limits(wall_s=0.7))

    assert (flown.status, flown.code) == ("UNFINISHED", "too_long")
    wording(flown.reason)


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("print('no json')", "it said what is no JSON"),
        ("print('[1]')", "it said what is no question"),
        ("print('[' * 50000)", "it said what is no JSON"),
        ("import sys; sys.stdout.write('x' * 200000)", "it said a line without an end"),
        ("pass", "the program's process ended (0)"),
    ],
)
def test_what_is_no_question_ends_the_program(
    line: str, text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "child.py").write_text(line)
    monkeypatch.setattr(child_module, "_MAIN", tmp_path / "child.py")

    with pytest.raises(GoneError) as caught, Child("", Limits(wall_s=20.0)) as child:
        child.hear()

    assert str(caught.value) == text


def test_questions_of_no_sense_are_told_so() -> None:
    fleet = PaperFleet(WORLD, Scene())
    strange = [
        None,
        True,
        -1,
        1e308,
        float("nan"),
        "x",
        [],
        [1],
        {},
        {"x": 1},
        [[[]]],
        10**400,
        [10**400] * 3,
        "lwd_1",
        "GoTo",
    ]
    for do in ("select", "goal", "wait", "cartesian", "port", "base", "none", None):
        for value in strange:
            question = dict.fromkeys(("preference", "near", "name", "type", "given", "gps", "until_s"), value)
            for action in ("GoTo", "Explore", "LandIn"):
                named = {"do": do, "types": value, "action": action, "type": "lwd", "name": "lwd_1"}
                with suppress(WrongCallError, TaskOverError):
                    assert isinstance(fleet.answer({**question, **named}), dict)
    fleet.close()


def test_without_a_filter_of_system_calls_nothing_is_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    main = (ROOT / "experiments/e2_llm/paper_form/inside/child.py").read_text()
    root = f"sys.path.insert(0, {str(ROOT)!r})\nimport platform\nplatform.machine = lambda: 'vax'\n"
    (tmp_path / "child.py").write_text(
        main.replace("sys.path.insert(0, str(Path(__file__).resolve().parents[4]))", root)
    )
    monkeypatch.setattr(child_module, "_MAIN", tmp_path / "child.py")

    with pytest.raises(NoSandboxError) as caught:
        check_sandbox()

    wording(str(caught.value))
