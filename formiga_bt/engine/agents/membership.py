"""Agents that people add to the fleet while the engine runs, and take out of it: no site file is written, no approval ends.

A member counts as listed: a site in mode real admits it, and its home is nobody else's. What the site file lists stays there.
"""

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.agents.admission import Admission
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import AddAgent, RemoveAgent
from formiga_bt.engine.kernel.records import Member
from formiga_bt.lang.model import AgentType
from formiga_bt.safety.approval import check_approver


class Membership:
    """Reads and writes `state.members`; keeps nothing itself."""

    def __init__(self, core: Core, admission: Admission) -> None:
        self._core = core
        self._admission = admission

    def take(self, given: AddAgent | RemoveAgent) -> None:
        """Add an agent, or remove one.

        Raises:
            TaskError: `in_site_file`, `not_approver`, `unknown_agent`, `unknown_type`, `other_type`, `unknown_home`,
                `home_taken`, `no_port`,
                `in_use`, `not_member`.
        """
        if given.agent in self._core.site.agents:
            raise TaskError("in_site_file", f"{given.agent} stands in the site file: change it there")
        restored = isinstance(given, AddAgent) and given.at
        if self._core.site.mode == "real" and not restored:
            check_approver(self._core.site, given.by)
        if isinstance(given, AddAgent):
            self._add(given)
        else:
            self._remove(given)

    def _add(self, given: AddAgent) -> None:
        core = self._core
        agent, old = core.state.agents.get(given.agent), core.state.members.get(given.agent)
        type_name = given.kind or (agent.type if agent is not None else "") or (old.type if old is not None else "")
        if not type_name:
            raise TaskError("unknown_agent", f"{given.agent} has not announced itself: say its type")
        kind = core.catalogue.types.get(type_name)
        if kind is None:
            raise TaskError("unknown_type", f"the catalogue has no type '{type_name}'")
        if agent is not None and agent.present and agent.type != type_name:
            raise TaskError("other_type", f"{given.agent} announces itself as {agent.type}, and not as {type_name}")
        home = self._home(given.agent, kind, given.home, old.home if old is not None else "")
        if old is not None and (old.type, old.home) == (type_name, home):
            return
        if agent is not None and home != agent.home and not agent.refused and self._admission.is_in_use(agent):
            raise TaskError(
                "in_use", f"{given.agent} is in use, and {agent.home or 'no place'} is its home: wait until it rests"
            )
        member = Member(type=type_name, home=home, by=given.by, at=given.at or core.now)
        core.emit(ch.MemberPut(given.agent, member))
        if agent is not None:
            self._admission.judge_by_list(agent)

    def _home(self, agent_id: str, kind: AgentType, wanted: str, old: str) -> str:
        """Return the home of a new member."""
        core = self._core
        places = core.site.ports if kind.flies else core.site.stations if kind.mobility == "ground" else {}
        what = "port" if kind.flies else "station"
        if wanted:
            if wanted not in places:
                known = ", ".join(places) or "none"
                raise TaskError("unknown_home", f"'{wanted}' is no {what} of {core.site.name}; it has {known}")
            if self._is_taken(agent_id, wanted):
                raise TaskError("home_taken", f"the {what} {wanted} is another agent's own")
            return wanted
        if old:
            return old
        agent = core.state.agents.get(agent_id)
        if kind.flies:
            home = agent.home if agent is not None and agent.home else self._admission.free_port(agent_id)
            if not home:
                raise TaskError("no_port", f"no port of {core.site.name} is free for {agent_id}")
            return home
        return ""

    def _is_taken(self, agent_id: str, home: str) -> bool:
        core = self._core
        mine = core.state.members.get(agent_id)
        listed = [one for one in core.homes() if one == home]
        if mine is not None and mine.home == home:
            listed = listed[1:]
        return bool(listed) or any(one.home == home and one.id != agent_id for one in core.state.agents.values())

    def _remove(self, given: RemoveAgent) -> None:
        core = self._core
        if given.agent not in core.state.members:
            raise TaskError("not_member", f"nobody added {given.agent} to the fleet")
        core.emit(ch.MemberPut(given.agent, None))
        agent = core.state.agents.get(given.agent)
        if agent is not None:
            self._admission.judge_by_list(agent)
