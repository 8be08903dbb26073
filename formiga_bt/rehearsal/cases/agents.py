"""Reads the agents of a case: the site's own, with what the case says differs, by agent or by role."""

from dataclasses import replace
from typing import Any

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place
from formiga_bt.lang.keyed import Keys, read_keys
from formiga_bt.lang.model import Task
from formiga_bt.lang.scenario.book import Book
from formiga_bt.lang.scenario.entries import ScenarioAgent
from formiga_bt.lang.site.standing import beginnings
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.text.reading import did_you_mean, quoted_list, read_mapping, read_name, shorten
from formiga_bt.rehearsal.cases.options import AGENT
from formiga_bt.rehearsal.cases.rules import all_roles


class CaseAgents:
    """Reads the agents of one case; the book knows them from then on."""

    def __init__(self, book: Book, task: Task) -> None:
        self.book = book
        self.task = task
        self.agents = standing(book)

    def read(self) -> list[ScenarioAgent]:
        """Return the agents that are there."""
        absent: set[str] = set()
        for one in self.book.keys.entries("agents"):
            differs = read_mapping(one.value, self.book.problems, one.key.text)
            if differs is None:
                continue
            keys = read_keys(differs, AGENT, self.book.problems, "an agent")
            ids = self._who(one.key, keys)
            if keys.flag("absent"):
                absent.update(ids)
            for id_ in ids:
                self._change(id_, keys, alone=len(ids) == 1, mark=one.key.mark)
        found = [agent for agent in self.agents.values() if agent.id not in absent]
        self.book.types.update({agent.id: agent.type for agent in found})
        return found

    def _who(self, key: Scalar, keys: Keys) -> list[str]:
        """Return the agents that a key means: one, or all that fit a role."""
        if key.text in self.agents:
            return [key.text]
        roles = all_roles(self.task)
        role = roles.get(key.text)
        if role is not None:
            types = self.book.catalogue.types
            fits = [a.id for a in self.agents.values() if {a.type, *types[a.type].extends} & set(role.types)]
            if not fits:
                self.book.problems.add("E010", key.mark, f"the site has no agent for the role '{key.text}'")
            return fits
        if "type" in keys:
            return self._new(key, keys)
        known = [*self.agents, *roles]
        what = f"no agent and no role is called '{shorten(key.text)}'{did_you_mean(key.text, known)}"
        self.book.problems.add("E010", key.mark, what, f"known: {quoted_list(known)}; a further agent needs type:")
        return []

    def _new(self, key: Scalar, keys: Keys) -> list[str]:
        type_ = keys.name("type")
        name = read_name(key, self.book.problems, "agent")
        known = self.book.catalogue.types
        if type_ is None or name is None:
            return []
        if type_.text not in known:
            what = f"no agent type is called '{shorten(type_.text)}'{did_you_mean(type_.text, known)}"
            self.book.problems.add("E020", type_.mark, what, f"types: {quoted_list(known)}")
            return []
        human = known[type_.text].human
        self.agents[name.text] = ScenarioAgent(name.text, type_.text, Place(0.0, 0.0), human)
        return [name.text]

    def _change(self, id_: str, keys: Keys, *, alone: bool, mark: Mark) -> None:
        agent, problems = self.agents[id_], self.book.problems
        changes: dict[str, Any] = {}
        for key in ("battery", "charges", "payload"):
            if key in keys and agent.human:
                problems.add("E008", keys[key].key.mark, f"'{id_}' is a person: only drones have '{key}'")
        if "walk" in keys and not agent.human:
            problems.add("E008", keys["walk"].key.mark, f"'{id_}' is no person: only people walk")
        if "battery" in keys:
            changes["battery"] = keys.number("battery")
        if "charges" in keys:
            changes["charges"] = keys.flag("charges")
        if "payload" in keys:
            changes["payload_kg"] = keys.number("payload")
        if "walk" in keys:
            changes["walk"] = self.book.way(keys, "walk")
        if "at" in keys:
            node = keys["at"].value
            if not alone:
                problems.add("E018", node.mark, "several agents fit this role: name the one that is there")
                return
            at = self.book.point(node)
            changes |= {"at": at} if at is not None else {}
            if isinstance(node, Scalar) and node.text in self.book.site.ports and agent.home is None:
                changes["home"] = self.book.site.ports[node.text].at
        elif id_ not in self.book.site.agents:
            problems.add("E008", mark, f"'{id_}' is not of the site: it needs 'at'", "add at:")
        self.agents[id_] = replace(agent, **changes)


def standing(book: Book) -> dict[str, ScenarioAgent]:
    """Return the site's agents as they begin (`lang.site.standing`)."""
    found: dict[str, ScenarioAgent] = {}
    for name, begins in beginnings(book.site, book.catalogue).items():
        of = book.site.agents[name].type
        found[name] = ScenarioAgent(name, of, begins.at, book.catalogue.types[of].human, home=begins.home)
    return found
