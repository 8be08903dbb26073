"""Edits for machines that come home although they shall stay where they were sent last."""

from collections.abc import Iterator

from formiga_bt.llm.edits.steps import EditCase, Edited, put


def stays(case: EditCase) -> Iterator[Edited]:
    """The one machine that lands at the place where the request leaves it, and flies home then, stays there."""
    for machine in case.machines:
        own = case.of(machine.name)
        last = own[-1] if own else None
        landing = own[-2][1] if len(own) > 1 else {}
        if last is None or last[1].get("do") != "ReturnHome" or landing.get("do") != "FlyAndLand":
            continue
        if landing.get("at") == case.wrong.about:
            yield put(case.tree, last[0], []), f"{machine.name} stays at {case.wrong.about}, as the request says"
