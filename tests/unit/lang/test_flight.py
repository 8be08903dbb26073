"""The state of flight: which tasks are refused because a machine is, or may be, on the wrong side of the ground."""

from collections.abc import Callable

import pytest

from formiga_bt.lang.loader import Loaded

Load = Callable[[str], Loaded]

UP = "do: drone.TakeOff"
DOWN = 'do: drone.LandIn\n{0}  with: {{at: "${{drone.home}}"}}'
GO = 'do: drone.GoTo\n{0}  with: {{to: "${{above(drone.home, 60 m)}}"}}'


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
    "landed in finally if it is not": steps(UP, DOWN) + "finally:\n" + steps(DOWN + "\n{0}  when: drone.airborne"),
    "perhaps landed before finally": steps(UP)
    + "  - if: drone.battery > 30 %\n    then:\n"
    + steps(DOWN, indent=6)
    + "finally:\n"
    + steps(DOWN),
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
    "landed before finally": (steps(UP, DOWN) + "finally:\n" + steps(DOWN), ["E030"]),
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
    away = "{type: hwd, away: true, near: '${base}'}"

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
        "imports: [lib/flying.yaml]\nagents:\n  one: {type: lwd, near: '${base}'}\nsteps:\n"
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


def lines(load: Load, text: str) -> list[tuple[str, int]]:
    """Return the codes of a task's text and their lines; the text's first line is 1."""
    found = load("imports: [lib/flying.yaml]\n" + text.lstrip("\n")).diagnostics
    return [(d.code, d.mark.line - 3) for d in found if d.code != "W060"]


LIST = """
agents:
  drones: {type: lwd, count: 3}
steps:
"""
UP_ALL = """
  - for: {drone: "${drones}"}
    mode: parallel
    steps:
      - do: drone.TakeOff
"""
HOME_ALL = """
  - for: {drone: "${drones}"}
    mode: each
    steps:
      - call: ReturnHome
        with: {drone: "${drone}"}
"""


class TestLists:
    def test_what_a_for_does_to_one_it_does_to_all(self, load: Load) -> None:
        assert lines(load, LIST + UP_ALL + HOME_ALL) == []
        assert lines(load, LIST + HOME_ALL) == [("E030", 8)]
        assert lines(load, LIST + UP_ALL) == [("E031", 8)]

    def test_some_may_be_left_up(self, load: Load) -> None:
        broken = HOME_ALL + "      - break_if: drones[0].battery < 50 %\n"
        assert [code for code, _ in lines(load, LIST + UP_ALL + broken)] == ["E031"]
        enough = UP_ALL + HOME_ALL.replace("    steps", "    need: 2\n    steps", 1)
        assert [code for code, _ in lines(load, LIST + enough)] == ["E031"]

    def test_first_stops_the_others_wherever_they_are(self, load: Load) -> None:
        head = '  - for: {drone: "${drones}"}\n    mode: parallel\n    FIRST\n    steps:\n'
        ask = "      - ask: Is ${drone.id} there?\n        of: [watchers]\n        timeout: 1 min\n        save_as: reply\n"
        up, down = "      - do: drone.TakeOff\n", '      - do: drone.LandIn\n        with: {at: "${drone.home}"}\n'
        alone, first = head + up + ask + down, head.replace("FIRST", "first: reply")

        assert lines(load, LIST + alone.replace("FIRST", "collect: reply")) == []
        assert lines(load, LIST + first + up + ask + down) == [("E031", 8)]
        assert lines(load, LIST + UP_ALL + first + ask + HOME_ALL) == []

    def test_items_are_followed_one_by_one(self, load: Load) -> None:
        text = LIST + UP_ALL
        for which in ("drones[0]", "drones[1]", "last(drones)"):
            text += f'  - call: ReturnHome\n    with: {{drone: "${{{which}}}"}}\n'

        assert lines(load, text) == []
        assert lines(load, text.replace("drones[1]", "drones[0]")) == [("E030", 11)]

    def test_a_list_written_out_is_a_list(self, load: Load) -> None:
        text = """
agents:
  one: {type: lwd}
  two: {type: hwd}
steps:
  - for: {drone: "${[one, two]}"}
    mode: parallel
    steps:
      - do: drone.TakeOff
  - for:
      drone:
        - ${one}
        - ${two}
    mode: each
    steps:
      - call: ReturnHome
        with: {drone: "${drone}"}
"""
        assert lines(load, text) == []

    def test_a_subtree_may_take_the_list(self, load: Load) -> None:
        text = LIST + UP_ALL + '  - call: All\n    with: {drones: "${drones}"}\n'
        home = "    params: {drones: {type: {list: agent}, of: [lwd]}}\n    steps:\n" + HOME_ALL.lstrip("\n").replace(
            "\n", "\n    "
        ).replace("  - for", "      - for", 1)

        assert lines(load, text + "subtrees:\n  All:\n" + home.rstrip() + "\n") == []


