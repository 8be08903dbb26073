"""Play seeds of the simulation.

python -m tests.simulation.runs --seed 17 -v          play one seed again, with its story
python -m tests.simulation.runs --seed 17 --shrink    and with as few requests and faults as still show the same
python -m tests.simulation.runs --seeds 0-200         many seeds, one line for each that is not clean
"""

import argparse
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from tests.simulation.invariants import Violation
from tests.simulation.plan import Plan, plan
from tests.simulation.world import World


class Report(Struct, frozen=True):
    """What a run showed. Equal for equal seeds."""

    seed: int
    violations: tuple[Violation, ...]
    counts: tuple[tuple[str, int], ...]
    transitions: frozenset[tuple[str, ...]]
    causes: frozenset[str]
    steps: int
    lasted_s: float
    """Virtual seconds."""
    story: tuple[str, ...] = ()

    @property
    def command(self) -> str:
        """Return the command that plays it again."""
        return f"python -m tests.simulation.runs --seed {self.seed} -v"

    def text(self) -> str:
        """Return the violations and how to see them again."""
        return "\n".join([f"seed {self.seed}, again with: {self.command}", *(f"  {v}" for v in self.violations)])


def play(seed: int | Plan, *, story: bool = False, look: Callable[[World], None] | None = None) -> Report:
    """Play a seed, or a plan; whatever is raised is a violation too.

    Args:
        seed: or a plan of its own.
        story: whether the report tells it.
        look: is handed the world before it begins, to watch it (`world.invariants.watchers`).
    """
    played = seed if isinstance(seed, Plan) else plan(seed)
    world = World(played, story=story)
    watched = world.invariants
    if look is not None:
        look(world)
    try:
        world.play()
    except Exception as error:  # noqa: BLE001  (any exception is what is looked for)
        where = traceback.extract_tb(error.__traceback__)[-1]
        text = f"{type(error).__name__}: {error} ({'/'.join(where.filename.split('/')[-2:])}:{where.lineno})"
        watched.tell("exception", text)
        world.lines += traceback.format_exc().splitlines() if story else []
    lasted_s = (world.now - watched._start) / SECOND
    world.close()
    return Report(
        played.seed, tuple(watched.violations), tuple(sorted(watched.counts.items())), frozenset(watched.transitions),
        frozenset(watched.causes), watched.steps, lasted_s, tuple(world.lines),
    )  # fmt: skip


def shrink(played: Plan) -> Plan:
    """Return a plan with as few requests and faults as still break the rule that the plan breaks first."""
    rule = play(played).violations[0].rule

    def shows(smaller: Plan) -> bool:
        return any(violation.rule == rule for violation in play(smaller).violations)

    for name in ("deeds", "asks"):
        size = max(1, len(getattr(played, name)) // 2)
        while size:
            at = 0
            while at < len(getattr(played, name)):
                parts = getattr(played, name)
                smaller = replace(played, **{name: (*parts[:at], *parts[at + size :])})
                if shows(smaller):
                    played = smaller
                else:
                    at += size
            size //= 2
    return played


def main() -> int:
    """Play seeds from the command line."""
    parser = argparse.ArgumentParser(description="The engine under a seeded fault plan, on the virtual clock.")
    parser.add_argument("--seed", type=int, help="play this one")
    parser.add_argument("--seeds", default="0-100", help="play these, first-last (last excluded)")
    parser.add_argument("-v", "--verbose", action="store_true", help="print the story")
    parser.add_argument(
        "--shrink", action="store_true", help="look for a smaller plan that shows the same, and print it"
    )
    options = parser.parse_args()
    if options.seed is None:
        first, _, last = options.seeds.partition("-")
        return play_many(int(first), int(last))
    played = plan(options.seed)
    report = play(played, story=options.verbose and not options.shrink)
    if options.shrink and report.violations:
        played = shrink(played)
        report = play(played, story=options.verbose)
        print(
            *(f"ask {ask}" for ask in played.asks), *(f"deed {deed.at:g} s: {deed}" for deed in played.deeds), sep="\n"
        )
    if options.verbose:
        print(*report.story, sep="\n")
    print(
        report.text()
        if report.violations
        else f"seed {report.seed}: clean, {report.steps} steps, {report.lasted_s:.0f} s"
    )
    return bool(report.violations)


def play_many(first: int, last: int) -> int:
    """Play many seeds; print those that are not clean, and a summary."""
    rules: Counter[str] = Counter()
    counts: Counter[str] = Counter()
    failed, began = 0, time.process_time()
    for seed in range(first, last):
        report = play(seed)
        counts.update(dict(report.counts))
        if report.violations:
            failed += 1
            rules.update({violation.rule for violation in report.violations})
            print(f"seed {seed}: {len(report.violations)} violations, first: {report.violations[0]}", flush=True)
    took = time.process_time() - began
    print(
        f"{last - first} seeds, {failed} not clean, {took / max(1, last - first):.2f} s of a core each; {dict(rules)}"
    )
    print(dict(sorted(counts.items())))
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
