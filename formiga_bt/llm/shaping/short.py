"""The short form of a task, which small models write, and what it means in JSON form (`lang.json_form.words`).

    {"task": "LookAtCamp",
     "agents": [{"name": "drone", "type": "lwd"}],
     "steps": [{"do": "FlyTo", "agent": "drone", "to": "camp", "height": "40 m"},
               {"wait": "30 s"},
               {"do": "ReturnHome", "agent": "drone"}]}

It differs from the JSON form in four ways: an action and a call of a library's subtree look alike; every value is a plain
text, which is read by the type that is due there; constants become params of the task (`lifting`); and what hardly anybody
asks for cannot be said. Paths of steps are the same in both forms, so that a problem of one is shown in the other.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from formiga_bt.lang.json_form.words import field_key
from formiga_bt.llm.shaping.asking import as_asked
from formiga_bt.llm.shaping.lifting import Lifter, split_list
from formiga_bt.llm.shaping.moves import FLYING, HEIGHT, Moves
from formiga_bt.llm.shaping.regions import Regions
from formiga_bt.llm.shaping.rings import along_ways
from formiga_bt.llm.shaping.teams import in_compass, is_list, member_of
from formiga_bt.llm.shaping.tidying import back_at_centre, branched, every_so_often, goes_on_with, homeward, only_on_yes
from formiga_bt.llm.shaping.unasked import left_out
from formiga_bt.llm.shaping.waits import without_idle_waits
from formiga_bt.llm.vocabulary import AgentVerb
from formiga_bt.llm.words.at_once import at_once
from formiga_bt.llm.words.only_question import only_question
from formiga_bt.llm.words.questions import questions
from formiga_bt.llm.world import RequestWorld

STEPS: Final = ("parallel", "sequence", "for", "repeat", "if", "ask", "wait", "wait_until", "notify", "break_if")
"""Kinds of steps besides `do`."""
ASKED_FOR: Final = "15 min"
"""So long a question waits for its answer."""
_FREE: Final = re.compile(r"[A-Za-z_]\w*")


class ShortError(ValueError):
    """The JSON is not of the short form."""

    def __init__(self, path: str, message: str) -> None:
        super().__init__(message)
        self.path = path


@dataclass(slots=True)
class Expanded:
    """A task in JSON form, made of one in short form."""

    data: dict[str, Any]
    notes: dict[str, str] = field(default_factory=dict)
    """JSON path -> what stands beside it as a comment."""
    added: list[str] = field(default_factory=list)
    """What was added or put right by us, in words."""


def expanded(tree: Any, world: RequestWorld, verbs: Mapping[str, AgentVerb], lifter: Lifter) -> Expanded:
    """Return what a task in short form means.

    Args:
        tree: the JSON value.
        world: where it is to be flown.
        verbs: the vocabulary.
        lifter: takes the constants, and knows the words that they came from.

    Raises:
        ShortError: it is not of this form.
    """
    return _Expander(world, verbs, lifter).task(tree)


class _Expander:
    def __init__(self, world: RequestWorld, verbs: Mapping[str, AgentVerb], lifter: Lifter) -> None:
        self._world = world
        self._verbs = verbs
        self._lift = lifter
        self._imports: list[str] = []
        self._roles: dict[str, dict[str, Any]] = {}
        self._first_place: dict[str, str] = {}
        self._asks_only = False
        self._added: list[str] = []
        self._moves = Moves(lifter.words, verbs, self._added)

    def task(self, tree: Any) -> Expanded:
        asked = questions(self._lift.words, self._world)
        tree = as_asked(_object(tree, "$"), asked, self._world, self._added, height=self._hovers())
        tree = left_out(tree, self._lift.words, self._world, self._added)
        for index, role in enumerate(_list(tree.get("agents") or [], "$.agents")):
            role = _object(role, f"$.agents[{index}]")
            name = _text(role.get("name"), f"$.agents[{index}].name")
            self._roles[self._lift.renamed(name)] = role
        self._asks_only = _asks_only(tree.get("steps")) and only_question(self._lift.words, self._world) is not None
        self._pin()
        self._lift.taken |= set(self._roles)
        tree = back_at_centre(tree, self._lift.words.text, self._verbs, self._added)
        tree = tree if self._asks_only else only_on_yes(tree, self._lift.words.text, self._added)
        tree = without_idle_waits(tree, not all(map(self._is_machine, self._roles)), self._added)
        tree = every_so_often(tree, self._lift.words, self._added)
        tree = {**tree, "steps": self._at_once(_list(tree.get("steps"), "$.steps"))}
        tree = along_ways(tree, self._lift.words, self._verbs, HEIGHT, self._added)
        site = self._world.site
        names = {role: self._lift.role(role) for role in (*self._lift.roles, *self._roles)}
        self._moves.foresee(tree, names, {*site.places, *site.regions, *site.ports, *self._lift.words.points, "base"})
        self._regions = Regions(self._lift.words, self._world.site.regions, self._verbs, tree, self._added)
        steps = self.steps(tree.get("steps"), "$.steps")
        for agent, at in self._moves.still_up().items():
            steps.append(self._do({"do": "FlyAndLand", "agent": agent, "at": at}, f"$.steps[{len(steps)}]"))
        roles = [self._role(name, role, index) for index, (name, role) in enumerate(self._roles.items())]
        params, notes = self._lift.params()
        name = re.sub(r"\W", "", str(tree.get("task") or "")) or "Drafted"
        data: dict[str, Any] = {"task": name[:1].upper() + name[1:60], "version": "0.1.0"}
        if tree.get("description"):
            data["description"] = str(tree["description"])[:300]
        data |= {"imports": self._imports} if self._imports else {}
        data |= {"params": params} if params else {}
        data |= {"agents": roles} if roles else {}
        data["steps"] = steps
        return Expanded(data, {f"$.params[{i}]": note for i, note in notes.items()}, self._added)

    def _hovers(self) -> str:
        """Return the height that the request gives for certain, or the usual one where it gives none; "" = neither."""
        far = {f"{one.si:g} m" for one in self._lift.words.amounts if one.type == "distance"}
        return "" if "FlyTo" not in self._verbs or len(far) > 1 else next(iter(far), HEIGHT)

    def _at_once(self, steps: list[Any]) -> list[Any]:
        """Return the steps of each machine in a branch of its own, if the request wants that and the tree has no branches."""
        if not at_once(self._lift.words):
            return steps
        by_agent: dict[str, list[Any]] = {}
        for step in steps:
            inner = step["sequence"] if isinstance(step, dict) and set(step) == {"sequence"} else [step]
            agents = {str(one.get("agent")) for one in inner if isinstance(one, dict) and "do" in one}
            if len(agents) != 1 or any(not isinstance(one, dict) or not {"do", "wait"} & set(one) for one in inner):
                return steps
            by_agent.setdefault(agents.pop(), []).extend(inner)
        if len(by_agent) < 2:
            return steps
        self._added.append(f"{' and '.join(by_agent)} fly at the same time, as the request says")
        return [{"parallel": [{"sequence": own} for own in by_agent.values()]}]

    def _pin(self) -> None:
        """Give an agent that the request names by its id to the one role that it can have."""
        agents = self._world.site.agents
        wrong = [one for one in self._roles.values() if isinstance(one.get("id"), (list, dict))]
        if wrong:
            raise ShortError("$.agents", f"the id of {wrong[0].get('name')} must be one text, such as 'lwd_1'")
        taken = {role.get("id") for role in self._roles.values()}
        named = [one for one in self._lift.words.agents if one not in taken]
        for type_ in {agents[one].type for one in named}:
            ids = [one for one in named if agents[one].type == type_]
            free = [name for name, role in self._roles.items() if role.get("type") == type_]
            if len(ids) == len(free) == 1 and not self._roles[free[0]].get("id"):
                self._roles[free[0]] = {**self._roles[free[0]], "id": ids[0]}
                self._added.append(f"{free[0]} is {ids[0]}, as the request says")

    def _role(self, name: str, role: Mapping[str, Any], index: int) -> dict[str, Any]:
        path = f"$.agents[{index}]"
        type_ = _text(role.get("type"), f"{path}.type")
        known = self._world.catalogue.types.get(type_)
        found: dict[str, Any] = {"name": name, "type": type_}
        if role.get("id"):
            wanted = str(role["id"])
            if known is not None and wanted in self._world.site.agents:
                found["type"] = self._world.site.agents[wanted].type
            found["id"] = {"lit": wanted}
        count = role.get("count")
        if count is not None and count != 1:
            found["count"] = {"lit": count}
        if known is None or not known.human:
            near = role.get("near") or ("" if role.get("id") else self._first_place.get(name) or "base")
            if near:
                found["near"] = self._value(in_compass(str(near)), "place", "place", f"{path}.near")
        return found

    def steps(self, steps: Any, path: str) -> list[dict[str, Any]]:
        listed = self._kept(_list(steps, path))
        if "ReturnHome" in self._verbs:
            site = self._world.site
            known = {*site.places, *site.regions, *self._roles, *self._lift.local}
            listed = homeward(listed, known, self._added)
        return [self.step(_object(one, f"{path}[{i}]"), f"{path}[{i}]") for i, one in enumerate(listed)]

    def _kept(self, steps: list[Any]) -> list[Any]:
        """Return the steps with a question's answer kept under the name by which a later `if` asks for it."""
        found = list(steps)
        for index, step in enumerate(found):
            name = re.match(
                r"\s*(?:not\s+)?([A-Za-z_]\w*)\.answer\b", str(step.get("if", "")) if isinstance(step, dict) else ""
            )
            asks = [i for i, one in enumerate(found[:index]) if isinstance(one, dict) and "ask" in one]
            if name is None or not asks or any(found[i].get("save_as") for i in asks):
                continue
            found[asks[-1]] = {**found[asks[-1]], "save_as": name[1]}
            self._added.append(f"the answer is kept as {name[1]}, for a later step looks at it")
        return found

    def step(self, step: Mapping[str, Any], path: str) -> dict[str, Any]:
        if "do" in step:
            return self._do(step, path)
        kind = next((k for k in STEPS if step.get(k) is not None), "")
        if not kind:
            raise ShortError(path, f"this is no step: it has none of the keys do, {', '.join(STEPS)}")
        value = branched(step[kind], self._added) if kind == "parallel" else step[kind]
        if kind == "parallel" and (one := self._as_team(value)) is not None:
            return self._do(one, path)
        if kind in ("parallel", "sequence"):
            return {kind: self.steps(value, f"{path}.{kind}")}
        if kind == "for":
            return self._for(step, path)
        if kind == "repeat":
            return self._repeat(step, path)
        if kind == "if":
            return self._if(step, path)
        if kind == "ask":
            return self._ask(step, path)
        if kind == "wait":
            return {"wait": self._value(str(value), "duration", "wait", f"{path}.wait")}
        if kind == "notify":
            return {"notify": _text(value, f"{path}.notify")}
        return {kind: self._condition(value)}

    def _as_team(self, branches: Any) -> dict[str, Any] | None:
        """Return the one step of a team whose branches send it to as many places as it has members."""
        if not isinstance(branches, list) or not all(isinstance(one, dict) and "do" in one for one in branches):
            return None
        verb, agent = str(branches[0]["do"]) if branches else "", str(branches[0].get("agent")) if branches else ""
        where = self._moves.where(verb) if verb in self._verbs else ""
        rest = [{key: value for key, value in one.items() if key != where} for one in branches]
        places = [str(one.get(where, "")) for one in branches]
        if not where or any(one != rest[0] for one in rest) or self._count(self._lift.role(agent)) != len(branches):
            return None
        return None if any(map(is_list, places)) else {**branches[0], where: f"[{', '.join(places)}]"}

    def _do(self, step: Mapping[str, Any], path: str) -> dict[str, Any]:
        name = _text(step["do"], f"{path}.do")
        agent = self._lift.role(_text(step.get("agent"), f"{path}.agent"))
        if name not in self._verbs:
            raise ShortError(f"{path}.do", f"there is no verb '{name}'; verbs: {', '.join(self._verbs)}")
        own = {k: v for k, v in step.items() if k not in ("do", "agent", "save_as") and v is not None}
        type_ = str(self._roles.get(agent, {}).get("type", ""))
        name, own = self._regions.fitting(name, type_, self._count(agent), own)
        name, own = self._moves.landing(name, agent, self._moves.height(self._moves.legs(own)))
        region = next((key for key, type_ in self._verbs[name].fields.items() if type_ == "region"), "")
        if region:
            self._moves.at.leaves(agent)
        where = self._moves.where(name)
        if where and isinstance(own.get(where), str):
            own[where] = self._moves.wayward(own[where], agent)
            if self._count(agent) > 1:
                return self._by_team(name, agent, own, where, path)
            name, own = self._moves.of_one(name, agent, own, where)
        elif self._count(agent) > 1:
            return self._by_team(name, agent, own, region if is_list(str(own.get(region, ""))) else "", path)
        found = self._one(name, agent, own, path, step.get("save_as"))
        if name == "ReturnHome" and self._moves.leaves_ground(agent) and self._verbs[name].library == FLYING:
            found["call"] = "FetchHome"
        return found

    def _is_machine(self, role: str) -> bool:
        type_ = self._world.catalogue.types.get(str(self._roles.get(role, {}).get("type", "")))
        return type_ is not None and not type_.human

    def _count(self, role: str) -> int:
        count = self._roles.get(role, {}).get("count")
        return count if isinstance(count, int) and self._is_machine(role) else 1

    def _by_team(self, name: str, team: str, own: dict[str, Any], where: str, path: str) -> dict[str, Any]:
        """Return a step that each member of a team does at its own place; they do it at the same time."""
        member = member_of(team, set(self._roles) | set(self._verbs))
        self._lift.local.add(member)
        of = [{"name": member, "value": {"expr": team}}]
        kind = self._verbs[name].fields.get(where, "place")
        if kind == "region":
            places = own[where]
            self._moves.of_team(name, team, self._count(team), own, "")
        else:
            name, own, where, places = self._moves.of_team(name, team, self._count(team), own, where)
        if where:
            listed = {"expr": self._lift.expression(places)}
            self._lift.local.add("spot")
            of.append({"name": "spot", "value": listed})
            self._note_place(team, listed, "list" if kind != "region" else "list of region")
            own = {**own, where: "spot"}
        return {"for": of, "mode": "parallel", "steps": [self._one(name, member, own, path, None)]}

    def _one(self, name: str, agent: str, own: dict[str, Any], path: str, save_as: Any) -> dict[str, Any]:
        """Return the step of one verb and one agent."""
        verb = self._verbs[name]
        unknown = [key for key in own if key not in verb.fields]
        if unknown:
            legal = ", ".join(verb.fields) or "nothing"
            raise ShortError(f"{path}.{unknown[0]}", f"{name} does not take '{unknown[0]}'; it takes: {legal}")
        missing = [key for key in verb.required if key not in own]
        if missing:
            raise ShortError(path, f"{name} needs '{missing[0]}' ({verb.fields[missing[0]]})")
        values = {}
        for key, value in own.items():
            type_ = verb.fields[key]
            values[key] = self._value(value, type_, key, f"{path}.{key}")
            if type_ in ("place", "position", "region") or type_.startswith("list of p"):
                self._note_place(agent, values[key], type_)
        saved = {"save_as": str(save_as)} if save_as else {}
        if not verb.library:
            return {"action": name, "agent": agent, **{field_key(k): v for k, v in values.items()}, **saved}
        if verb.library not in self._imports:
            self._imports.append(verb.library)
        given = [{"name": verb.role, "value": {"expr": agent}}]
        return {"call": name, "with": [*given, *({"name": k, "value": v} for k, v in values.items())], **saved}

    def _note_place(self, agent: str, value: Mapping[str, Any], type_: str) -> None:
        """Keep where an agent goes first: the nearest one is to be taken."""
        text = value.get("expr")
        if not isinstance(text, str) or agent in self._first_place:
            return
        if type_ == "region":
            text = f"centroid({text})"
        elif type_ == "list of region":
            text = f"[{', '.join(f'centroid({one})' for one in split_list(text.strip('[]')))}]"
        elif type_ == "position":
            text = f"ground({text})"
        elif type_.startswith("list of"):
            text = f"first({text})"
        if not set(_FREE.findall(text)) & (set(self._roles) | self._lift.local):
            self._first_place[agent] = text

    def _if(self, step: Mapping[str, Any], path: str) -> dict[str, Any]:
        found: dict[str, Any] = {"if": self._condition(step["if"])}
        self._moves.at.begin_if(str(step["if"]))
        found["then"] = self.steps(step.get("then"), f"{path}.then")
        self._moves.at.begin_else()
        if step.get("else"):
            found["else"] = self.steps(step["else"], f"{path}.else")
        self._moves.at.end_if()
        return found

    def _looped(self, steps: Any, path: str) -> list[dict[str, Any]]:
        """Return the steps of a loop."""
        self._moves.at.begin_loop()
        found = self.steps(steps, path)
        self._moves.at.end_loop()
        return found

    def _for(self, step: Mapping[str, Any], path: str) -> dict[str, Any]:
        names = [one.strip() for one in _text(step["for"], f"{path}.for").split(",")]
        lists = split_list(_text(step.get("in"), f"{path}.in"))
        if len(names) != len(lists):
            raise ShortError(f"{path}.in", f"{len(names)} names, but {len(lists)} lists")
        of = []
        for name, text in zip(names, lists, strict=True):
            of.append({"name": name, "value": {"expr": self._lift.expression(text)}})
        self._lift.local |= set(names)
        found: dict[str, Any] = {"for": of}
        if step.get("mode") == "parallel":
            found["mode"] = "parallel"
        return {**found, "steps": self._looped(step.get("steps"), f"{path}.steps")}

    def _repeat(self, step: Mapping[str, Any], path: str) -> dict[str, Any]:
        text = str(step["repeat"]).strip()
        text = re.sub(r"\s*times?$", "", text)
        if text == "forever":
            found: dict[str, Any] = {"repeat": {"lit": "forever"}}
        elif re.fullmatch(r"\d+", text):
            found = {"repeat": self._value(text, "int", "rounds", path)}
        else:
            found = {"repeat": self._value(text, "duration", "how_long", path)}
        if step.get("every"):
            found["every"] = self._value(str(step["every"]), "duration", "every", f"{path}.every")
        if step.get("until"):
            found["until"] = self._condition(step["until"])
        return {**found, "steps": self._looped(step.get("steps"), f"{path}.steps")}

    def _ask(self, step: Mapping[str, Any], path: str) -> dict[str, Any]:
        of = step.get("of")
        people = [str(one) for one in of] if isinstance(of, list) else [str(of)] if of else []
        known = [self._person(one, path) for one in people] or ["watchers"]
        found: dict[str, Any] = {"ask": _text(step["ask"], f"{path}.ask"), "of": known}
        options = [str(one) for one in step["options"]] if isinstance(step.get("options"), list) else []
        if options and options != ["yes", "no"]:
            found["options"] = options
        found["timeout"] = self._value(ASKED_FOR, "duration", "answer_within", path)
        if self._asks_only:  # any answer will do, for nothing depends on it
            return found
        if step.get("save_as"):
            self._moves.at.asks(str(step["save_as"]), options)
            return {**found, "save_as": str(step["save_as"])}
        best = goes_on_with(step, options)
        return {**found, "expect": f"result.answer == '{best}'"} if best else found

    def _person(self, name: str, path: str) -> str:
        """Return whom to ask: a role, a site role; a role is made for a type or for a person of the site."""
        name = self._lift.role(name)
        if name in self._roles or name in self._world.site.people:
            return name
        of_id = next((role for role, of in self._roles.items() if of.get("id") == name), "")
        if of_id:
            return of_id
        agents, types = self._world.site.agents, self._world.catalogue.types
        plain = name if name in types else name.rstrip("s")
        if plain in types and types[plain].human:
            for role, of in self._roles.items():
                if of.get("type") == plain:
                    return role
            self._roles[plain] = {"name": plain, "type": plain}
            return plain
        if name in agents and types[agents[name].type].human:
            role = f"the_{agents[name].type}"
            role = f"the_{name}" if role in self._roles else role
            self._roles[role] = {"name": role, "type": agents[name].type, "id": name}
            return role
        raise ShortError(f"{path}.of", f"there is nobody called '{name}'; name a role of a person, or a type of people")

    def _condition(self, value: Any) -> str:
        return self._lift.expression(str(value))

    def _value(self, value: Any, type_: str, key: str, path: str) -> dict[str, Any]:
        if isinstance(value, dict) and set(value) == {"expr"}:
            value = value["expr"]
        elif isinstance(value, dict) and set(value) == {"lit"}:
            value = value["lit"]
        if isinstance(value, (dict, list)) or value is None:
            raise ShortError(path, "a value is a text, such as '40 m', 'camp' or 'circle(base, 3 m)'")
        return self._lift.value(str(value).lower() if isinstance(value, bool) else str(value), type_, key)


def _asks_only(steps: Any) -> bool:
    return isinstance(steps, list) and all(isinstance(one, dict) and "ask" in one for one in steps)


def _object(value: Any, path: str) -> dict[str, Any]:
    if isinstance(value, dict):
        return value
    raise ShortError(path, "this must be an object")


def _list(value: Any, path: str) -> list[Any]:
    if isinstance(value, list):
        return value
    raise ShortError(path, "this must be a list")


def _text(value: Any, path: str) -> str:
    if isinstance(value, str) and value.strip():
        return value.strip()
    raise ShortError(path, "this must be a text")
