"""Conditions that agree: what is done under one and undone under the same one is undone on every path."""

from collections.abc import Callable

import pytest

from formiga_bt.lang.loader import Loaded

Load = Callable[[str], Loaded]

HEAD = """\
imports: [lib/flying.yaml]
params:
  twice: {type: bool, default: true}
  other: {type: place, optional: true}
vars: {late: "${twice}"}
agents:
  drone: {type: hwd}
  watcher: {type: watcher}
steps:
  - ask: Fly to ${base}?
    of: [watcher]
    timeout: 5 min
    save_as: said
  - set: {late: "${not twice}"}
  - notify: It is ${said.answer}
    when: is_set(other) and late
"""
SAME = """\
  - do: drone.TakeOff
    when: COND
  - wait: 5 s
  - if: COND
    then:
      - call: ReturnHome
        with: {drone: "${drone}"}
"""


def codes(load: Load, steps: str) -> list[str]:
    return [d.code for d in load(HEAD + steps).diagnostics]


@pytest.mark.parametrize(
    "cond",
    [
        "twice",
        "not twice",
        "is_set(other)",
        "said.answer == 'yes'",
        "distance(base, offset(base, 9 m)) > 5 m and twice",
    ],
)
def test_up_and_home_under_the_same_condition(load: Load, cond: str) -> None:
    assert codes(load, SAME.replace("COND", cond)) == []


def test_a_condition_that_may_change_between_them_does_not_agree(load: Load) -> None:
    assert codes(load, SAME.replace("COND", "late")) == ["E030"]
    assert codes(load, SAME.replace("COND", "drone.battery > 50 %")) == ["E030"]
    again = "  - repeat: 2\n    steps:\n      - ask: Again?\n        of: [watcher]\n"
    again += "        timeout: 5 min\n        save_as: more\n"
    inside = SAME.replace("COND", "more.answer == 'yes'").replace("\n  ", "\n      ")
    assert "E030" in codes(load, again + "    " + inside.removesuffix("    "))


def test_the_reverse_of_it_is_another_way(load: Load) -> None:
    reverse = SAME.replace("if: COND", "if: not twice").replace("COND", "twice")

    assert codes(load, reverse) == ["E031", "E030"]


def test_a_subtrees_param_may_be_called_as_another_role(load: Load) -> None:
    text = HEAD.replace("  watcher:", "  heavy: {type: hwd}\n  watcher:", 1)
    home = '  - call: ReturnHome\n    with: {drone: "${NAME}"}\n'
    steps = "  - do: drone.TakeOff\n  - do: heavy.TakeOff\n" + home.replace("NAME", "heavy")

    assert [d.code for d in load(text + steps + home.replace("NAME", "drone")).diagnostics] == []
    assert [d.code for d in load(text + steps).diagnostics] == ["E031"]


PAIR = """\
  - do: drone.TakeOff
    when: cN
  - call: ReturnHome
    with: {drone: "${drone}"}
    when: cN
"""
MANY = HEAD.replace("params:\n", "params:\n" + "".join(f"  c{n}: {{type: bool, default: true}}\n" for n in range(8)))


class TestMany:
    """More conditions than are told apart at once."""

    def test_each_pair_agrees(self, load: Load) -> None:
        steps = "".join(PAIR.replace("cN", f"c{n}") for n in range(8))

        assert [d.code for d in load(MANY + steps).diagnostics] == []
        inside = "  - guard: watcher.battery > 5 %\n    steps:\n" + steps.replace("  - ", "      - ").replace(
            "\n    w", "\n        w"
        )
        assert "E030" not in [d.code for d in load(MANY + inside).diagnostics]

    def test_one_inside_the_other(self, load: Load) -> None:
        ups = "".join(f"  - notify: Go\n    when: c{n}\n" for n in range(4))
        steps = ups + "".join(PAIR.replace("cN", f"c{n}") for n in range(7)) + ups

        assert [d.code for d in load(MANY + steps).diagnostics if d.code != "W060"] == []

    @pytest.mark.parametrize("last", [0, 3, 7])
    def test_a_pair_that_does_not_is_told(self, load: Load, last: int) -> None:
        steps = [PAIR.replace("cN", f"c{n}") for n in range(8)]
        home = steps[last].partition("  - call")[0]
        steps[last] = home

        found = {d.code for d in load(MANY + "".join(steps)).diagnostics}
        assert found & {"E030", "E031"}

    def test_a_fault_beside_them_is_told(self, load: Load) -> None:
        steps = "".join(PAIR.replace("cN", f"c{n}") for n in range(8))

        assert [d.code for d in load(MANY + steps + "  - do: drone.TakeOff\n").diagnostics] == ["E031"]
        both = steps + "  - do: drone.TakeOff\n    when: c0 and c1\n"
        assert [d.code for d in load(MANY + both).diagnostics] == ["E031"]
