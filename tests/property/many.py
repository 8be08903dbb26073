"""Play many random missions with the engine's nodes and with the naive interpreter, and compare every step.

python -m tests.property.many --seeds 10000-30000     a line for each that differs; then how many steps there were, and how
                                                      many trees have each kind
"""

import argparse
import json
import sys
import time
import traceback
from collections import Counter
from typing import Any

import pytest

from formiga_bt.lang.kinds import KINDS
from tests.oracle.naive import NaiveTrees
from tests.property.strategies import mission
from tests.property.test_differential import assert_equal, fly


def main() -> int:
    """Play the seeds; return 1 if one differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="10000-10100", help="the first, and the one after the last")
    first, _, end = parser.parse_args().seeds.partition("-")
    began, kinds, steps, differ = time.process_time(), Counter[str](), 0, 0
    for seed in range(int(first), int(end)):
        drawn = mission(seed, tasks=1 + seed % 4 // 3)
        try:
            ours = fly(drawn)
            assert_equal(ours, fly(drawn, NaiveTrees), drawn)
        except (Exception, pytest.fail.Exception):  # noqa: BLE001 - any at all is what is looked for
            differ += 1
            print(f"seed {seed}: {traceback.format_exc().strip().splitlines()[-1][:200]}", flush=True)
            continue
        steps += len(ours.steps)
        for text in drawn.texts:
            kinds.update(kinds_of(json.loads(text)))
        if (seed + 1) % 1000 == 0:
            print(f"to seed {seed}: {steps} steps, {differ} differ", flush=True)
    spent = time.process_time() - began
    print(f"{int(end) - int(first)} missions, {steps} steps, {differ} differ; {spent:.0f} s of a core")
    print(", ".join(f"{kind} {kinds[kind]}" for kind in sorted(KINDS)))
    return int(differ > 0)


def kinds_of(value: Any) -> set[str]:
    """Return the kinds of steps that a file has."""
    if isinstance(value, list):
        return set().union(*map(kinds_of, value))
    if not isinstance(value, dict):
        return set()
    return set().union({key for key in value if key in KINDS}, *map(kinds_of, value.values()))


if __name__ == "__main__":
    sys.exit(main())
