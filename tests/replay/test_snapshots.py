"""A snapshot after any step is enough to go on, in another process and under another hash seed, byte for byte."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.replay.missions import MISSIONS, Recorded, record, replay, save

ROOT = Path(__file__).parents[2]


def run(*arguments: str, seed: str) -> subprocess.CompletedProcess[bytes]:
    env = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "tests.replay.missions", *arguments]
    return subprocess.run(command, env=env, cwd=ROOT, capture_output=True, check=False, timeout=300)


@pytest.fixture(scope="module")
def films() -> dict[str, tuple[list[Recorded], list[bytes]]]:
    return {name: record(name) for name in MISSIONS}


def test_the_missions_pass_through_what_must_be_restored(films: dict[str, tuple[list[Recorded], list[bytes]]]) -> None:
    text = b"".join(shot for _, shots in films.values() for shot in shots)
    for part in ("steps", "on_abort", "finally", "recover"):
        assert f'"section":"{part}"'.encode() in text, part
    kinds = (
        "sequence fallback switch call do ask wait pass timeout retry tidy live gather loop items with_agents request"
    )
    for memory in kinds.split():
        assert f'"mem":"{memory}"'.encode() in text, memory
    for detail in ('"halting":true', '"waiting":true', '"state":"canceling"', '"stopping":true', '"held":["take-over:'):
        assert detail.encode() in text, detail
    assert re.search(rb'"mem":"live"[^}]*"halting":true,"drain":\["Survey', text)
    assert re.search(rb'"releasing":\{"lwd', text)
    assert re.search(rb'"tidying":\[\{"id":"finally:Survey[^{}]*"state":"running"', text)
    assert re.search(rb'"tidying":\[\{"id":"finally:Survey[^{}]*"state":"waiting"', text)
    assert re.search(rb'"drain":\["[^]]*task:MoveTask-', text)
    for state in ("runs", "releases"):
        assert f'"mem":"with_agents","state":"{state}"'.encode() in text, state
    assert re.search(rb'"drain":\["[^]]*release:lwd', text)
    assert re.search(rb'"mem":"retry"[^}]*"failed":\["lwd', text)
    assert re.search(rb'"mem":"gather","states":"RR\."', text)
    for name in ("place", "fix", "drone"):
        assert f'"mem":"items","items":[{{"{name}":{{"'.encode() in text, name


@pytest.mark.parametrize("name", MISSIONS)
def test_every_snapshot_goes_on_to_the_same_steps_in_a_new_process(
    name: str, films: dict[str, tuple[list[Recorded], list[bytes]]], tmp_path: Path
) -> None:
    film = tmp_path / name
    film.write_bytes(save(*films[name]))
    done = run(str(film), seed="4711")
    assert done.returncode == 0, (done.stdout + done.stderr).decode()[-6000:]


def test_a_changed_record_is_noticed(films: dict[str, tuple[list[Recorded], list[bytes]]]) -> None:
    steps, shots = films["move_task"]
    changed = [*steps[:9], Recorded(steps[9].at, steps[9].given, steps[9].out + b" "), *steps[10:]]
    assert replay(changed, shots)


def test_two_hash_seeds_give_byte_equal_steps() -> None:
    one, other = run("--fly", seed="1"), run("--fly", seed="2")
    assert one.returncode == other.returncode == 0, (one.stderr + other.stderr).decode()
    assert one.stdout.count(b"\n") > 1000
    assert one.stdout == other.stdout
