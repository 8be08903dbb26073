"""How many mistakes of people are found before flight? Writes its part of docs/mutation.md.

python benchmarks/mistakes.py [--dry]

The mistakes are those of tests/mistakes/mistakes.yaml, each made in a task beside it. A mistake is found by the checker if it
refuses the task or warns of it; else by the tests if a case of the task's own test file fails, or reaches a step or branch less
than it did. Takes about a minute.
"""

import argparse
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Final

from tests.mistakes.book import BASES, Decidable, Found, Mistake, base_text, found, mistakes, played, said

PAGE: Final = Path(__file__).parents[1] / "docs" / "mutation.md"
MARK: Final = "<!-- mistakes: written by benchmarks/mistakes.py -->"
GOOD_MARK: Final = "<!-- good tasks: written by benchmarks/false_alarms.py -->"
"""Where the part behind this one begins."""
FIRST: Final = (("all", 167, 111, 38), ("can be known before flight", 155, 110, 36))
"""What was found at the first count: how many, by the checker, by the tests."""
UNUSED: Final = {"W060"}

PART: Final = """\
{mark}
## Mistakes that people make

{all} mistakes written by hand, as people make them who know BehaviorTree.CPP, Nav2, Open-RMF or PX4:
`tests/mistakes/mistakes.yaml`, each with what is wrong and whether it can be known before flight. They were written before
anybody looked at what the checker says of them. `python benchmarks/mistakes.py` writes this part. *By the checker*: it refuses
the task or warns of it. *By the tests*: of what it lets pass, a case of the task's own test file fails, or reaches a step or
branch less. One hand wrote the tasks, their tests and the mistakes, so the tests may look closer at what goes wrong than those
of another author would.

| first count, before any check was written for them | mistakes | by the checker | by the tests | share |
|---|---:|---:|---:|---:|
{first}

| now | mistakes | by the checker | by the tests | share |
|---|---:|---:|---:|---:|
{now}

The second count is of mistakes that have been looked at since: checks were written for what some of them have in common.
Of those that the checker found, {only} were told only by a word about something that is unused now (W060), which leads there by
chance.

### What nobody finds

{slips}

### What only the tests find

{tests}
"""


def main() -> None:
    """Look for all mistakes, print the tables, write the part of the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dry", action="store_true", help="print the part, do not write it")
    given = parser.parse_args()
    for base in BASES:
        wrong = [*said(base, base_text(base)), *played(base, base_text(base))]
        if wrong:
            raise SystemExit(f"{base}.yaml is not good itself: {wrong}")
    part = report([(one, found(one)) for one in mistakes()])
    if given.dry:
        print(part)
    else:
        before, _, old = PAGE.read_text(encoding="utf-8").partition(MARK)
        behind = "".join(old.partition(GOOD_MARK)[1:])
        PAGE.write_text(f"{before.rstrip()}\n\n{part}" + (f"\n{behind}" if behind else ""), encoding="utf-8")
        print("\n".join(line for line in part.split("\n") if line.startswith("|")))


def report(all_: list[tuple[Mistake, Found]]) -> str:
    """Return the part of the page."""
    knowable = [pair for pair in all_ if pair[0].decidable == "yes"]
    rows = [_row("all", *_counts(all_)), _row("can be known before flight", *_counts(knowable))]
    only = sum(1 for _, what in all_ if what.by == "check" and set(what.what.split()) <= UNUSED)
    return PART.format(
        mark=MARK,
        all=len(all_),
        first="\n".join(_row(*row) for row in FIRST),
        now="\n".join(rows),
        only=only,
        slips=_list(all_, "nothing", lambda mistake, _: _KNOWABLE[mistake.decidable]),
        tests=_list(all_, "test", lambda _, __: ""),
    )


_KNOWABLE: Final[dict[Decidable, str]] = {
    "yes": "",
    "test": " (a case that looks closer shows it)",
    "no": " (cannot be known: another task, not a wrong one)",
}


def _counts(pairs: list[tuple[Mistake, Found]]) -> tuple[int, int, int]:
    by = Counter(what.by for _, what in pairs)
    return len(pairs), by["check"], by["test"]


def _row(name: str, number: int, by_check: int, by_test: int) -> str:
    return f"| {name} | {number} | {by_check} | {by_test} | {100 * (by_check + by_test) / number:.1f} % |"


def _list(all_: list[tuple[Mistake, Found]], by: str, more: Callable[[Mistake, Found], str]) -> str:
    told = [f"* {one.base}: {one.wrong.rstrip('.')}{more(one, what)}." for one, what in all_ if what.by == by]
    return "\n".join(told) or "Nothing."


if __name__ == "__main__":
    main()
