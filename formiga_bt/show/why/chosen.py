"""Why these agents: the cost of each chosen one beside those of others that fitted, and who was passed over."""

from collections.abc import Iterator, Sequence
from typing import Final

from msgspec.structs import replace

from formiga_bt.base.geo import mm
from formiga_bt.engine.allocator.cost import BY_HAND, M_PER_POINT, PREFERRED, UNREACHABLE
from formiga_bt.engine.kernel.records import TaskRecord, Verdict
from formiga_bt.show.facts import Because
from formiga_bt.show.why.scene import WhyScene, deeper
from formiga_bt.show.why.waiting import OTHER_ROLE, refusals
from formiga_bt.show.why.words import span

OTHERS: Final = 5
"""So many that fitted too are named, the best first."""


def chosen(scene: WhyScene, task: TaskRecord) -> Iterator[Because]:
    """Tell who was chosen for each role of a task, or for a failed one why nobody was."""
    verdicts = scene.state.explanations.get(task.id, ())
    for role in dict.fromkeys(v.role for v in verdicts if v.role):
        of_role = [v for v in verdicts if v.role == role]
        picked = [v for v in of_role if v.code == "chosen"]
        refused = [v for v in of_role if v.code not in OTHER_ROLE and v.code not in ("chosen", "fits")]
        if picked:
            yield _choice(scene, role, picked, [v for v in of_role if v.code == "fits"])
            for line in refusals(scene, refused):  # of that instant: what helped then need not help now
                yield replace(line, text=f"passed over then: {line.text}", hint="", depth=1)
        elif task.status != "SUCCEEDED":
            fit = ", ".join(v.agent for v in of_role if v.code == "fits")
            yield Because("role_open", f"{role}: " + (f"only {fit} fitted" if fit else "nobody fitted"), role=role)
            if not refused and not fit:
                yield Because("no_such_agent", "no agent of that kind is known to this engine", role=role, depth=1)
            yield from deeper(refusals(scene, refused))


def _choice(scene: WhyScene, role: str, picked: Sequence[Verdict], others: Sequence[Verdict]) -> Because:
    names = ", ".join(with_cost(scene, v) for v in picked)
    rest = sorted(others, key=lambda v: v.cost or 0.0)
    more = f" and {len(rest) - OTHERS} more" if len(rest) > OTHERS else ""
    told = ", ".join(with_cost(scene, v) for v in rest[:OTHERS]) + more
    return Because("chosen", f"{role} = {names}{_reason(picked, rest)}" + (f": {told}" if rest else ""), role=role)


def _reason(picked: Sequence[Verdict], others: Sequence[Verdict]) -> str:
    if not others:
        return ", the only one that fitted" if len(picked) == 1 else ", all that fitted"
    costs = [v.cost or 0.0 for v in (*picked, *others)]
    if len(picked) == 1 and costs[0] <= BY_HAND / 2:
        return ", which a person gave it; others that fitted"
    if len(picked) == 1 and costs[0] <= PREFERRED / 2:
        return ", which was asked for; others that fitted"
    if len(set(costs)) == 1:
        return "; others that fitted"
    charged = all(v.short == 0 for v in picked) and any(v.short for v in others)
    if max(_way_m(v) for v in (*picked, *others)) == 0.0:
        return f", {'with charge to spare' if charged else 'with the most charge'}; others that fitted"
    if len(picked) > 1:
        return ", nearest as a team; others that fitted"
    if _way_m(picked[0]) == min(_way_m(v) for v in (*picked, *others)):
        return ", the nearest; others that fitted"
    return f", the nearest {'with charge to spare' if charged else 'for its charge'}; others that fitted"


def with_cost(scene: WhyScene, verdict: Verdict) -> str:
    """Return an agent with what choosing it costs: `hwd_1 (410 m, 41 s away)`."""
    cost = verdict.cost
    if cost is None or cost == 0.0:
        return verdict.agent
    if cost <= BY_HAND / 2:
        return f"{verdict.agent} (by hand)"
    if cost < 0.0:
        return f"{verdict.agent} (preferred)"
    agent = scene.state.agents.get(verdict.agent)
    if agent is not None and agent.human and cost >= UNREACHABLE:
        return f"{verdict.agent} (unreachable then)"
    told = "; ".join(part for part in (_far(scene, verdict), verdict.detail) if part)
    return f"{verdict.agent} ({told})"


def _far(scene: WhyScene, verdict: Verdict) -> str:
    way = _way_m(verdict)
    if way == 0.0:
        return ""
    metres = f"{way:.0f} m" if way < 10_000 else f"{way / 1000:.0f} km"
    speed = scene.speed_m_s(verdict.agent)
    return f"{metres}, {span(round(way / speed * 1e6))} away" if speed else f"{metres} away"


def _way_m(verdict: Verdict) -> float:
    """Return how far it was: its cost without what counts for too little charge."""
    return max(0.0, mm((verdict.cost or 0.0) - M_PER_POINT * verdict.short))
