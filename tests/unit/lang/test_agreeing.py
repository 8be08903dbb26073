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
