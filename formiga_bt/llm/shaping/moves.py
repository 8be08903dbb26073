"""Where each machine of a task in the short form is sent, and what is put right about it.

Two never use one spot at a time, lists are flown, a landing that is asked for is no way home. What is put right is told.
"""

import re
from collections.abc import Collection, Mapping
from typing import Any, Final

from formiga_bt.llm.shaping.formations import can_land_at, is_reported_once, lands_below, leg_of, legs_in
from formiga_bt.llm.shaping.hovering import height_over
from formiga_bt.llm.shaping.rings import goals, landings, meant, round_
from formiga_bt.llm.shaping.teams import GAP, gap_of, in_a_row, in_compass, is_list, spaced, turned_round
from formiga_bt.llm.shaping.walking import all_steps
from formiga_bt.llm.shaping.whereabouts import Whereabouts
from formiga_bt.llm.vocabulary import AgentVerb
from formiga_bt.llm.words.landings import lands_only
from formiga_bt.llm.words.wording import Words

FLYING: Final = "lib/flying.yaml"
HEIGHT: Final = "20 m"
"""Where a verb needs a height and none was given."""
_WHERE: Final = ("place", "position", "list of place")
_MACHINE: Final = re.compile(
    r"(?<![\w.])(?:ground\(\s*([A-Za-z_]\w*)\.position\s*\)|([A-Za-z_]\w*)(?:\.position)?(?!\w|\.|\s*\())"
)
"""What may be a machine, where a place is due."""
_LANDS: Final = ("FlyAndLand", "LandIn")
_Own = dict[str, Any]


