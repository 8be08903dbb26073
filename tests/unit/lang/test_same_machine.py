"""One machine under two names: what is refused, what is only not followed, and what is no such thing.

The words are pinned in tests/lang_errors (E034_two_names, E030_two_names, W101_same_machine).
"""

from collections.abc import Callable

import pytest

from formiga_bt.lang.loader import Loaded

Load = Callable[[str], Loaded]

HEAD = """\
imports: [lib/flying.yaml]
params: {which: {type: int, default: 0}}
agents:
  heavy: {type: hwd}
  drones: {type: lwd, count: 3}
  fleet_: {type: lwd, count: all}
  pickers: {type: picker, count: 2}
steps:
"""
SUBTREES = """\
subtrees:
  AtOnce:
    params: {one: agent, other: agent}
    steps:
      - parallel:
          - call: FetchHome
            with: {drone: "${one}"}
          - call: FetchHome
            with: {drone: "${other}"}
  InTurn:
    params: {one: agent, other: agent}
    steps:
      - do: one.TakeOff
      - do: other.TakeOff
      - call: ReturnHome
        with: {drone: "${one}"}
      - call: ReturnHome
        with: {drone: "${other}"}
  Further:
    params: {up: agent, down: agent}
    steps:
      - call: InTurn
        with: {one: "${down}", other: "${up}"}
  Looks:
    params: {one: agent, other: agent}
    steps:
      - notify: Near ${other.id}
        when: other.airborne
      - call: FetchHome
        with: {drone: "${one}"}
  All:
    params: {all: {type: {list: agent}}, one: agent}
    steps:
      - for: {drone: "${all}"}
        mode: each
        steps:
          - call: FetchHome
            with: {drone: "${drone}"}
      - call: FetchHome
        with: {drone: "${one}"}
  Together:
    params: {all: {type: {list: agent}}}
    steps:
      - for: {drone: "${all}"}
        mode: parallel
        steps:
          - call: FetchHome
            with: {drone: "${drone}"}
  Asks:
    params: {one: {type: agent, of: [picker]}, other: {type: agent, of: [picker]}}
    steps:
      - parallel:
          - do: one.MiniFinder
            with: {base: "${base}"}
          - do: other.MiniFinder
            with: {base: "${base}"}
"""


def codes(load: Load, steps: str) -> list[str]:
    return [d.code for d in load(HEAD + steps + SUBTREES).diagnostics if d.code not in ("W060", "W088", "W093")]


def call(subtree: str, **args: str) -> str:
    given = ", ".join(f'{name}: "${{{arg}}}"' for name, arg in args.items())
    return f"  - call: {subtree}\n    with: {{{given}}}\n"


def over(lists: str, *lines: str, mode: str = "parallel") -> str:
    steps = "".join(f'      - call: FetchHome\n        with: {{drone: "${{{line}}}"}}\n' for line in lines)
    return f"  - for: {lists}\n    mode: {mode}\n    steps:\n{steps}"


@pytest.mark.parametrize(
    ("steps", "expected"),
    [
        (call("AtOnce", one="heavy", other="heavy"), ["E034"]),
        (call("AtOnce", one="drones[2]", other="last(drones)"), ["E034"]),
        (call("AtOnce", one="drones[0]", other="reverse(drones)[2]"), ["E034"]),
        (call("AtOnce", one="drones[0]", other="drones[which]"), ["W101"]),
        (call("InTurn", one="heavy", other="heavy"), ["E030"]),
        (call("Further", up="heavy", down="heavy"), ["E030"]),
        (call("InTurn", one="drones[0]", other="drones[which]"), ["W101"]),
        (call("All", all="drones", one="drones[0]"), ["W101"]),
        (call("All", all="fleet_", one="fleet_[7]"), ["W101"]),
        (call("All", all="[heavy, heavy]", one="drones[0]"), ["W101"]),
        (call("Together", all="[heavy, heavy]"), ["E034"]),
        (over('{one: "${[heavy, drones[0], heavy]}"}', "one"), ["E034"]),
        (over('{one: "${drones}", other: "${reverse(drones)}"}', "one", "other"), ["E034"]),
        (over('{one: "${fleet_}", other: "${reverse(fleet_)}"}', "one", "other"), ["W101"]),
        (over('{one: "${drones}", other: "${reverse(drones)}"}', "one", "other", mode="each"), ["W101"]),
        (over('{one: "${drones}"}', "one", "drones[0]", mode="each"), ["W101"]),
    ],
)
def test_two_names_of_one_machine_are_told(load: Load, steps: str, expected: list[str]) -> None:
    assert codes(load, steps) == expected


@pytest.mark.parametrize(
    "steps",
    [
        call("AtOnce", one="drones[0]", other="drones[1]"),
        call("AtOnce", one="first(drones)", other="last(drones)"),
        call("AtOnce", one="heavy", other="drones[which]"),
        call("AtOnce", one="fleet_[0]", other="fleet_[1]"),
        call("InTurn", one="drones[0]", other="reverse(drones)[0]"),
        call("Looks", one="heavy", other="heavy"),
        call("All", all="[drones[1], drones[2]]", one="drones[0]"),
        call("Together", all="[heavy, drones[0]]"),
        over('{one: "${[heavy, drones[0]]}", other: "${[drones[1], drones[2]]}"}', "one", "other", mode="each"),
        '  - for: {x: "${[heavy, drones[0]]}", y: "${[drones[1], drones[2]]}"}\n    mode: each\n    steps:\n    '
        + call("AtOnce", one="x", other="y").replace("\n ", "\n     "),
        call("Asks", one="pickers[0]", other="pickers[0]"),
        over('{one: "${drones}", other: "${drones}"}', "one", "other"),
        over('{one: "${[heavy, drones[0]]}", other: "${[drones[1], drones[2]]}"}', "one", "other"),
        over('{one: "${[heavy, heavy]}"}', "one", mode="each"),
        over('{one: "${drones}"}', "one", "heavy", mode="each"),
    ],
)
def test_machines_that_differ_are_not(load: Load, steps: str) -> None:
    assert codes(load, steps) == []


def test_what_one_name_does_is_seen_under_the_other(load: Load) -> None:
    swap = """\
subtrees:
  Swap:
    params: {up: agent, down: agent}
    steps:
      - do: up.TakeOff
      - call: ReturnHome
        with: {drone: "${down}"}
        when: down.airborne
"""
    text = HEAD + call("Swap", up="heavy", down="heavy") + swap

    assert [d.code for d in load(text).diagnostics if d.code not in ("W060", "W088")] == []
    apart = [d.code for d in load(text.replace('down: "${heavy}"', 'down: "${drones[0]}"')).diagnostics]
    assert "E031" in apart


def test_a_machine_twice_in_a_list_is_in_the_second_round_as_the_first_left_it(load: Load) -> None:
    up = "      - do: one.TakeOff\n"
    loop = '  - for: {one: "${[heavy, heavy]}"}\n    mode: each\n    steps:\n' + up

    assert codes(load, loop + call("ReturnHome", drone="heavy")) == ["E030"]
    assert codes(load, loop.replace("[heavy, heavy]", "[heavy]") + call("ReturnHome", drone="heavy")) == []
