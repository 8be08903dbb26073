"""Proves that the paper's form can do every request: flies the reference program of each.

python -m experiments.e2_llm.paper_form.proof [T6,T7]          about two minutes; exit code 1 if one is refused
"""

import sys
from collections.abc import Iterator, Sequence

from experiments.e2_llm.fly import World, world_of
from experiments.e2_llm.oracles import ORACLES
from experiments.e2_llm.paper_form.programs import reference
from experiments.e2_llm.paper_form.runs import judged_program
from experiments.e2_llm.requests import requests


def refused(tasks: Sequence[str], world: World) -> Iterator[str]:
    """Iterate over the reference programs that an oracle refuses."""
    for task in tasks:
        for request in requests(task, world):
            found = judged_program(request, reference(request, world), world)
            if not found.success:
                yield f"{request.id}: {found.said}"


def main(arguments: Sequence[str]) -> int:
    """Print what is refused."""
    tasks = arguments[0].split(",") if arguments else list(ORACLES)
    found = list(refused(tasks, world_of()))
    print("\n".join(found) or "every oracle accepts the reference programs")  # noqa: T201
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
