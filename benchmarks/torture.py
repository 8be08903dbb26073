"""Sites of real processes, real files and real sockets under torture, judged from outside (docs/reliability.md).

    python benchmarks/torture.py --seed 17                      a round on two sites at once
    python benchmarks/torture.py --seed 17 --site 1             one of its sites again
    python benchmarks/torture.py --scenarios                    stories of what was found once (or: --scenarios stray)
    python benchmarks/torture.py --kills 500 --readers          kill -9 and restart, while others read the journal
    python benchmarks/torture.py --standstill 30                an engine's process stands still beside flying machines
    python benchmarks/torture.py --hours 3 --jobs 2 --into soak.json       hours of it, summed over the jobs; it can be resumed
    python benchmarks/torture.py --into soak.json --table       what there is
    ... --tree OLD                                              of another checkout, such as one without a fix

A finding prints its seed and the command that plays it again, and keeps its folder. Exit code 1 if there is one.
With --external also what needs a privileged user is broken: the network between engine and agents (namespaces) and the disk
(mounts), as far as this machine has them.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

OWN: Final = Path(__file__).resolve().parents[1]


def main() -> int:
    options = _options()
    tree = options.tree.resolve()
    if os.environ.get("PYTHONPATH", "").split(":")[0] != str(tree):
        # All processes, this one too, are of the tree under test; only the bench itself is of this checkout.
        os.environ["PYTHONPATH"] = str(tree)
        os.execv(sys.executable, [sys.executable, __file__, *sys.argv[1:]])
    sys.path = [one for one in sys.path if one != str(Path(__file__).parent)] + [str(OWN)]
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # no process is left behind
    from benchmarks.torture_bench import soak
    from benchmarks.torture_bench.privileged import available

    privileges = available() if options.external else frozenset()
    if options.table:
        print(soak.table(_units(options.into)))
        return 0
    if options.jobs > 1 and options.job is None:
        return _jobs(options)
    if options.hours:
        job = options.job or 0
        one = soak.Soak(_part(options.into, job), job, tree)
        one.go_on(options.hours / options.jobs, options.sites, options.seconds, privileges)
        return 1 if any(part["findings"] for unit in one.units for part in unit["rounds"]) else 0
    root = options.folder or Path(tempfile.mkdtemp(prefix="torture-"))
    again = "python benchmarks/torture.py" + (f" --tree {tree}" if tree != OWN else "")
    again += " --external" if options.external else ""
    good = True

    def tell(theme: str, seed: int, rounds: Sequence[Any], command: str) -> None:
        nonlocal good
        good &= not any(one.findings for one in rounds)
        print(soak.told(theme, seed, rounds, f"{again} {command}"), flush=True)

    if options.scenarios is not None:
        for name in options.scenarios or soak.SCENARIOS:
            tell(name, 0, [soak.play_story(name, root / name)], f"--scenarios {name}")
    elif options.kills:
        command = f"--kills {options.kills} --seed {options.seed} --sites {options.sites}"
        command += " --readers" if options.readers else ""
        tell(
            "kills",
            options.seed,
            soak.play_kills(root, options.seed, options.sites, options.kills, readers=options.readers),
            command,
        )
    elif options.standstill:
        tell(
            "standstill",
            0,
            [soak.play_standstill(root / "site-0", options.standstill)],
            f"--standstill {options.standstill:g}",
        )
    else:
        for seed in range(options.seed, options.seed + options.rounds):
            rounds = soak.play_round(
                root / str(seed),
                seed,
                options.sites,
                options.seconds,
                privileges,
                gentle=options.gentle,
                only=options.site,
            )
            command = f"--seed {seed} --seconds {options.seconds:g} --sites {options.sites}" + (
                " --gentle" if options.gentle else ""
            )
            tell("round", seed, rounds, command)
    return 0 if good else 1


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1, help="of the first round (%(default)s)")
    parser.add_argument("--rounds", type=int, default=1, help="so many rounds (%(default)s)")
    parser.add_argument("--sites", type=int, default=2, help="sites at once (%(default)s)")
    parser.add_argument("--site", type=int, help="only this site of the round")
    parser.add_argument("--seconds", type=float, default=60.0, help="things break for so long in a round (%(default)s)")
    parser.add_argument("--gentle", action="store_true", help="short faults only")
    parser.add_argument("--scenarios", nargs="*", metavar="NAME", help="play the stories, or these")
    parser.add_argument("--kills", type=int, default=0, metavar="N", help="kill engines so often in all")
    parser.add_argument("--readers", action="store_true", help="with --kills: others read the journals meanwhile")
    parser.add_argument(
        "--standstill", type=float, default=0.0, metavar="S", help="let an engine stand still for so long"
    )
    parser.add_argument("--hours", type=float, default=0.0, help="play all of it for so long, summed over the jobs")
    parser.add_argument("--jobs", type=int, default=1, help="jobs at once (%(default)s)")
    parser.add_argument("--job", type=int, help=argparse.SUPPRESS)
    parser.add_argument(
        "--into", type=Path, default=Path("torture.json"), metavar="FILE", help="with --hours (%(default)s)"
    )
    parser.add_argument("--table", action="store_true", help="print what --into has, and end")
    parser.add_argument("--external", action="store_true", help="also what needs a privileged user")
    parser.add_argument("--tree", type=Path, default=OWN, metavar="DIR", help="the checkout under test (this one)")
    parser.add_argument("--folder", type=Path, metavar="DIR", help="where sites are made (a new one)")
    return parser.parse_args()


def _part(into: Path, job: int) -> Path:
    return into.with_name(f"{into.stem}-{job}{into.suffix or '.json'}")


def _units(into: Path) -> list[dict[str, Any]]:
    files = sorted(into.parent.glob(f"{into.stem}-[0-9]*{into.suffix or '.json'}"))
    return [unit for file in files for unit in json.loads(file.read_text())["units"]]


def _jobs(options: argparse.Namespace) -> int:
    """Run the jobs, each a process of its own whose lines go to a log beside its file."""
    running = []
    for job in range(options.jobs):
        file = _part(options.into, job).with_suffix(".log")
        file.parent.mkdir(parents=True, exist_ok=True)
        with file.open("ab") as log:
            running.append(
                subprocess.Popen([sys.executable, __file__, *sys.argv[1:], "--job", str(job)], stdout=log, stderr=log)
            )
        time.sleep(1.0)
    try:
        return max(process.wait() for process in running)
    finally:
        for process in running:
            process.terminate()


if __name__ == "__main__":
    raise SystemExit(main())