ONE = """
agents:
  drone: {type: hwd}
steps:
"""


class TestRounds:
    def test_the_second_round_starts_where_the_first_ended(self, load: Load) -> None:
        up = "  - repeat: 3\n    steps:\n      - do: drone.TakeOff\n"
        down = '      - do: drone.LandIn\n        with: {at: "${drone.home}"}\n'

        assert lines(load, ONE + up + down) == []
        assert lines(load, ONE + up) == [("E030", 6)]
        narrowed = up + "        when: not drone.airborne\n"
        assert lines(load, ONE + narrowed) == [("E031", 6)]

    def test_a_loop_that_may_not_run_changes_nothing_for_sure(self, load: Load) -> None:
        text = (
            "  - while: drone.battery > 50 %\n    every: 15 s\n    steps:\n      - do: drone.TakeOff\n"
            "        when: not drone.airborne\n"
        )
        home = '  - call: ReturnHome\n    with: {drone: "${drone}"}\n'

        assert [code for code, _ in lines(load, ONE + text + home)] == ["E030"]
        assert lines(load, ONE + text + home + "    when: drone.airborne\n") == []

    def test_the_way_out_tells_the_state(self, load: Load) -> None:
        text = """
  - repeat: forever
    every: 5 s
    steps:
      - do: drone.TakeOff
        when: not drone.airborne
      - break_if: drone.airborne
"""
        home = '  - call: ReturnHome\n    with: {drone: "${drone}"}\n'

        assert lines(load, ONE + text + home) == []
        assert lines(load, ONE + text) == [("E031", 8)]


class TestAtOnce:
    def test_each_branch_is_followed(self, load: Load) -> None:
        text = """
agents:
  one: {type: lwd}
  two: {type: hwd}
steps:
  - parallel:
      - do: one.TakeOff
      - do: two.TakeOff
  - parallel:
      - call: ReturnHome
        with: {drone: "${one}"}
      - call: ReturnHome
        with: {drone: "${two}"}
"""
        assert lines(load, text) == []
        raced = text.replace("  - parallel:\n      - call", "    need: any\n  - parallel:\n      - call")
        assert [code for code, _ in lines(load, raced)] == ["E030", "E030"]

    def test_a_branch_knows_nothing_of_what_another_commands(self, load: Load) -> None:
        text = """
agents:
  one: {type: lwd}
  two: {type: hwd}
steps:
  - parallel:
      - sequence:
          - do: one.TakeOff
          - call: ReturnHome
            with: {drone: "${one}"}
      - sequence:
          - wait_until: one.airborne
            timeout: 5 min
          - do: two.TakeOff
          - call: ReturnHome
            with: {drone: "${two}"}
"""
        assert lines(load, text) == []

    def test_a_guard_may_stop_anywhere(self, load: Load) -> None:
        text = """
  - fallback:
      - guard: drone.battery > 40 %
        steps:
          - do: drone.TakeOff
          - do: drone.LandIn
            with: {at: "${drone.home}"}
      - call: ReturnHome
        with: {drone: "${drone}"}
"""
        assert [code for code, _ in lines(load, ONE + text)] == ["E030"]

    def test_a_finally_may_bring_it_home(self, load: Load) -> None:
        text = """
  - sequence:
      - do: drone.TakeOff
      - check: drone.battery > 50 %
    finally:
      - call: ReturnHome
        with: {drone: "${drone}"}
        when: drone.airborne
"""
        assert lines(load, ONE + text) == []


def test_a_released_drone_is_brought_home_by_the_engine(load: Load) -> None:
    assert lines(load, ONE + "  - do: drone.TakeOff\n  - release: drone\n") == []


def test_an_agent_written_by_its_id_is_none_of_the_machines_that_are_followed(load: Load) -> None:
    head = "imports: [lib/flying.yaml]\nagents:\n  drone: {type: lwd}\nsteps:\n"
    subtrees = 'subtrees:\n  Fly:\n    params: {drones: {list: agent}}\n    steps:\n      - for: {one: "${drones}"}\n'
    subtrees += '        steps:\n          - call: FetchHome\n            with: {drone: "${one}"}\n'
    calls = [
        "  - call: FetchHome\n    with: {drone: hwd_1}\n",
        "  - call: FetchHome\n    with: {drone: 'null'}\n",
        "  - call: Fly\n    with: {drones: [hwd_1, hwd_2]}\n",
        "  - call: Fly\n    with: {drones: ['${drone}', hwd_1]}\n",
    ]
    for call in calls:
        found = [d.code for d in load(head + call + "  - do: drone.TakeOff\n" + subtrees).diagnostics]
        assert "E031" in found, "the role itself is followed as ever"
        assert "E030" not in found