class Moves:
    """Follows the machines of one tree, step by step.

    Args:
        words: the request.
        verbs: the vocabulary.
        added: is told what was put right.
    """

    def __init__(self, words: Words, verbs: Mapping[str, AgentVerb], added: list[str]) -> None:
        self._words = words
        self._verbs = verbs
        self._added = added
        self._gap = gap_of(words) or GAP
        alike = sum(one.type == "distance" and f"{one.si:g} m" == self._gap for one in words.amounts)
        self._only_gap = self._gap if alike == 1 and gap_of(words) and self._gap != HEIGHT else ""
        self._stays = lands_only(words)
        self._below = lands_below(words)
        self._leg = leg_of(words)
        self._landed: set[str] = set()
        self._roles: Mapping[str, str] = {}
        self._places: Collection[str] = ()
        self._goals: Mapping[str, str] = {}
        self._lands: Mapping[str, frozenset[str]] = {}
        self._down: set[str] = set()
        self._been: dict[str, list[str]] = {}
        self._hovers: Collection[tuple[str, str]] = ()
        self.at = Whereabouts()

    def where(self, name: str) -> str:
        """Return the field of a verb that says where to; "" = it has none."""
        fields = self._verbs[name].fields if name != "MiniFinder" else {}
        return next((key for key, type_ in fields.items() if type_ in _WHERE), "")

    def landing(self, name: str, agent: str, own: _Own) -> tuple[str, _Own]:
        """Return a landing in place of a way home, where only a landing was asked for; a flight in place of a landing."""
        flown = ""
        if name in _LANDS and "FlyTo" in self._verbs and not self._is_watched(str(own.get("at", "")), agent):
            flown = height_over(str(own["at"]), self._words)
        if flown:
            self._tell(
                f"{agent} is at {own['at']} at {flown}, and does not land there, for the request wants no landing"
            )
            return "FlyTo", {"to": own["at"], "height": flown}
        if name in (*_LANDS, "ReturnHome"):
            self._landed.add(agent)
        if name != "ReturnHome" or not self._stays or "FlyAndLand" not in self._verbs:
            return name, own
        spot, teams = self.at.only(agent), self.at.now.teams
        places = teams[agent][1] if agent in teams else spot.place if spot.height else ""
        if not places or not self._is_ground(places):
            return name, own
        self._added.append(f"{agent} lands where it is, as the request says, and does not fly home")
        return "FlyAndLand", {"at": places}

    def still_up(self) -> dict[str, str]:
        """Return who hovers at the end and never lands, though the request wants a landing and no way home, and where."""
        if not self._stays or "FlyAndLand" not in self._verbs:
            return {}
        spots = {agent: self.at.only(agent) for agent in self.at.now.spots}
        found = {agent: spot.place for agent, spot in spots.items() if spot.height and spot.place}
        found |= {team: places for team, (_, places) in self.at.now.teams.items()}
        found = {who: at for who, at in found.items() if who not in self._landed and self._is_ground(at)}
        for who, at in found.items():
            self._tell(f"{who} lands where it is, at {at}, for the request wants a landing and no way home")
        return found

    def _is_ground(self, places: str) -> bool:
        """Return whether a machine may land where it hovers: not over a region, which may be a lake."""
        return "centroid(" not in places and can_land_at(places, self._words)

    def _is_watched(self, place: str, agent: str) -> bool:
        """Return whether another machine hovers over a place: that is the one which is wanted over it."""
        return not place or any(who != agent and over == place for who, over in self._hovers)

    def leaves_ground(self, agent: str) -> bool:
        """Return whether a machine that flies home now may stand on the ground, away from home."""
        found = any(not spot.height for spot in self.at.of(agent))
        self.at.leaves(agent)
        return found

    def wayward(self, text: str, agent: str = "") -> str:
        """Return a place or a way as the language has it, with the ends of a way as the request has them."""
        placed = _MACHINE.sub(lambda match: self._place_of(match, agent), in_compass(text))
        plain = round_(placed, self._words)
        if plain != placed:
            self._tell(f"{plain} is a ring, and has as many points as make it round")
        turned = turned_round(plain, self._words, self._been.get(agent, ()))
        if turned != plain:
            self._added.append(f"{turned} instead of {text}, as the request says where it begins")
        return turned

    def _place_of(self, match: re.Match[str], agent: str) -> str:
        """Return where a machine is told to be, for a machine that stands where a place is due: `circle(first, 10 m)`."""
        name = match[1] or match[2]
        if name in self._places:
            return match[0]
        role = self._roles.get(name) or meant(name, self._roles, agent) or name
        if self.at.of(role):
            spot = self.at.only(role).place
        else:
            spot = self._goals.get(role, "") if role != agent else ""
            if spot:
                self._tell(f"where {name} is means {spot}: it is sent there")
        return spot if spot and not is_list(spot) and not spot.startswith("last(") else match[0]

    def foresee(self, tree: Mapping[str, Any], roles: Mapping[str, str], places: Collection[str]) -> None:
        """Learn where machines are sent in a whole tree.

        Args:
            tree: in the short form.
            roles: what each role is called in the task.
            places: names of the site, which are no machines.
        """
        self._roles, self._places = roles, places
        self._goals = {roles.get(agent, agent): place for agent, place in goals(tree).items()}
        self._hovers = {(roles.get(str(one.get("agent")), str(one.get("agent"))), str(one.get("to"))) for one in all_steps(tree)
                        if one.get("do") == "FlyTo"}  # fmt: skip
        self._lands = {roles.get(agent, agent): places for agent, places in landings(tree).items()}

    def legs(self, own: _Own) -> _Own:
        """Return the values of a verb with the legs of a triangle as the request says them, which are no height."""
        where = next((key for key in ("to", "at", "way") if legs_in(str(own.get(key, "")))), "")
        if not self._leg or not where:
            return own
        wrong = legs_in(own[where])
        found = {**own, where: own[where].replace(wrong, self._leg)}
        alike = [one for one in self._words.amounts if one.type == "distance"]
        if own.get("height") == self._leg and sum(f"{one.si:g} m" == self._leg for one in alike) == 1:
            is_said = wrong != self._leg and any(f"{one.si:g} m" == wrong for one in alike)
            found["height"] = wrong if is_said else HEIGHT
        if found != own:
            flown = f", at {found['height']}" if found.get("height") != own.get("height") else ""
            self._tell(f"the legs are {self._leg}{flown}, as the request says")
        return found

    def _tell(self, what: str) -> None:
        if what not in self._added:  # in another branch
            self._added.append(what)

    def height(self, own: _Own) -> _Own:
        """Return the values of a verb without a height that the request says is a gap between machines."""
        if self._only_gap and own.get("height") == self._only_gap:
            self._added.append(f"{self._only_gap} is the gap between the machines, not the height, which is {HEIGHT}")
            return {**own, "height": HEIGHT}
        return own

    def of_one(self, name: str, agent: str, own: _Own, where: str) -> tuple[str, _Own]:
        """Return the verb that does for one machine what was meant, with its values."""
        name, own = self._fitting(name, agent, own, where)
        where = self.where(name)
        if name in ("FlyTo", "GoTo", *_LANDS):
            self._been.setdefault(agent, []).append(own[where])
        if is_list(own[where]):
            self.at.goes(agent, f"last({own[where]})", str(own.get("height", "")))
        else:
            own[where] = self._apart(name, agent, own[where], str(own.get("height", "")))
        return name, own

    def _fitting(self, name: str, agent: str, own: _Own, where: str) -> tuple[str, _Own]:
        text = own[where]
        if is_list(text) and name in ("FlyTo", "GoTo") and "FlyAlong" in self._verbs:
            return "FlyAlong", {"way": text, "height": own.get("height", HEIGHT)}
        if name == "FlyAlong" and not is_list(text) and "FlyTo" in self._verbs:
            return "FlyTo", {"to": text, "height": own.get("height", HEIGHT)}
        spot = self.at.only(agent)
        if name in _LANDS and self._below and spot.height and spot.place and not self.at.is_in_loop:
            if text != spot.place:
                self._tell(f"{agent} lands below where it hovers, at {spot.place}, as the request says")
            return self._straight_down(name), {"at": spot.place}
        if is_list(text) and name in ("FlyAndLand", "LandIn"):
            text = own[where] = f"last({text})"
        here = {spot.place for spot in self.at.of(agent)}
        if name == "LandIn" and "FlyAndLand" in self._verbs:
            there = {text, self.at.now.moved.get((agent, text), text)}
            return (name, own) if here and here <= there else ("FlyAndLand", {"at": text})
        return name, own

    def _straight_down(self, name: str) -> str:
        return "LandIn" if "LandIn" in self._verbs else name

    def _apart(self, name: str, agent: str, text: str, height: str) -> str:
        """Return a place that no other machine is at, and keep that this one is there."""
        if name in ("FlyAndLand", "LandIn"):
            height = ""
        aside = self.at.now.moved
        text = aside.get((agent, text), text)
        others = self.at.others(agent)
        here = self.at.only(agent).place
        ringed = not gap_of(self._words) and re.match(rf"last\(circle\({re.escape(text)}\s*,", here) is not None
        for_other = any(text in places for who, places in self._lands.items() if who != agent)
        if ((text, height) in others or (ringed and for_other and not height)) and not text.startswith("fix"):
            metres = float(self._gap.split()[0])
            number = next(n for n in range(1, 100) if (_beside(text, metres * n), height) not in others)
            moved = _beside(text, metres * number)
            told = f"{agent} keeps {metres * number:g} m from the one at {text}"
            if not height and ringed:
                moved, told = here, f"{agent} lands where its ring ends, for another one is at {text}"
            self._tell(told)
            aside[agent, text] = moved
            text = moved
        self.at.goes(agent, text, height)
        return text

    def of_team(self, name: str, team: str, count: int, own: _Own, where: str) -> tuple[str, _Own, str, str]:
        """Return verb, values, the field with the place, and the list of places, one for each member."""
        if not where:
            self.at.now.teams.pop(team, None)
            return name, own, "", ""
        told = text = own[where]
        if name == "FlyAlong" and is_list(text) and "FlyTo" in self._verbs:
            name, own, where = "FlyTo", {"to": text, "height": own.get("height", HEIGHT)}, "to"
        before, places = self.at.now.teams.get(team, ("", ""))
        if is_list(text):
            text = self._spaced(text, count)
        if name in _LANDS and places and team not in self._down and not self.at.is_in_loop:
            if text != places and before != told and (self._below or is_reported_once(text, places, self._words)):
                self._tell(f"{team} land below where they hover: {places}")
                text = places
            if self._below and text == places:
                name, where = self._straight_down(name), "at"
        if not is_list(text):
            text = places if places and (before == told or name == "LandIn") else in_a_row(text, count, self._gap)
            text = spaced(text, count, gap_of(self._words))
            if text != places:
                self._tell(f"{team} keep {self._gap} from each other at {told}")
        if name == "LandIn" and "FlyAndLand" in self._verbs and places != text:
            name, own, where = "FlyAndLand", {"at": text}, "at"
        self.at.now.teams[team] = (told, text)
        (self._down.add if name in _LANDS else self._down.discard)(team)
        return name, own, where, text

    def _spaced(self, text: str, count: int) -> str:
        """Return a row of a team with the gap between neighbours that the request says."""
        found = spaced(text, count, gap_of(self._words))
        if found != text and re.search(rf"=\s*-?\s*{re.escape(self._gap)}", text):
            self._tell(f"{self._gap} between neighbours, as the request says, is not the length of the row")
        return found


def _beside(place: str, metres: float) -> str:
    return f"offset({place}, east={metres:g} m)"
