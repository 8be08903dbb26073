"""Why a task, or a step of one, gets no agents: its place in the queue, and for each agent which filter refused it."""

from collections.abc import Iterator, Sequence
from typing import Final

from formiga_bt.engine.kernel.records import AgentRequest, RoleRequest, TaskRecord, Verdict
from formiga_bt.show.facts import Because
from formiga_bt.show.why.aside import detail, making_room
from formiga_bt.show.why.follow import behind_machine, behind_task
from formiga_bt.show.why.scene import WhyScene, deeper
from formiga_bt.show.why.words import (
    BLOCKED,
    BLOCKED_HINTS,
    DOUBLE,
    VERDICT_HINTS,
    VERDICTS,
    quarantine_hint,
    say,
    span,
)

OTHER_ROLE: Final = frozenset({"wrong_type", "not_this_one"})
"""Refusals that say nothing about the agent; left out where others remain."""
BY_ITSELF: Final = ("preempting", "busy", "kept", "reserved", "airborne", "not_idle", "battery", "energy", "by_hand")
"""Refusals that pass without a person, told first."""
FOR_EVER: Final = ("no_action", "failed_before")
"""Refusals that waiting does not change, told last."""
ALIKE: Final = 4
"""Of agents refused for the same reason so many are told one by one."""
FIRST: Final = "formiga run --priority high is served before it; formiga tasks shows who has what it waits for"
FOLLOWED: Final = 3
"""So many tasks that keep agents busy are looked into."""


def waiting(scene: WhyScene, task: TaskRecord) -> Iterator[Because]:
    """Explain a PENDING task."""
    request = scene.state.requests.get(task.id)
    waited = span(scene.now - task.times.submitted_at)
    if request is None:
        yield Because("pending", f"it was requested {waited} ago and is about to start")
        return
    if not request.is_ripe:
        yield from _not_yet(scene, task, request)
        return
    yield Because("pending", f"it waits for agents since {waited}; all of its roles are granted together")
    yield from deeper(_queue(scene, request))
    yield from deeper(asked(scene, request))


def _not_yet(scene: WhyScene, task: TaskRecord, request: AgentRequest) -> Iterator[Because]:
    """Tell what a request waits for before it stands in the queue."""
    yield Because("pending", "it does not wait for agents yet", f"formiga abort {task.id}")
    if request.not_before is not None:
        yield Because("not_before", f"it begins in {span(request.not_before - scene.now)} at the earliest", depth=1)
    for name in request.after:
        other = scene.state.tasks.get(name)
        yield Because("after", f"it begins once {name} has succeeded", f"formiga why {name}", depth=1)
        if other is not None:
            yield from deeper(deeper(behind_task(scene, other, (task.id,))))


def _queue(scene: WhyScene, request: AgentRequest) -> Iterator[Because]:
    queued = [one for one in scene.state.requests.values() if one.is_ripe]
    ranks = sorted((one.rank(scene.now), one.holder) for one in queued)
    ahead = [holder for rank, holder in ranks if rank < request.rank(scene.now)]
    if ahead:
        names = ", ".join(ahead[:3]) + (" ..." if len(ahead) > 3 else "")
        verb = "waits" if len(ahead) == 1 else "wait"
        text = (
            f"it is number {len(ahead) + 1} of {len(queued)}: {len(ahead)} of the same or a higher priority {verb} before "
            f"it ({names}); its own is {request.priority}"
        )
        yield Because("queue", text, FIRST if request.priority != "high" else "")
    elif len(queued) > 1:
        yield Because(
            "queue", f"it is number 1 of {len(queued)}: none of the same or a higher priority waits before it"
        )


def asked(scene: WhyScene, request: AgentRequest) -> Iterator[Because]:
    """Tell how a request stands: its roles, who steps aside for it, and when it gives up."""
    verdicts = scene.state.explanations.get(request.task)
    if verdicts is None:
        yield Because("not_looked", "the allocator has not looked at it yet")
        return
    for verdict in verdicts:
        if not verdict.role and verdict.code != "lockdown":
            text = say(BLOCKED, verdict.code, detail=verdict.detail)
            yield Because(verdict.code, text, BLOCKED_HINTS.get(verdict.code, ""))
    roles = [(role, [v for v in verdicts if v.role == role.role]) for role in request.roles]
    for role, mine in sorted(roles, key=lambda found: is_ready(*found)):  # what is missing comes first
        yield from role_lines(scene, request, role, mine)
    yield from making_room(request)
    waits = [role.wait_until for role in request.roles if role.wait_until is not None]
    if waits and request.wait_left is None:
        yield Because("no_agent", f"it gives up in {span(min(waits) - scene.now)} (the `wait` of its roles or request)")
    elif not waits and request.expires is None:
        yield Because("no_limit", "it waits as long as it takes", f"formiga abort {request.holder}")
    if request.expires is not None:
        yield Because("task_expired", f"it expires in {span(request.expires - scene.now)}")


