"""Claims of resources in a task's record: how they come, and when they go.

| how its block ends | when the claim goes |
|---|---|
| well | at once |
| it fails, or is stopped, and the task goes on | when what was stopped has ended |
| the same, and the task ends FAILED or CANCELED, or begins anew | when its machines are home and released |
"""

from msgspec.structs import replace

from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.drains import is_over
from formiga_bt.engine.kernel.records import AgentRequest, ResourceClaim
from formiga_bt.nodes.ends import Drain


def grant(core: Core, request: AgentRequest) -> None:
    """Give a block what it asked for."""
    task = core.task(request.holder)
    claim = ResourceClaim(units=request.units, at=core.now)
    core.put_part(task.id, "resources", claims={**task.resources.claims, request.node: claim})
    core.wake(task.id, request.node)


def give_back(core: Core, task_id: str, node: str) -> None:
    """A block has ended well."""
    held = core.task(task_id).resources.claims
    core.put_part(task_id, "resources", claims={key: claim for key, claim in held.items() if key != node})


def leave(core: Core, task_id: str, node: str, after: Drain) -> None:
    """A block failed or was stopped: `go_on` gives its claim back when it is time."""
    held = core.task(task_id).resources.claims
    if node in held:
        claim = replace(held[node], left=True, after=after)
        # Under a key of its own: a next attempt of the same block may ask before this one has ended.
        kept = {key: one for key, one in held.items() if key != node}
        core.put_part(task_id, "resources", claims={**kept, f"{node}!{core.state.seq}": claim})
        core.touch(task_id)


def go_on(core: Core, task_id: str) -> None:
    """Give back what blocks have left, as far as nothing of them goes on and the task does not end with it."""
    task = core.task(task_id)
    if task.outcome.status in ("FAILED", "CANCELED"):
        return
    claims = task.resources.claims
    kept = {
        key: claim
        for key, claim in claims.items()
        if not claim.left or not all(is_over(core.state, task, end) for end in claim.after)
    }
    if len(kept) < len(claims):
        core.put_part(task_id, "resources", claims=kept)
