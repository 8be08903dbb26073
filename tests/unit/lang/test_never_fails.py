"""E043 in a fallback: a later child never runs only where the one before it cannot fail, whatever happens."""

from collections.abc import Callable

import pytest

from formiga_bt.lang.loader import Loaded

Load = Callable[[str], Loaded]

HEAD = """\
params: {long: {type: duration, default: 3 s}, on: {type: bool, default: true}}
vars: {seen: 0 %}
agents: {drone: {type: hwd}}
steps:
  - fallback:
"""
AFTER = "      - notify: It took longer.\n"


def codes(load: Load, child: str) -> list[str]:
    return [d.code for d in load(HEAD + child + AFTER).diagnostics if d.code not in ("W060", "W064", "W088")]


@pytest.mark.parametrize(
    "child",
    [
        "      - wait: 10 s\n        timeout: 3 s\n",
        "      - wait: 10 s\n        timeout: ${long}\n",
        "      - wait: 10 s\n        retry: {attempts: 2, attempt_timeout: 3 s}\n",
        "      - notify: Hello.\n        when: on\n",
        "      - notify: At ${drone.battery}.\n",
        '      - set: {seen: "${drone.battery}"}\n',
    ],
)
def test_what_may_fail_has_a_way_out(load: Load, child: str) -> None:
    assert codes(load, child) == []


@pytest.mark.parametrize(
    "child",
    [
        "      - wait: 10 s\n",
        "      - wait: ${long}\n        retry: {attempts: 2}\n",
        "      - notify: Hello ${long}.\n",
        "      - set: {seen: 5 %}\n",
        "      - wait: 10 s\n        timeout: 3 s\n        ignore_failure: true\n",
    ],
)
def test_what_cannot_fail_has_none(load: Load, child: str) -> None:
    assert codes(load, child) == ["E043"]
