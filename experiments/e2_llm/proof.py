"""Proves that every request can be done, and that its oracle knows it: flies all references, and trees that are wrong.

python -m experiments.e2_llm.proof          about three minutes; exit code 1 if an oracle errs
"""

import sys
from collections.abc import Iterator
from itertools import pairwise

from experiments.e2_llm.fly import World, fly, world_of
from experiments.e2_llm.judging import judge
from experiments.e2_llm.oracles import ORACLES
from experiments.e2_llm.requests import Request, last_run, requests
from experiments.e2_llm.second_set import judge_tree, second_set
from experiments.e2_llm.verdicts import Verdict
from formiga_bt.base.packaged import folder


def reference_verdict(request: Request, world: World) -> Verdict:
    """Return what the oracle says of the shipped tree of a request."""
    text = (folder("trees") / f"{request.reference}.yaml").read_text(encoding="utf-8")
    return judge(request.task, request.goal, lambda scene: fly(text, request.values, world, scene), request.scenes)


def errors(world: World) -> Iterator[str]:
    """Iterate over all that is wrong with requests and oracles."""
    for task in ORACLES:
        for request in requests(task, world, last_run(task) + 1):
            verdict = reference_verdict(request, world)
            if not verdict.ok:
                yield f"{request.id}: the shipped tree is refused: {verdict}"
    flown = [one for one in second_set() if one.reference]
    for one in flown:
        verdict = judge_tree(one, one.reference, {}, world)
        if not verdict.ok:
            yield f"{one.id}: the reference is refused: {verdict}"
        for text in one.wrong:
            verdict = judge_tree(one, text, {}, world)
            if verdict.ok or "refused" in verdict.codes:
                yield f"{one.id}: a wrong tree is {verdict}"
    for before, one in pairwise(flown):
        if before.family == one.family and judge_tree(one, before.reference, {}, world).ok:
            yield f"{one.id}: the reference of {before.id} passes too"


def main() -> int:
    """Print what is wrong."""
    found = list(errors(world_of()))
    print("\n".join(found) or "every oracle accepts its references and refuses the wrong trees")  # noqa: T201
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
