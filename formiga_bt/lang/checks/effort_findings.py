"""What is told of too much effort: W064 for time and charge, W063 for a way that nothing may fly, W096 for hovering."""

import math
from collections.abc import Iterable, Mapping

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Position
from formiga_bt.base.units import format_quantity
from formiga_bt.lang.checks.flight import hovering
from formiga_bt.lang.checks.spending import RoleSpending, Sum, Where
from formiga_bt.lang.model import (
    ActionSpec,
    Ask,
    Do,
    Expr,
    Role,
    Site,
    Step,
)
from formiga_bt.lang.site.fence import breaks, enters, leaves
from formiga_bt.lang.text.reading import Problems


class OncePerMark:
    """Reports each mark once."""

    def __init__(self, spending: RoleSpending, site: Site | None, answer_s: float, problems: Problems) -> None:
        self._spending = spending
        self._site = site
        self._answer_s = answer_s
        self._problems = problems
        self._told: set[Mark] = set()

    def check_leg(self, to: Expr, start: Position | None, end: Position) -> None:
        """Report W063 for a way between two known points that goes where nothing may fly; the points are told by themselves."""
        if start is None or any(leaves(one, self._site) or enters(one, self._site) for one in (start, end)):
            return
        what = breaks(start, end, self._site)
        if what and to.mark not in self._told:
            self._told.add(to.mark)
            self._problems.add("W063", to.mark, what, "fly round it, over a place between")

    def check_way(self, step: Do, seconds: float, spec: ActionSpec) -> None:
        """Report W064 for a timeout that is shorter than the way, though not shorter than the action usually takes."""
        bound = step.timeout
        if bound is not None and bound.is_const and seconds > bound.const >= spec.typical_us / 1e6:
            self._report(bound, f"a way of about {_about(seconds)}, timeout is {_exact(bound.const)}")

    def check_timeout(self, what: str, seconds: float, bound: Expr | None, key: str = "timeout") -> None:
        """Report W064 for a timeout that is shorter than what it bounds takes."""
        if bound is None or not bound.is_const or not isinstance(bound.const, int | float) or seconds <= bound.const:
            return
        self._report(bound, f"{what} takes about {_about(seconds)}, {key} is {_exact(bound.const)}")

    def _report(self, bound: Expr, what: str) -> None:
        if bound.mark not in self._told:
            self._told.add(bound.mark)
            self._problems.add("W064", bound.mark, what, "make it longer, or the path shorter")

    def check_hover(self, step: Step, who: Mapping[str, str], at: Where, bounds: Iterable[float]) -> None:
        """Report W096 for a wait that lasts longer than a machine in the air can hover."""
        seconds = hovering.waiting_s(step)
        if seconds is None or step.timeout is None or step.timeout.mark in self._told:
            return
        for role in hovering.who_waits(step, at, who):
            powers = self._spending.powers.get(role, {})
            most = hovering.longest_hover_s(powers, {name: self._spending.reserve(name) for name in powers})
            if min([seconds, *bounds]) > most:
                self._told.add(step.timeout.mark)
                hovering.report(step, role, most, self._problems)
                return

    def check_hand_over(self, role: Role) -> None:
        """Report W064 for a role that would be handed over only after its charge has breached the reserve."""
        late = role.hand_over_at
        if late is None or not late.is_const or late.mark in self._told:
            return
        reserve = self._spending.least_reserve(role)
        if late.const > reserve:
            return
        self._told.add(late.mark)
        what = f"hand_over_at {late.const:g} % is within the reserve of {reserve:g} %: its breach ends the task before"
        self._problems.add("W064", late.mark, what, f"hand over above {reserve:g} %, with what the way home takes")

    def check_escalation(self, step: Ask) -> None:
        """Report W064 for who is asked next before the first could answer, or never."""
        after, bound = step.escalate_after, step.timeout
        if after is None or not after.is_const or not isinstance(after.const, int | float) or after.mark in self._told:
            return
        what = ""
        if after.const < self._answer_s:
            what = (
                f"an answer usually takes {_exact(self._answer_s)}, the next one is asked after {_exact(after.const)}"
            )
        elif bound is not None and bound.is_const and after.const >= bound.const:
            what = f"timeout is {_exact(bound.const)}, so that after {_exact(after.const)} nobody is asked any more"
        if what:
            self._told.add(after.mark)
            self._problems.add("W064", after.mark, what, "between the time of an answer and the timeout")

    def check_charge(self, role: Role, spent: Sum) -> None:
        """Report W064 for a role of which no type has the charge for the path, whatever agent it gets."""
        powers = self._spending.powers.get(role.name, {})
        least = role.battery_min
        if not powers or (least is not None and not least.is_const):
            return
        charge = float(least.const) if least is not None else 100.0
        found = []
        for name, power in powers.items():
            seconds, points = spent.air.get((role.name, name), (0.0, 0.0))
            has = charge - self._spending.reserve(name)
            if points <= max(has, 0.0):
                return
            found.append((seconds, max(0.0, has) / power.cruise_pct_s, points + self._spending.reserve(name)))
        seconds, gives, needs = min(found)
        told = f"battery_min {charge:g} %" if least is not None else "a full battery"
        what = f"path of about {_about(seconds)}, {told} gives about {_about(gives)} over the reserve"
        mark = least.mark if least is not None else role.mark
        help_ = (
            f"battery_min: {math.ceil(needs)} %" if needs <= 100 else "shorten the path, or share it between machines"
        )
        self._problems.add("W064", mark, what, help_)


def _about(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def _exact(seconds: float) -> str:
    return format_quantity("duration", float(seconds))
