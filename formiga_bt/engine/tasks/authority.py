"""Who may let a task fly: approvals and pilots of `mode: real`, and the lockdown that admits nobody.

Three questions, each with its own code:

| asked | by | codes |
|---|---|---|
| may this task be requested? | each Submit | `lockdown`, `not_approved` |
| may this request be granted now? | each look of the allocator | `lockdown`, `not_approved`, `no_pilot`, or not yet (`when`) |
| who is its pilot? | each grant | |

System tasks (recover, orders) are asked none of them: a machine in the air always comes home.
"""

from collections.abc import Collection, Mapping, Sequence
from typing import Final

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.allocator.preemption import parents_of, why_not_preemptible
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core, clock_stands
from formiga_bt.engine.kernel.inputs import Alarm, Approve, Duty, Submit
from formiga_bt.engine.kernel.records import PRIORITIES, AgentRequest, Approval
from formiga_bt.engine.kernel.rule_records import RuleCause
from formiga_bt.engine.tasks.when import why_not_yet
from formiga_bt.lang.model import Task
from formiga_bt.safety.approval import (
    RULES,
    TYPED,
    approval_digest,
    check_approver,
    needs_another,
    others_than,
    rules_digest,
    same_person,
)
from formiga_bt.safety.drafted import UNNAMED, Drafted

APPROVERS: Final = "approvers"
"""The site's people role that may approve."""
NOBODY_ELSE: Final = "nobody else is named in site.yaml under people: approvers"


