"""Who is admitted, and which port is whose: one judgement of an agent, by its card and by the site file.

| why not | what it means | until |
|---|---|---|
| `unknown_type` | the catalogue has no such type | its card names another, or the engine is started anew |
| `other_type` | its card names another type than before, while the machine was in use | its next card |
| `wire_version` | it speaks another version of the wire | its next card |
| `datum` | its heights count from another ground than ours | its next card |
| `wire_lacks` | the site is `real`, and its wire does not guarantee what that demands | it comes back on another wire |
| `unlisted` | the site is `real` and does not list it | a person adds it to the fleet, or the engine is started anew |
| `no_port` | no port is free for it | its next card |

Asked at each card, and for each agent when the engine is started anew. A machine in use is let go only when it rests: what
the site file no longer lists stays under our control in the air (`AgentRecord.refused_at_rest`).
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from formiga_bt.base.machines import MOVING
from formiga_bt.base.wires import unaccepted
from formiga_bt.engine.agents.announced import refusals
from formiga_bt.engine.goals.goals import Goals
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Alarm, CancelGoal, QueryGoal
from formiga_bt.engine.kernel.news import MustLeave
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.transport.messages import WIRE, AgentCard

TURNED_AWAY: Final = ("datum", "other_type", "unknown_type", "wire_version")
"""For these a machine that was admitted is quarantined at once, also in the air: where it would go cannot be said to it."""


COMES_BACK: Final = ("lost", "bad_status", *TURNED_AWAY)
"""Of a machine that is quarantined for these, and admitted, a status is enough: it is asked what it does, and comes home."""


class Admission:
    """Judges agents, and makes their records."""

    def __init__(self, core: Core, goals: Goals) -> None:
        self._core = core
        self._goals = goals

    # -- cards, and the site file ------------------------------------------------------------------------------------
    def admit(self, card: AgentCard, wall: int, wire: str = "", lacks: tuple[str, ...] = ()) -> None:
        """Make the record of an agent that was never seen before."""
        core = self._core
        kind = core.catalogue.types.get(card.type)
        less = self.unaccepted(wire, lacks)
        refused, home = self.judge(card.id, card.type, datum=card.datum, version=card.wire, less=bool(less))
        agent = AgentRecord(
            id=card.id,
            type=card.type,
            mobility=kind.mobility if kind else card.mobility,
            shared=kind.shared if kind else False,
            actions=self.known(card),
            refused_actions=refusals(card, core.catalogue),
            on_link_loss="" if card.mobility not in MOVING else card.on_link_loss,
            limits=dict(card.limits),
            avoids=card.avoids,
            present=True,
            wire=wire,
            lacks=lacks,
            liveness="ALIVE",
            home="" if refused else home,
            boot_id=card.boot_id,
            heard_at=core.now,
            heard_wall=wall,
            refused=refused,
            order=core.count("agent"),
            control="engine" if kind and kind.human else "unknown",
        )
        core.emit(ch.AgentPut(agent))
        if refused:
            text = f"{card.id} ({card.type}) is not admitted: {_in_words(refused, card, wire, less)}"
            core.effect(Alarm("not_admitted", text, "", card.id))
        self._report_refusals(agent)

    def judge_anew(self, card: AgentCard) -> None:
        """A known agent announced itself again: what its card says may have been mended, or be wrong now."""
        core, agent = self._core, self._core.state.agents[card.id]
        less = self.unaccepted(agent.wire, agent.lacks)
        refused, home = self.judge(
            card.id, card.type, home=agent.home, datum=card.datum, version=card.wire, less=bool(less)
        )
        if card.type != agent.type and not self._retype(agent, card):
            refused = "other_type"
        agent = core.state.agents[card.id]
        if agent.refused_at_rest == "wire_lacks" != refused:
            agent = core.put_agent(agent.id, refused_at_rest="")
        if refused == agent.refused:
            if refused and agent.pool == "QUARANTINED":
                core.effect(QueryGoal(agent.id))  # what it still does is called off
            return
        if not refused:
            core.put_agent(agent.id, refused="", home=home)
        elif refused == "wire_lacks" and not agent.refused and not agent.human and self.is_in_use(agent):
            if not agent.refused_at_rest:
                core.put_agent(agent.id, refused_at_rest=refused)
                text = f"{agent.id} is in use and not admitted any more: {_in_words(refused, card, agent.wire, less)}"
                core.effect(Alarm("not_admitted", f"{text}; it comes home, but gets no new task", agent.task, agent.id))
        elif agent.refused or refused in (
            *TURNED_AWAY,
            "wire_lacks",
        ):  # else it is as it was judged at the start
            self._turn_away(agent, refused, _in_words(refused, card, agent.wire, less))

    def _retype(self, agent: AgentRecord, card: AgentCard) -> bool:
        """Let an agent be of another type than before; return False if it is ours as it was, and in use."""
        core, kind = self._core, self._core.catalogue.types.get(card.type)
        ours = not agent.refused or agent.pool == "QUARANTINED"
        mobility = kind.mobility if kind is not None else card.mobility
        if ours and (mobility != agent.mobility or self.is_in_use(agent)):
            return False
        core.put_agent(agent.id, refused="other_type")  # one less of its former type
        core.put_agent(agent.id, type=card.type, mobility=mobility, shared=kind is not None and kind.shared)
        return True

    def _turn_away(self, agent: AgentRecord, why: str, words: str = "") -> None:
        """What was admitted cannot be any more: the machine leaves its task, and what it still does is called off."""
        core = self._core
        used = not agent.refused and not agent.human and self.is_in_use(agent)
        text = f"{agent.id} ({agent.type}) is not admitted: {words or why}"
        if used:
            text += "; it was in use: it leaves its task, and only hold and cut reach it"
            core.effect(Alarm("not_admitted", text, agent.task, agent.id))
            for goal in [goal for goal in core.index.goals_of(agent.id) if goal.in_flight]:
                core.effect(CancelGoal(goal.id, agent.id, goal.action))
            self._goals.lose(agent.id, "lost")
            core.report(MustLeave(agent.id, why))
            if core.state.agents[agent.id].quarantine in ("asked", *COMES_BACK):
                core.put_agent(agent.id, quarantine=why)
            core.effect(QueryGoal(agent.id))
        else:
            core.effect(Alarm("not_admitted", text, "", agent.id))
        core.put_agent(agent.id, refused=why, refused_at_rest="")

    def read_anew(self) -> None:
        """The engine was started anew: who is admitted, and each machine's port, are as the site file says now."""
        for agent in list(self._core.state.agents.values()):
            self.judge_by_list(agent)

    def judge_by_list(self, agent: AgentRecord) -> None:
        """Who is listed, or where an agent's home is, may be otherwise now: judge it by that, and by its last card."""
        core = self._core
        datum = "other" if agent.refused == "datum" else "local"
        version = 0 if agent.refused == "wire_version" else WIRE
        less = bool(self.unaccepted(agent.wire, agent.lacks))
        refused, home = self.judge(agent.id, agent.type, home=agent.home, datum=datum, version=version, less=less)
        if agent.refused == "other_type" and refused in ("", "unlisted", "no_port"):
            refused = "other_type"
        used = not agent.refused and self.is_in_use(agent)
        if used and refused == "unknown_type":
            self._turn_away(agent, refused)
            return
        stays = used and refused in ("unlisted", "no_port", "wire_lacks")
        core.put_agent(
            agent.id,
            refused="" if stays else refused,
            refused_at_rest=refused if stays and not agent.human else "",
            home=home if stays or not refused else "",
        )
        if stays and not agent.human:
            text = f"{agent.id} is in use and not admitted any more: {refused}; it can be stopped and comes home"
            core.effect(Alarm("not_admitted", f"{text}, but gets no new task", agent.task, agent.id))

    def let_go(self, agent_id: str) -> None:
        """A machine that is admitted no more rests, and nothing holds it: it is no longer ours."""
        agent = self._core.state.agents[agent_id]
        if agent.refused_at_rest and agent.pool != "QUARANTINED" and not self.is_in_use(agent):
            self._core.put_agent(agent_id, refused=agent.refused_at_rest, refused_at_rest="")

    # -- the judgement -----------------------------------------------------------------------------------------------
    def judge(
        self,
        agent_id: str,
        type_name: str,
        *,
        home: str = "",
        datum: str = "local",
        version: int = WIRE,
        less: bool = False,
    ) -> tuple[str, str]:
        """Return why an agent is not admitted, or "", and the port that is, or would be, its own.

        Args:
            agent_id: whose.
            type_name: as its card says.
            home: its port until now; it keeps it unless the site gives it to another, or has it no more.
            datum: as its card says.
            version: of the wire, as its card says.
            less: its wire does not guarantee what the site demands.
        """
        core = self._core
        kind, listed = core.catalogue.types.get(type_name), core.listed(agent_id)
        if kind is None:
            return "unknown_type", ""
        if not kind.flies:
            home = listed.home if listed is not None else ""
        elif listed is not None and (agent_id in core.site.agents or listed.home in core.site.ports):
            home = listed.home
        elif home not in core.site.ports or home in core.homes():
            home = self.free_port(agent_id)
        if version != WIRE:
            return "wire_version", home
        if datum != "local":
            return "datum", home
        if listed is None and core.site.mode == "real":
            return "unlisted", home
        if less and not kind.human:
            return "wire_lacks", home
        return "" if home or not kind.flies else "no_port", home

    def unaccepted(self, wire: str, lacks: tuple[str, ...]) -> tuple[str, ...]:
        """Return what a wire lacks that the site demands: all that it has not accepted by name, in mode real."""
        site = self._core.site
        return unaccepted(lacks, site.accept_missing.get(wire, ())) if lacks and site.mode == "real" else ()

    def free_port(self, agent_id: str) -> str:
        """Return a port that is no other agent's own; "" = none is left."""
        core = self._core
        taken = {agent.home for agent in core.state.agents.values() if agent.id != agent_id} | set(core.homes())
        return next((name for name in core.site.ports if name not in taken), "")

    def known(self, card: AgentCard) -> tuple[str, ...]:
        """Return what an agent announces that its type has, and that does not contradict the catalogue."""
        kind = self._core.catalogue.types.get(card.type)
        refused = refusals(card, self._core.catalogue)
        return tuple(one for one in card.names if (kind is None or one in kind.actions) and one not in refused)

    def take_refusals(self, card: AgentCard) -> None:
        """A known agent announced itself again: note what of its card cannot be used, and report what is new of that."""
        core = self._core
        agent, now = core.state.agents[card.id], refusals(card, core.catalogue)
        if now != agent.refused_actions:
            self._report_refusals(core.put_agent(card.id, refused_actions=now), but=agent.refused_actions)

    def _report_refusals(self, agent: AgentRecord, but: Mapping[str, str] = MappingProxyType({})) -> None:
        for name, why in agent.refused_actions.items():
            if but.get(name) != why:
                text = f"{agent.id}: {name} is refused: {why}. Let both say the same"
                self._core.effect(Alarm("action_refused", text, "", agent.id))

    def is_in_use(self, agent: AgentRecord) -> bool:
        """Return whether a machine does something for us, or may be in the air: it is not let go of then."""
        goals = any(not goal.ended for goal in self._core.index.goals_of(agent.id))
        ordered = agent.id in self._core.state.orders
        return bool(agent.task) or goals or ordered or agent.may_be_airborne


def _in_words(refused: str, card: AgentCard, wire: str = "", less: tuple[str, ...] = ()) -> str:
    if refused == "wire_lacks":
        return f"{refused}: {wire} does not guarantee {', '.join(less)}"
    if refused != "wire_version":
        return refused
    return f"{refused}: it speaks version {card.wire} of the wire, this engine {WIRE}"
