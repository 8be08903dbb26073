"""The state of flight: which tasks are refused because a machine is, or may be, on the wrong side of the ground."""

from collections.abc import Callable

import pytest

from formiga_bt.lang.loader import Loaded

Load = Callable[[str], Loaded]

UP = "do: drone.TakeOff"
DOWN = 'do: drone.LandIn\n{0}  with: {{at: "${{base}}"}}'
GO = 'do: drone.GoTo\n{0}  with: {{to: "${{above(base, 60 m)}}"}}'


def steps(*lines: str, indent: int = 2) -> str:
    pad = " " * indent
    return "".join(f"{pad}- {line.format(pad)}\n" for line in lines)


def codes(load: Load, body: str, role: str = "{type: hwd}") -> list[str]:
    loaded = load(f"agents:\n  drone: {role}\nsteps:\n{body}")
    return [d.code for d in loaded.diagnostics]


GOOD = {
    "up, across, down": steps(UP, GO, DOWN),
    "up and down twice": steps(UP, DOWN, UP, DOWN),
    "a branch that lands in both cases": steps(UP)
    + "  - if: drone.battery > 30 %\n    then:\n"
    + steps(GO, DOWN, indent=6)
    + "    else:\n"
    + steps(DOWN, indent=6),
    "narrowed by when": steps(
        "do: drone.TakeOff\n{0}  when: drone.battery > 30 %", DOWN + "\n{0}  when: drone.airborne"
    ),
    "narrowed by if": steps("do: drone.TakeOff\n{0}  when: drone.battery > 30 %")
    + "  - if: drone.airborne and drone.battery > 3 %\n    then:\n"
    + steps(DOWN, indent=6)
    + "    else:\n"
    + steps(DOWN + "\n{0}  when: drone.airborne", indent=6),
    "a check proves it": steps("do: drone.TakeOff\n{0}  when: drone.battery > 30 %", "check: drone.airborne", DOWN),
    "a retried leg": steps(UP, GO + "\n{0}  retry: {{attempts: 3}}", DOWN),
    "a retried landing": steps(UP, DOWN + "\n{0}  retry: {{attempts: 3}}"),
    "a failing branch need not land": steps(UP)
    + "  - if: drone.battery > 30 %\n    then:\n"
    + steps(DOWN, indent=6)
    + "    else:\n      - fail: too empty\n",
    "cleanup that asks first": steps(UP, DOWN) + "on_failure:\n" + steps(DOWN + "\n{0}  when: drone.airborne"),
    "landed in finally": steps(UP, GO) + "finally:\n" + steps(DOWN),
}

BAD = {
    "across from the ground": (steps(GO), ["E030"]),
    "down from the ground": (steps(DOWN), ["E030"]),
    "stays up": (steps(UP), ["E031"]),
    "lands in one branch": (steps(UP) + "  - if: drone.battery > 30 %\n    then:\n" + steps(DOWN, indent=6), ["E031"]),
    "skipped landing": (steps(UP, DOWN + "\n{0}  when: drone.battery > 30 %"), ["E031"]),
    "the wrong side of the test": (steps(UP, DOWN + "\n{0}  when: not drone.airborne"), ["E031"]),
    "an ignored landing": (steps(UP, DOWN + "\n{0}  ignore_failure: true"), ["E031", "W069"]),
    "a fallback after a failed start": (
        "  - fallback:\n" + steps(UP, GO, indent=6) + steps(DOWN),
        ["E030"],
    ),
    "a contradiction in cleanup": (steps(UP, DOWN) + "on_failure:\n" + steps(UP, UP), ["E030"]),
}


@pytest.mark.parametrize("name", GOOD)
def test_it_is_accepted(load: Load, name: str) -> None:
    assert codes(load, GOOD[name]) == []


@pytest.mark.parametrize("name", BAD)
def test_it_is_refused(load: Load, name: str) -> None:
    body, expected = BAD[name]

    assert sorted(set(codes(load, body))) == expected


def test_a_role_that_may_be_away_must_be_asked(load: Load) -> None:
    away = "{type: hwd, away: true}"

    assert codes(load, steps(UP, DOWN), away) == ["E030"]
    assert codes(load, steps(UP + "\n{0}  when: not drone.airborne", DOWN), away) == []
    assert codes(load, steps("check: drone.battery > 30 %"), away) == ["E031"]


def test_two_roles_are_followed_apart(load: Load) -> None:
    loaded = load(
        "agents:\n  one: {type: lwd}\n  two: {type: lwd}\nsteps:\n  - do: one.TakeOff\n  - do: two.TakeOff\n"
        '  - do: one.LandIn\n    with: {at: "${base}"}\n'
    )

    assert [(d.code, d.mark.line, "'two'" in d.message) for d in loaded.diagnostics] == [("E031", 8, True)]


def test_calls_are_followed_with_the_callers_role(load: Load) -> None:
    text = (
        "imports: [lib/flying.yaml]\nagents:\n  one: {type: lwd}\nsteps:\n"
        '  - call: FlyTo\n    with: {drone: "${one}", to: "${base}", height: 60 m}\n'
        '  - call: FlyAndLand\n    with: {drone: "${one}", at: "${base}"}\n'
    )

    assert load(text).diagnostics == []
    found = load(text + '  - call: ReturnHome\n    with: {drone: "${one}"}\n').diagnostics
    assert [(d.code, d.mark.line, d.mark.col) for d in found] == [("E030", 11, 5)]
    assert "'one'" in found[0].message


def test_people_are_not_followed(load: Load) -> None:
    loaded = load(
        'agents:\n  picker: {type: picker}\nsteps:\n  - do: picker.MiniFinder\n    with: {base: "${base}"}\n'
        "    save_as: fix\n  - check: fix.in_range\n"
    )

    assert loaded.diagnostics == []
