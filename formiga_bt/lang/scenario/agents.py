"""Reads the agents of a scenario: who, where, and for people how they answer and walk."""

from collections.abc import Mapping, Sequence
from typing import Any

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place, Position, horizontal_m
from formiga_bt.base.machines import MOVING
from formiga_bt.lang.keyed import Keys, read_keys
from formiga_bt.lang.scenario.book import Book
from formiga_bt.lang.scenario.entries import ScenarioAgent
from formiga_bt.lang.scenario.options import AGENT, ANSWER, FOR_DRONES_ONLY, PERSON
from formiga_bt.lang.site.standing import beginnings
from formiga_bt.lang.text.document import Entry, Mapping_, Scalar
from formiga_bt.lang.text.reading import did_you_mean, fix_word, quoted_list, shorten
from formiga_bt.lang.text.synonyms import surely


def read_agents(book: Book) -> list[ScenarioAgent]:
    """Return the agents of a scenario; `book.types` knows them from then on."""
    return _Agents(book).read()


class _Agents:
    """Reads the agents of one scenario."""

    def __init__(self, book: Book) -> None:
        self.book = book
        self.problems = book.problems
        self.site = book.site
        self.catalogue = book.catalogue
        self.begins = beginnings(book.site, book.catalogue)

    def read(self) -> list[ScenarioAgent]:
        """Read all of them."""
        found: list[ScenarioAgent] = []
        for mapping in self.book.keys.mappings("agents", "agent", such_as=""):
            keys = read_keys(mapping, AGENT, self.problems, "an agent")
            agent = self._agent(keys, mapping.mark)
            if agent is not None:
                self._check_room(agent, keys.get("at"), mapping.mark, found)
                found.append(agent)
        return found

    def _agent(self, keys: Keys, mark: Mark) -> ScenarioAgent | None:
        id_ = keys.name("id")
        if id_ is None:
            return None
        type_ = self._type(id_, keys)
        if type_ is None:
            return None
        if id_.text in self.book.types:
            self.problems.add("E018", id_.mark, f"there is an agent '{id_.text}' already", "give it another id")
            return None
        self.book.types[id_.text] = type_
        human = self.catalogue.types[type_].human
        if "person" in keys and not human:
            self.problems.add("E008", keys["person"].key.mark, f"'{id_.text}' is a {type_}: only people have 'person'")
        answers, walk = self._person(keys) if "person" in keys and human else ((), ())
        begins = self.begins.get(id_.text)
        home = begins.home if begins is not None and not human else None
        at: Place | Position | None = begins.at if begins is not None and not human else None
        if "at" in keys:
            node = keys["at"].value
            at = self.book.point(node)
            if home is None and isinstance(node, Scalar) and node.text in self.site.ports:
                home = self.site.ports[node.text].at
        elif at is None and self.catalogue.types[type_].mobility == "none":
            at = Place(0.0, 0.0)
        elif at is None:
            why = "is a person, whom the site does not place" if human else "has no port of its own"
            self.problems.add("E008", mark, f"'{id_.text}' {why}: it needs 'at'", "add at: a port, a place or a point")
        if at is None:
            return None
        return ScenarioAgent(
            id_.text, type_, at, human, keys.number("battery"),
            home if not human else None, answers, walk, **self._drone(keys, id_, human),
        )  # fmt: skip

    def _drone(self, keys: Keys, id_: Scalar, human: bool) -> dict[str, Any]:
        """Return what only drones have."""
        for key in FOR_DRONES_ONLY:
            if human and key in keys:
                self.problems.add("E008", keys[key].key.mark, f"'{id_.text}' is a person: only drones have '{key}'")
        return {
            "payload_kg": keys.number("payload"),
            "cut": keys.flag("cut"),
            "on_link_loss": keys.word("on_link_loss"),
            "charges": "charges" not in keys or keys.flag("charges"),
        }

    def _type(self, id_: Scalar, keys: Keys) -> str | None:
        listed = self.site.agents.get(id_.text)
        if "type" not in keys:
            if listed is not None and listed.type in self.catalogue.types:
                return listed.type
            what = f"'{id_.text}' needs 'type': the site does not list it{did_you_mean(id_.text, self.site.agents)}"
            self.problems.add("E008", id_.mark, what, "add type:")
            return None
        at = keys.name("type")
        if at is None:
            return None
        known = list(self.catalogue.types)
        if at.text not in known:
            what = f"no agent type is called '{shorten(at.text)}'{did_you_mean(at.text, known)}"
            self.problems.add(
                "E020", at.mark, what, f"types: {quoted_list(known)}", fix_word(at, surely(at.text, known))
            )
            return None
        if listed is not None and listed.type != at.text:
            what = f"'{id_.text}' is a {listed.type} at this site, not a {at.text}"
            self.problems.add("E013", at.mark, what, "give it another id", fix_word(at, listed.type))
        if listed is None and self.site.mode == "real":
            what = f"this site admits only the agents that it lists{did_you_mean(id_.text, self.site.agents)}"
            self.problems.add("E010", id_.mark, what, f"agents: {quoted_list(self.site.agents)}")
        return at.text

    def _check_room(self, agent: ScenarioAgent, at: Entry | None, mark: Mark, others: Sequence[ScenarioAgent]) -> None:
        if not self._has_body(agent):
            return
        other = next((o for o in others if self._has_body(o) and _touch(o, agent)), None)
        if other is not None:
            what = f"'{agent.id}' stands where '{other.id}' stands"
            self.problems.add("E018", at.value.mark if at is not None else mark, what, "drones need 2 m and more")

    def _has_body(self, agent: ScenarioAgent) -> bool:
        """Return whether it is a machine that others could touch."""
        return self.catalogue.types[agent.type].mobility in MOVING

    def _person(self, keys: Keys) -> tuple[tuple[Mapping[str, Any], ...], tuple[Place, ...]]:
        person = keys.inside("person", PERSON, "a person")
        return tuple(map(self._answer, person.mappings("answers", "answers"))), self.book.way(person, "walk")

    def _answer(self, mapping: Mapping_) -> Mapping[str, Any]:
        keys = read_keys(mapping, ANSWER, self.problems, "an answer")
        options, never = keys.words("options"), keys.flag("never")
        fields = keys.get("fields")
        if not never and not options and fields is None:
            text = "an answer needs 'options', 'fields' or 'never: true'"
            self.problems.add("E008", mapping.mark, text, "options: [loaded]")
        said = {"match": keys.word("match"), "options": options, "after": keys.number("after"), "never": never}
        return said if fields is None else {**said, "form": fields}


def _touch(a: ScenarioAgent, b: ScenarioAgent) -> bool:
    heights = [point.up_m if isinstance(point, Position) else 0.0 for point in (a.at, b.at)]
    return horizontal_m(a.at, b.at) < 2.0 and abs(heights[0] - heights[1]) < 2.0