def is_ready(role: RoleRequest, verdicts: Sequence[Verdict]) -> bool:
    """Return whether enough agents fit a role."""
    return sum(v.code in ("fits", "chosen") for v in verdicts) >= role.count


def role_lines(
    scene: WhyScene, request: AgentRequest, role: RoleRequest, verdicts: Sequence[Verdict]
) -> Iterator[Because]:
    """Tell of one role: who could take it, or why nobody can."""
    fit = [v.agent for v in verdicts if v.code in ("fits", "chosen")]
    least = "at least " if role.more else ""
    need = f"{least}{role.count} of " if role.count > 1 else ""
    if is_ready(role, verdicts):
        yield Because("role_ready", f"{role.role}: {', '.join(fit)} could do it", role=role.role)
        return
    types = "/".join(role.types) or "any type"
    some = f"; {', '.join(fit)} {'fits' if len(fit) == 1 else 'fit'}" if fit else ""
    yield Because("role_open", f"{role.role}: no {need}{types} that fits is free{some}", role=role.role)
    telling = [v for v in verdicts if v.code not in OTHER_ROLE and v.code not in ("fits", "chosen")]
    if not telling and not fit:
        what = f"'{role.id}'" if role.id else types
        hint = "is it running, and connected to this engine? formiga agents"
        yield Because("no_such_agent", f"no agent {what} is known to this engine", hint, role=role.role, depth=1)
    yield from deeper(refusals(scene, telling, request))


def refusals(scene: WhyScene, verdicts: Sequence[Verdict], request: AgentRequest | None = None) -> Iterator[Because]:
    """Tell why each agent was refused, what passes by itself first; behind a busy one, what keeps it busy."""
    codes = dict.fromkeys(v.code for v in sorted(verdicts, key=lambda v: _urgency(v.code)))
    followed: set[str] = set()
    for code in codes:
        alike = [v for v in verdicts if v.code == code]
        for verdict in alike[:ALIKE]:
            yield refused(verdict)
            if request is not None and len(followed) < FOLLOWED:
                yield from deeper(_behind(scene, verdict, request, followed))
        if len(alike) > ALIKE:
            rest = f"{len(alike) - ALIKE} more for the same reason ({code.replace('_', ' ')})"
            yield Because(code, rest, role=alike[0].role)


def refused(verdict: Verdict) -> Because:
    """Return why one agent was refused."""
    text = f"{verdict.agent} {say(VERDICTS, verdict.code, detail=detail(verdict))}"
    hint = VERDICT_HINTS.get(verdict.code, "").format(agent=verdict.agent)
    if (verdict.code, verdict.detail) == ("quarantined", DOUBLE):
        hint = quarantine_hint(verdict.agent, DOUBLE)
    return Because(verdict.code, text, hint, verdict.agent, verdict.role)


def _urgency(code: str) -> tuple[int, int]:
    if code in BY_ITSELF:
        return 0, BY_ITSELF.index(code)
    return (2, 0) if code in FOR_EVER else (1, 0)


def _behind(scene: WhyScene, verdict: Verdict, request: AgentRequest, followed: set[str]) -> Iterator[Because]:
    """Tell what keeps a busy agent busy."""
    if verdict.code not in ("busy", "kept", "airborne", "not_idle"):
        return
    task = scene.state.tasks.get(verdict.detail)
    if task is None and verdict.code == "busy" and verdict.detail in scene.state.requests:
        return  # another request takes it at this look: the queue tells
    if task is not None and task.id != request.holder:
        if task.id not in followed:
            followed.add(task.id)
            yield from behind_task(scene, task, (request.holder,))
    elif task is None:
        yield from behind_machine(scene, verdict.agent)
