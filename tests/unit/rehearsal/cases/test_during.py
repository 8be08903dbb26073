"""Faults and orders in the course of a goal, whenever that begins; and what comes too late to matter."""

from pathlib import Path

import pytest

from formiga_bt.rehearsal.cases.judging import judge
from formiga_bt.rehearsal.cases.reading import LoadedCases, load_cases
from formiga_bt.rehearsal.cases.running import Came, play
from tests.golden import Wording

TASK = """\
formiga: 1
task: Mine
imports: [lib/flying.yaml]
params: {target: {type: place, default: camp}}
agents:
  drone: {type: lwd, near: "${target}"}
steps:
  - wait: 10 s
  - do: drone.TakeOff
  - do: drone.GoTo
    with: {to: "${above(target, 60 m)}"}
  - do: drone.GoTo
    with: {to: "${above(site.places.north_field, 60 m)}"}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
HOME = "end_state: {drone: at_port}"


def loaded(here: Path, case: str) -> LoadedCases:
    (here / "mine.yaml").write_text(TASK, encoding="utf-8")
    file = here / "mine.test.yaml"
    file.write_text(f"formiga_test: 1\ntask: mine.yaml\ncases:\n  - name: it\n{case}", encoding="utf-8")
    return load_cases(file)


def outcome(here: Path, case: str) -> tuple[Came, list[str]]:
    cases = loaded(here, case).cases
    assert cases is not None, [str(one) for one in loaded(here, case).diagnostics]
    came = play(cases, cases.cases[0])
    return came, [str(one) for one in judge(cases.cases[0], came)]


@pytest.mark.parametrize(
    ("faults", "expect"),
    [
        ("{during: drone.GoTo, at: 2 s, kind: kill, for: 4 s}", f"status: failed, {HOME}"),
        ("{during: drone.GoTo, nth: 2, kind: link_loss, for: 4 s}", HOME),
        ("{during: drone.TakeOff, at: 1 s, kind: freeze, agent: hwd_1}", HOME),
        ("{during: lwd_3.GoTo, kind: battery, charge: 90 %}", HOME),
    ],
)
def test_a_fault_befalls_who_does_the_goal(faults: str, expect: str, tmp_path: Path) -> None:
    came, differs = outcome(tmp_path, f"    faults: [{faults}]\n    expect: {{{expect}}}\n")

    assert differs == [], came


@pytest.mark.parametrize(
    ("order", "expect"),
    [
        ("{during: drone.GoTo, nth: 2, at: 1 s, abort: Mine}", f"status: canceled, code: aborted, {HOME}"),
        (
            "{during: drone.GoTo, order: hold, target: Mine}, {during: drone.GoTo, at: 60 s, order: continue, target: all}",
            f"max_time: 10 min, {HOME}",
        ),
    ],
)
def test_an_order_comes_in_the_course_of_a_goal(order: str, expect: str, tmp_path: Path) -> None:
    came, differs = outcome(tmp_path, f"    orders: [{order}]\n    expect: {{{expect}}}\n")

    assert differs == [], came
    assert sum(one.action == "GoTo" for one in came.sent) >= 1


def test_what_never_comes_or_comes_too_late_is_told(tmp_path: Path, wording: Wording) -> None:
    faults = "[{during: drone.GoTo, nth: 9, kind: kill, for: 1 s}, {at: 1 h, agent: lwd_1, kind: kill}]"
    differs = outcome(tmp_path, f"    faults: {faults}\n    expect: {{{HOME}}}\n")[1]

    wording("\n".join(differs).replace(str(tmp_path), ""))


@pytest.mark.parametrize(
    "fault",
    [
        "{during: drone.Goto, kind: kill}", "{during: drone.GoTo, nth: 0, kind: kill}", "{during: drone, kind: kill}",
        "{during: drone.GoTo, kind: kil}", "{during: drone.GoTo}", "{nth: 2, at: 3 s, agent: lwd_1, kind: kill}",
    ],
)  # fmt: skip
def test_what_is_wrong_is_told(fault: str, tmp_path: Path, wording: Wording) -> None:
    found = loaded(tmp_path, f"    faults: [{fault}]\n    expect: {{}}\n").diagnostics

    wording("\n".join(f"{one.mark.line}:{one.mark.col} {one.code} {one.message}; {one.help}" for one in found))


def test_within_is_answered_with_what_bounds_the_time(tmp_path: Path) -> None:
    for case in ("    within: 20 min\n    expect: {}\n", "    expect: {within: 20 min}\n"):
        (one,) = loaded(tmp_path, case).diagnostics
        assert "max_time: 20 min" in one.help
