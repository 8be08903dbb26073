"""W098 of conditions: what no value makes true, or each does; and what only looks so."""

from collections.abc import Callable

import pytest

from formiga_bt.lang.loader import Loaded

Load = Callable[[str], Loaded]

HEAD = """\
params:
  since: {type: time, default: "06:00"}
  till: {type: time, default: "20:00"}
  least: {type: int, default: 0, min: 0, max: 9}
  most: {type: int, default: 5}
  free: {type: int, default: 0}
  mode: {type: enum, values: [quick, long], default: quick}
  label: {type: text, default: ""}
vars: {limit: 9, seen: 3}
agents: {watcher: {type: watcher}}
steps:
  - set: {seen: "${seen + 1}"}
  - notify: "${watcher.id} ${since} ${till} ${least} ${most} ${free} ${mode} ${label} ${limit} ${seen}"
  - notify: Well.
    when: CONDITION
"""


def said(load: Load, condition: str) -> list[str]:
    found = load(HEAD.replace("CONDITION", condition)).diagnostics
    return [f"{one.code} {one.message}" for one in found]


@pytest.mark.parametrize(
    "condition",
    [
        "now >= till and now < since",
        "now >= since or now < till",
        "not (now >= since or now < till)",
        "least > 9",
        "least > 3 and not (least > 2)",
        "now > today('20:00') and now < today('06:00')",
        "now > today('06:00') or now < today('20:00')",
        "5 < least < 4",
        "mode != 'quick' or mode != 'long'",
        "label == 'a' and label == 'b' and is_set(label)",
        "watcher.battery > 60 % and watcher.airborne and watcher.battery < 40 %",
        "(seen < 2 or seen > 5) and seen == 3",
        "free == 0 and distance(base, watcher.home) < 0 m",
        "most > seen and seen > 9 and most < 7",
        "is_set(label) and (mode == 'quick' and mode == 'long' or label == 'x')",
    ],
)
def test_it_is_told(load: Load, condition: str) -> None:
    found = said(load, condition)

    assert [one.partition(" ")[0] for one in found] == ["W098"], found


@pytest.mark.parametrize(
    "condition",
    [
        "now >= since and now < till",
        "now >= till or now < since",
        "free > 0",
        "free > 0 and least > 3",
        "least > free and least < most",
        "least >= 9",
        "seen > limit",
        "seen > 2 and not (seen > 3)",
        "5 > least > 4 or least == 0",
        "mode == 'quick' or mode == 'long' and seen > 2",
        "label != 'a' and label != 'b'",
        "watcher.battery > 60 % or watcher.battery < 40 %",
        "watcher.battery >= 100 %",
        "(seen < 2 or seen > 5) and seen == 6",
        "now > today('06:30') and now < today('06:31') or now > today('22:00')",
        "now > today('20:00') or now < today('06:00')",
        "most > seen or seen > 9",
    ],
)
def test_what_can_be_either_way_is_not(load: Load, condition: str) -> None:
    assert said(load, condition) == []