class Authority:
    """Reads and writes `state.approvals` and `state.duty`; keeps nothing itself."""

    def __init__(self, core: Core) -> None:
        self._core = core

    # -- a person's word -------------------------------------------------------------------------------------------
    def take(self, given: Approve | Duty) -> None:
        """Record an approval, or a pilot's coming and going.

        Raises:
            TaskError: `not_approver`, `not_approved` (nothing to take back), `unknown_pilot`.
        """
        if isinstance(given, Approve):
            self._approve(given)
        else:
            self._duty(given)

    def _approve(self, given: Approve) -> None:
        core = self._core
        check_approver(core.site, given.by)
        old = core.state.approvals.get(given.digest)
        if given.revoke:
            if old is None:
                raise TaskError("not_approved", f"{given.task} ({short(given.digest)}) is not approved")
            core.emit(ch.ApprovalPut(given.digest, None))
            return
        why = self._why_not_by(given)
        if why and not given.at:
            raise TaskError("not_approver", why)
        if old is None or (old.task, old.by) != (given.task, given.by):
            core.emit(ch.ApprovalPut(given.digest, Approval(task=given.task, by=given.by, at=given.at or core.now)))

    def _duty(self, given: Duty) -> None:
        core = self._core
        if given.pilot not in core.site.pilots:
            known = ", ".join(core.site.pilots) or "none"
            raise TaskError("unknown_pilot", f"{given.pilot} is no pilot of {core.site.name}; it has {known}")
        if given.on == (given.pilot in core.state.duty):
            return
        core.emit(ch.DutyPut(given.pilot, core.now if given.on else None))
        machines = self._machines_of(given.pilot)
        if machines and not given.on:
            text = f"{given.pilot} went off duty; still under that name: {', '.join(machines)}"
            core.effect(Alarm("pilot_off_duty", text))

    # -- admission -------------------------------------------------------------------------------------------------
    def admit(self, request: Submit) -> None:
        """Let a request in, or not.

        Raises:
            TaskError: `lockdown`, or `not_approved`, with what to do; `unknown_task`, `not_served`.
        """
        locked = self._locked()
        if locked:
            raise TaskError("lockdown", f"{locked}; no task is admitted before it is released")
        lack = self._lack(self._core.library.wanted(request), request.by, request.cause)
        if lack:
            raise TaskError("not_approved", lack)

    def _locked(self) -> str:
        lockdown = self._core.state.lockdown
        return "" if lockdown is None else f"the site is locked down by {lockdown.by or 'an operator'}"

    def _lack(self, task: Task, requester: str, cause: RuleCause | None) -> str:
        """Return what is missing for this person's task to fly, or "". Who approved the rules requests what they start."""
        core = self._core
        if core.site.mode != "real":
            return ""
        if cause is not None:
            rules = core.state.approvals.get(rules_digest(core.site))
            if rules is None:
                return self._lack_of_rules()
            requester = rules.by
        digest = approval_digest(task, core.site)
        approval = core.state.approvals.get(digest)
        how = f"formiga approve {task.name} --by NAME"
        who = ", ".join(core.site.people.get(APPROVERS, ())) or "no approvers are named in site.yaml"
        wrote = core.state.drafted.get(task.bundle)
        if approval is None and wrote is None:
            return f"{task.name} ({short(digest)}) is not approved as it is now; an approver ({who}) must: {how}"
        if not needs_another(task, core.catalogue, by_program=wrote is not None):
            return ""
        approved_by = approval.by if approval is not None else ""
        if wrote is not None:
            return self._lack_of_drafted(task, wrote, requester, approved_by)
        if requester in UNNAMED:
            return f"{task.name} lands away from home, so that its requester must be named, and another than who approved it"
        if same_person(requester, approved_by):
            return (
                f"{task.name} lands away from home, so that another person than its requester {requester} must approve it"
                f" ({who}): {how}"
            )
        return ""

    def _lack_of_rules(self) -> str:
        site = self._core.site
        who = ", ".join(site.people.get(APPROVERS, ())) or "no approvers are named in site.yaml"
        what = f"the rules of {site.name} ({short(rules_digest(site))}) are not approved as they are now"
        return f"{what}; an approver ({who}) must: formiga approve {RULES} --by NAME"

    def _lack_of_drafted(self, task: Task, wrote: Drafted, requester: str, approved_by: str) -> str:
        """Return what is missing for a task that a model wrote: the word of one who neither had it written nor requests it."""
        told = f"{task.name} {wrote.told}"
        named = requester not in UNNAMED
        others = others_than(
            (*wrote.people, requester) if named else wrote.people, self._core.site.people.get(APPROVERS, ())
        )
        another = f"another approver ({', '.join(others)})" if others else f"another approver ({NOBODY_ELSE})"
        must = f"{another} must: formiga approve {task.name} --by NAME"
        if not approved_by:
            digest = approval_digest(task, self._core.site)
            return f"{task.name} ({short(digest)}) is not approved as it is now, and {wrote.told}; {must}"
        if any(same_person(one, approved_by) for one in wrote.people):
            return f"{told}, who cannot approve it alone; {must}"
        if not named:
            return f"{told}, so that its requester must be named, and another than {approved_by}, who approved it"
        if same_person(requester, approved_by):
            return f"{told}, and {requester}, who requests it, approved it; {must}"
        return ""

    def _why_not_by(self, given: Approve) -> str:
        """Return why this approver's word does not count for this version, or ""."""
        core = self._core
        for model in core.library.kept(given.task):
            wrote = core.state.drafted.get(model.bundle)
            if wrote is None or approval_digest(model, core.site) != given.digest:
                continue
            if any(same_person(one, given.by) for one in wrote.people):
                others = others_than(wrote.people, core.site.people.get(APPROVERS, ()))
                return (
                    f"{given.task} {wrote.told}; another approver ({', '.join(others) or NOBODY_ELSE}) must approve it"
                )
        return ""

    def came_back(self, *, long: bool, taken_back: Collection[str] = ()) -> None:
        """The engine was away: nobody is on duty any more after a long time, and approvals are by those who may give them.

        Args:
            long: the engine was away for long.
            taken_back: digests of approvals that stand no more.
        """
        core = self._core
        if long:
            for pilot in list(core.state.duty):
                core.emit(ch.DutyPut(pilot, None))
        approvers = core.site.people.get(APPROVERS, ())
        for digest, approval in list(core.state.approvals.items()):
            if approval.by not in approvers or digest in taken_back:
                core.emit(ch.ApprovalPut(digest, None))

    # -- grants ----------------------------------------------------------------------------------------------------
    def blocked(self, request: AgentRequest) -> tuple[str, str] | None:
        """Return (code, detail) of what keeps a waiting request from being granted now, whoever is free; or None."""
        core = self._core
        locked = self._locked()
        if locked:
            return "lockdown", locked
        if early := why_not_yet(request, core.site.timezone):
            return early
        task = core.task(request.holder)
        if request.node and clock_stands(task):
            return "held", ", ".join(task.hold.words)
        parent = core.state.tasks.get(task.family.parent) if not task.family.detached else None
        if parent is not None and clock_stands(parent):
            return "held", f"{parent.id}: {', '.join(parent.hold.words)}"
        lack = self._lack(core.model(task), task.request.by, task.request.cause)
        if lack:
            return "not_approved", lack
        if not self.pilot(request) and self._binds(request):
            return "no_pilot", self._why_no_pilot(request)
        return None

    def blocked_of(self, requests: Sequence[AgentRequest]) -> dict[str, tuple[str, str]]:
        """Return (code, detail) of those of the waiting requests, in order of service, that cannot be granted now.

        While a HIGH one waits for a pilot's room, lower ones get none of it.
        """
        found: dict[str, tuple[str, str]] = {}
        kept_for = ""
        for request in requests:
            why = self.blocked(request)
            if why is None and kept_for and request.priority != "high" and self._binds(request):
                why = "no_pilot", f"the room is kept for {kept_for}"
            if why is not None:
                found[request.task] = why
                if request.priority == "high" and why[0] == "no_pilot" and self._may_have_room(request):
                    kept_for = kept_for or request.task
        return found

    def step_aside_for(self, request: AgentRequest) -> tuple[str, ...]:
        """Return the tasks to preempt so that a pilot on duty gets room for a HIGH request: the fewest, lowest, newest.

        Empty if it is no HIGH request, if it cannot be done, or if enough room is on its way.
        """
        state = self._core.state
        best: tuple[str, ...] = ()
        spared = parents_of(self._core, request.holder)
        for pilot in state.duty if request.priority == "high" else ():
            if self._core.site.pilots[pilot] < machines_of(request):
                continue
            room, willing = self._room(pilot), []
            for task in [state.tasks[t] for t in self._core.open if state.tasks[t].agents.pilot == pilot]:
                machines = sum(a.task == task.id and not a.human for a in state.agents.values())
                if task.restart.why or task.status == "ENDING" or task.outcome.status:
                    room += machines
                elif (
                    task.id not in spared
                    and PRIORITIES[task.request.priority] > 0
                    and not why_not_preemptible(self._core, task)
                ):
                    willing.append((-PRIORITIES[task.request.priority], -task.order, task.id, machines))
            if room >= machines_of(request):
                return ()
            victims: list[str] = []
            for _, _, task_id, machines in sorted(willing):
                if room < machines_of(request):
                    victims.append(task_id)
                    room += machines
            if room >= machines_of(request) and (not best or len(victims) < len(best)):
                best = tuple(victims)
        return best

    def most_machines(self, request: AgentRequest) -> int | None:
        """Return how many machines a request may have at most, for want of pilots on duty; None = as many as there are."""
        return (
            max((self._core.site.pilots[p] for p in self._core.state.duty), default=0) if self._binds(request) else None
        )

    def _may_have_room(self, request: AgentRequest) -> bool:
        return any(self._core.site.pilots[p] >= machines_of(request) for p in self._core.state.duty)

    def _binds(self, request: AgentRequest) -> bool:
        return self._core.site.mode == "real" and machines_of(request) > 0

    def pilot(self, request: AgentRequest) -> str:
        """Return the pilot on duty who takes the machines of a request: the one with the most room; "" = none has enough."""
        if not self._binds(request):
            return ""
        own = self._core.task(request.holder).agents.pilot  # a task has one pilot, whatever it asks for later
        duty = [pilot for pilot in self._core.site.pilots if pilot in self._core.state.duty and own in ("", pilot)]
        rooms = [(self._room(pilot), pilot) for pilot in duty]
        fit = [(room, pilot) for room, pilot in rooms if room >= machines_of(request)]
        return max(fit, key=lambda one: one[0])[1] if fit else ""

    def trimmed(self, request: AgentRequest, roles: Mapping[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
        """Return granted agents without those beyond each role's count for which the pilot has no room."""
        pilot = self.pilot(request)
        room = self._room(pilot) - machines_of(request) if pilot else 0
        kept: dict[str, tuple[str, ...]] = {}
        for role in request.roles:
            agents = roles[role.role]
            if pilot and not role.shared:
                more = min(len(agents) - role.count, room)
                agents, room = agents[: role.count + more], room - more
            kept[role.role] = agents
        return kept

    def _room(self, pilot: str) -> int:
        return self._core.site.pilots[pilot] - len(self._machines_of(pilot))

    def _machines_of(self, pilot: str) -> list[str]:
        """Return the machines that tasks of a pilot hold and have not released."""
        state = self._core.state
        mine = {task for task in self._core.open if state.tasks[task].agents.pilot == pilot}
        return [agent.id for agent in state.agents.values() if agent.task in mine and not agent.human]

    def _why_no_pilot(self, request: AgentRequest) -> str:
        core = self._core
        if not core.site.pilots:
            return "the site names no pilots"
        on = [pilot for pilot in core.site.pilots if pilot in core.state.duty]
        if not on:
            return f"nobody of {', '.join(core.site.pilots)} is on duty"
        told = ", ".join(f"{p} has {len(self._machines_of(p))} of {core.site.pilots[p]}" for p in on)
        return f"it needs room for {machines_of(request)}; {told}"


def machines_of(request: AgentRequest) -> int:
    """Return how many machines a request asks for."""
    return sum(role.count for role in request.roles if not role.shared)


def short(digest: str) -> str:
    """Return the part of a digest that people type."""
    return digest[:TYPED]
