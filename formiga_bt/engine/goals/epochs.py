"""Epochs: which start of an engine commands the site, as its agents tell it.

Agents follow the engine of the highest epoch that they believe (`transport.agent_side`: any below 2**31 is the first after an
agent's start, later ones come in steps of at most 1,000) and report it in each status. An engine that hears of a higher epoch
than its own is deposed: nothing leaves it any more until it is started anew, with an epoch that its agents accept
(`next_epoch`).
"""

from collections.abc import Iterable

from formiga_bt.base.bounds import EPOCH_STEP, MOST_EPOCH
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import EVERYTHING, Core
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.transport.messages import AgentStatus

DEPOSED = (
    "another engine commands this site: {agent} follows start {epoch}. This one, start {own}, sends nothing now. {help}"
)
TAKE_BACK = (
    "A site is served by one engine: look for a second formiga up or formiga demo, on other machines too. End it with formiga "
    "down, then take the site back here with formiga down and formiga up; or end this one and leave the site to the other"
)
IGNORED = (
    "{agent} heard of start {epoch} of an engine and ignores it: an agent follows starts below 2**31, and at most {step} above "
    "the one that it follows ({accepted}). Something that is no engine of this site publishes on its wire: find it"
)
IGNORES_US = (
    "{agent} ignores this engine: it follows start {accepted}, and start {own} is more than {step} above that. Start the agent "
    "anew while it stands on the ground"
)


OTHER = (
    "{agent} follows another engine ({other}); this one is {own}. It takes no goal from here before it has heard nothing of"
    " the other for 30 s. A site is served by one engine: look for a second formiga up, on other machines too"
)


def is_foreign(core: Core, status: AgentStatus) -> bool:
    """Return whether an agent follows an engine of another identity: its epochs are counted by that one."""
    return bool(status.engine_id) and bool(core.engine_id) and status.engine_id != core.engine_id


def heard(core: Core, agent: AgentRecord, status: AgentStatus) -> None:
    """Take what a status says of epochs. `agent` is its record from before."""
    own = core.state.epoch
    if is_foreign(core, status):
        if status.engine_id != agent.engine_id:
            text = OTHER.format(agent=agent.id, other=status.engine_id, own=core.engine_id)
            core.effect(Alarm("other_engine", text, agent.task, agent.id))
    elif status.epoch > own:
        depose(core, agent.id, status.epoch)
    if status.epoch_ignored and status.epoch_ignored != agent.epoch_ignored:
        text = IGNORES_US if status.epoch_ignored == own else IGNORED
        text = text.format(
            agent=agent.id, epoch=status.epoch_ignored, accepted=status.epoch, own=own, step=f"{EPOCH_STEP:,}"
        )
        core.effect(Alarm("epoch_ignored", text, agent.task, agent.id))


def depose(core: Core, agent: str, epoch: int = 0) -> None:
    """Send nothing any more, because an agent follows an engine of a later epoch (0: it did not say which)."""
    if core.state.counters.get("deposed"):
        return
    core.emit(ch.CounterSet("deposed", 1))
    core.stale.add(EVERYTHING)
    text = DEPOSED.format(agent=agent, epoch=epoch or "with a higher number", own=core.state.epoch, help=TAKE_BACK)
    core.effect(Alarm("deposed", text, "", agent))


def next_epoch(own: int, reported: Iterable[int]) -> int:
    """Return the epoch of an engine's next start: above its own, and one that as many agents as possible accept.

    Args:
        own: of the present start.
        reported: what each agent follows; one that a forger led far away is outvoted, and must be started anew.
    """
    follow = [epoch for epoch in reported if epoch > 0]
    best, most = own + 1, -1
    for epoch in sorted({own + 1, *(epoch + 1 for epoch in follow if own < epoch < MOST_EPOCH)}):
        accept = sum(one < epoch <= one + EPOCH_STEP for one in follow)
        if accept > most:
            best, most = epoch, accept
    return best
