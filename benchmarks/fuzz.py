"""Whatever a file holds, check, fmt and fix answer with success or with located problems: in 2 s, in 500 MB, with no traceback.

python benchmarks/fuzz.py [--minutes N] [--seed N] [--keep FOLDER]

Files are made from the shipped ones and from the museum of mistakes: lines and words moved about, tokens of other files, random
bytes, YAML bombs, deep nesting, hostile expressions, odd characters, lines of a megabyte. What breaks the promise is printed
and kept. The same maker gives the quick part of the suite (tests/property/test_fuzz.py).
"""

import argparse
import resource
import sys
import time
import traceback
from pathlib import Path
from random import Random

from tests.property.hostile import BrokenPromiseError, hostile_text, try_all

MOST_MB = 500


def main() -> int:
    """Fuzz for a while; return 1 if anything broke the promise."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, default=Path("fuzz_found"))
    given = parser.parse_args()
    end = time.monotonic() + given.minutes * 60
    number, bad, slowest, slowest_at = given.seed, 0, 0.0, 0
    while time.monotonic() < end:
        text = hostile_text(Random(number))
        try:
            seconds = try_all(text)
        except BrokenPromiseError as failure:
            bad += 1
            _keep(given.keep, number, text, str(failure))
        except Exception:  # noqa: BLE001 - any at all is what is looked for
            bad += 1
            _keep(given.keep, number, text, traceback.format_exc())
        else:
            if seconds > slowest:
                slowest, slowest_at = seconds, number
        number += 1
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{number - given.seed} files, {bad} bad; slowest {slowest:.2f} s (seed {slowest_at}); peak {peak:.0f} MB")
    return int(bad > 0 or peak > MOST_MB)


def _keep(folder: Path, number: int, text: str, why: str) -> None:
    folder.mkdir(exist_ok=True)
    (folder / f"{number}.yaml").write_text(text, encoding="utf-8", errors="surrogatepass")
    (folder / f"{number}.txt").write_text(why, encoding="utf-8", errors="surrogatepass")
    print(f"seed {number}: {why.strip().splitlines()[-1][:200]}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
