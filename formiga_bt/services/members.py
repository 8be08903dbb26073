"""Agents that people add to the fleet: orders and lists for the API, and what of it outlives a start.

Kept in the site's runtime folder, each file a line for each word, never changed: `fleet.jsonl` has who was added and removed,
`fleets.jsonl` the fleets that people saved under a name.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from formiga_bt.base.errors import TaskError
from formiga_bt.base.site_folder import FLEET, FLEETS, append_line, read_lines
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import AddAgent, EngineStep, RemoveAgent
from formiga_bt.engine.kernel.records import Member
from formiga_bt.lang.model import Site, SiteAgent
from formiga_bt.lang.site.keys import APPROVERS
from formiga_bt.services.order_taker import OrderTaker, PersonalOrders
from formiga_bt.services.refused import Refused
from formiga_bt.services.view import EngineView
from formiga_bt.services.words import with_keeping
from formiga_bt.show.facts import FleetFact, FleetList, FleetLoaded, MemberFact, SkippedFact

MOST_IN_FLEET = 10_000
"""Agents that one saved fleet has at most."""


def lines_of(step: EngineStep) -> list[dict[str, Any]]:
    """Return the lines about who a step added or removed; those that were restored have theirs already."""
    given = step.input
    if not isinstance(given, AddAgent | RemoveAgent) or (isinstance(given, AddAgent) and given.at):
        return []
    found: list[dict[str, Any]] = []
    for change in step.changes:
        if isinstance(change, ch.MemberPut):
            member = change.member
            line: dict[str, Any] = {"agent": change.agent, "by": given.by, "at_us": step.at}
            found.append(
                {**line, "remove": True} if member is None else {**line, "type": member.type, "home": member.home}
            )
    return found


def standing(folder: Path) -> list[AddAgent]:
    """Return who was added and not removed, as the runtime folder tells.

    Raises:
        SiteError: the file cannot be read.
    """
    last = {str(line.get("agent", "")): line for line in read_lines(folder / FLEET)}
    return [
        AddAgent(name, str(line.get("type", "")), str(line.get("home", "")), str(line.get("by", "")), line["at_us"])
        for name, line in last.items()
        if name and not line.get("remove") and isinstance(line.get("at_us"), int)
    ]


def restore(folder: Path, driver: OrderTaker) -> None:
    """Tell a new engine who was added. Whoever cannot be any more stays out, and is shown as not listed."""
    for given in standing(folder):
        try:
            driver.ask(given)
        except TaskError:
            continue


def with_added(site: Site, folder: Path) -> Site:
    """Return a site that lists the agents that were added, too: what tasks are checked against when an engine starts."""
    return _listing(site, {given.agent: (given.kind, given.home) for given in standing(folder)})


def with_members(site: Site, members: Mapping[str, Member]) -> Site:
    """Return a site that lists the members of the fleet, too: what tasks are checked against while an engine runs."""
    return _listing(site, {name: (one.type, one.home) for name, one in members.items()})


def _listing(site: Site, added: Mapping[str, tuple[str, str]]) -> Site:
    if not added:
        return site
    more = {name: SiteAgent(name, kind, home) for name, (kind, home) in added.items()}
    return replace(site, agents={**more, **site.agents})


class Members:
    """The orders and lists behind the API.

    Args:
        folder: the site's runtime folder.
        orders: gives them to the running engine.
        view: the engine's read-only copy.
        site: what the engine was made of.
    """

    def __init__(self, folder: Path, orders: PersonalOrders, view: EngineView, site: Site) -> None:
        self._folder = folder
        self._orders = orders
        self._view = view
        self._site = site

    def add(self, agent: str, *, kind: str = "", home: str = "", by: str = "", secret: str = "") -> str:
        """Add an agent to the fleet; return what happened.

        Raises:
            Refused: as the engine says (`engine.agents.membership`); by nobody who may, or without their secret.
        """
        self._prove(by, secret)
        reply = self._orders.give(AddAgent(agent, kind, home, by), agent)
        with self._view.reading() as state:
            member, record = state.members[agent], state.agents.get(agent)
        where = f", its home is {member.home}" if member.home else ""
        then = "" if record is not None and not record.refused else "; it is admitted when it announces itself"
        if record is not None and record.refused:
            then = f"; it is not admitted: {record.refused}"
        return with_keeping(f"{agent} ({member.type}) belongs to the fleet{where}{then}", reply)

    def remove(self, agent: str, *, by: str = "", secret: str = "") -> str:
        """Take an agent that was added out of the fleet; return what happened.

        Raises:
            Refused: nobody added it; by nobody who may, or without their secret.
        """
        self._prove(by, secret)
        reply = self._orders.give(RemoveAgent(agent, by), agent)
        with self._view.reading() as state:
            record = state.agents.get(agent)
        waits = record is not None and record.refused_at_rest
        then = "; it is let go when it rests" if waits else ""
        return with_keeping(f"{agent} belongs to the fleet no more{then}", reply)

    def save(self, name: str, *, by: str = "") -> FleetFact:
        """Keep who belongs to the fleet now, besides the site file's agents, under a name; a former fleet of it is replaced.

        Raises:
            Refused: there is nobody, or too many.
        """
        with self._view.reading() as state:
            found = {
                agent.id: {"type": agent.type, "home": agent.home}
                for agent in state.agents.values()
                if not agent.refused and agent.id not in self._site.agents
            }
            found |= {name: {"type": one.type, "home": one.home} for name, one in state.members.items()}
            at = state.now
        if not found:
            raise Refused("no_members", "there is no agent besides those of the site file", "formiga agents add ID")
        if len(found) > MOST_IN_FLEET:
            raise Refused("too_many", f"more than {MOST_IN_FLEET} agents", "save them in parts")
        append_line(self._folder / FLEETS, {"fleet": name, "by": by, "at_us": at, "agents": found})
        return _fact(name, found)

    def fleets(self) -> FleetList:
        """Return the fleets that were saved, by name."""
        return FleetList(tuple(_fact(name, agents) for name, agents in sorted(self._saved().items())))

    def load(self, name: str, *, by: str = "", secret: str = "") -> FleetLoaded:
        """Add every agent of a saved fleet; who cannot be added is named with the reason.

        Raises:
            Refused: there is no such fleet; by nobody who may, or without their secret.
        """
        saved = self._saved()
        if name not in saved:
            raise Refused(
                "unknown_fleet",
                f"no fleet was saved as '{name}'",
                "formiga agents fleets lists them",
                near=sorted(saved),
            )
        self._prove(by, secret)
        added, skipped = [], []
        for agent, one in saved[name].items():
            try:
                self._orders.give(AddAgent(agent, one.get("type", ""), one.get("home", ""), by), agent)
                added.append(agent)
            except Refused as error:
                if error.code in {"not_approver", "stopped"}:
                    raise
                skipped.append(SkippedFact(who=agent, code=error.code, text=error.text))
        return FleetLoaded(fleet=name, added=tuple(added), skipped=tuple(skipped))

    def _saved(self) -> dict[str, dict[str, dict[str, str]]]:
        lines = read_lines(self._folder / FLEETS)
        return {str(line["fleet"]): line["agents"] for line in lines if line.get("fleet") and line.get("agents")}

    def _prove(self, by: str, secret: str) -> None:
        self._orders.prove(by, secret, self._site.people.get(APPROVERS, ()))


def _fact(name: str, agents: dict[str, dict[str, str]]) -> FleetFact:
    return FleetFact(
        name=name,
        agents=tuple(
            MemberFact(agent=agent, type=one.get("type", ""), home=one.get("home", "")) for agent, one in agents.items()
        ),
    )
