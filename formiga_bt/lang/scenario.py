"""Scenario files (`scenario: NAME`): a fleet, tasks at their times, and what goes wrong, for `sim`, demos and tests.

    scenario: bad-day
    site: demo-site.yaml              # beside this file, else one that ships with formiga
    speed: 10
    seed: 1
    agents: [{id: hwd_1, type: hwd, at: p5, battery: 90 %}, {id: picker_1, at: camp, person: {answers: [...]}}]
    tasks: [{at: 0 s, task: PickUp, params: {target: camp, user: picker_1}, priority: medium}]
    faults: [{at: 40 s, agent: hwd_1, kind: freeze, for: 10 s}]

Every problem is located and named at once. A scenario names tasks, not their files: they are looked up by name beside the
scenario, then in the library. Times count from the instant at which all agents are there.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Literal

from formiga_bt.clock import Micros, micros
from formiga_bt.diagnostics import Diagnostic, Mark, in_order
from formiga_bt.geo import Place, Position, horizontal_m
from formiga_bt.lang.binding import SiteEnv, below_zero, outside, run_outside
from formiga_bt.lang.document import Entry, Mapping_, Node, Scalar, parse
from formiga_bt.lang.expressions import Scope, compile_value
from formiga_bt.lang.kinds import Option
from formiga_bt.lang.loader import load_site, load_task
from formiga_bt.lang.model import Catalogue, Param, Site, Task
from formiga_bt.lang.reading import (
    Problems,
    did_you_mean,
    fix_word,
    quoted_list,
    read_flag,
    read_keys,
    read_listing,
    read_mapping,
    read_name,
    read_number,
    read_quantity,
    read_text,
    read_word,
    read_words,
    shorten,
)
from formiga_bt.lang.scope import OUTSIDE
from formiga_bt.lang.site import plain
from formiga_bt.lang.synonyms import nearest
from formiga_bt.lang.types import PLACE, AgentRef
from formiga_bt.packaged import folder

FaultKind = Literal[
    "kill",
    "restart",
    "freeze",
    "thaw",
    "nan",
    "wrong_id",
    "slow",
    "refuse",
    "take_over",
    "hand_back",
    "lose_result",
    "never_confirm",
]
Priority = Literal["low", "medium", "high"]

_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_LAT_LNG: Final = re.compile(r"\s*(-?\d+(?:\.\d+)?)\s*,\s*(-?\d+(?:\.\d+)?)\s*")
_TASK_LINE: Final = re.compile(r"^task:[ \t]*([A-Za-z][A-Za-z0-9]*)", re.MULTILINE)
FASTEST: Final = 20.0
"""People are asked: 60 s of engine time stay at least 3 s of wall time."""

SCENARIO: Final = (
    Option("scenario", "name", "The scenario's name.", required=True),
    Option("site", "value", "The site file.", required=True),
    Option("speed", "value", "Engine seconds per wall second (1)."),
    Option("seed", "value", "Of the wire's accidents in virtual time (0)."),
    Option("agents", "value", "The fleet.", required=True),
    Option("tasks", "value", "What is to be done, and when."),
    Option("faults", "value", "What goes wrong, and when."),
)
_AGENT: Final = (
    Option("id", "name", "Its id.", required=True),
    Option("type", "name", "Its type; not needed for an agent that the site lists."),
    Option("at", "value", "Where it begins: a port, a place, a point; a drone without it stands at its home."),
    Option("battery", "value", "Its charge (100 %).", type="percent"),
    Option("person", "options", "What a person does: answers, walk."),
)
_PERSON: Final = (
    Option("answers", "value", "The script of answers."),
    Option("walk", "value", "The way this person walks from the beginning: places."),
)
_ANSWER: Final = (
    Option("match", "text", "A word of the question or of an option; * fits all."),
    Option("options", "words", "The successive answers; the last one again and again."),
    Option("after", "value", "How long it takes (3 s).", type="duration"),
    Option("never", "flag", "Such questions stay open."),
)
_TASK: Final = (
    Option("at", "value", "When it is submitted (0 s).", type="duration"),
    Option("task", "name", "Which task.", required=True),
    Option("params", "map", "Its parameters."),
    Option("priority", "word", "Instead of the task's own.", values=("low", "medium", "high")),
)
_FAULT: Final = (
    Option("at", "value", "When it begins.", type="duration", required=True),
    Option("agent", "name", "Whom it befalls.", required=True),
    Option("kind", "word", "What goes wrong.", required=True),
)
_FOR: Final = Option("for", "value", "How long it lasts; without it, for good.", type="duration")
_COUNT: Final = Option("count", "value", "How many of them (1).", type="int")

FAULTS: Final[Mapping[str, tuple[Option, ...]]] = MappingProxyType(
    {
        "kill": (_FOR,),
        "restart": (),
        "freeze": (_FOR,),
        "thaw": (),
        "nan": (_COUNT,),
        "wrong_id": (_COUNT, Option("as", "name", "The id that its statuses carry.")),
        "slow": (_FOR, Option("delay", "value", "How late it speaks.", type="duration", required=True)),
        "refuse": (_COUNT, Option("code", "name", "The reason it gives (not_now).")),
        "take_over": (_FOR,),
        "hand_back": (),
        "lose_result": (_COUNT,),
        "never_confirm": (_FOR,),
    }
)
"""Kinds of faults with the options that each has besides `at`, `agent` and `kind`."""

_ENDS: Final[Mapping[str, FaultKind]] = MappingProxyType(
    {"kill": "restart", "freeze": "thaw", "take_over": "hand_back", "slow": "slow", "never_confirm": "never_confirm"}
)
_FOR_DRONES: Final = ("take_over", "hand_back")


@dataclass(frozen=True, slots=True)
class ScenarioAgent:
    """One agent: who, where, and for people how they answer."""

    id: str
    type: str
    at: Place | Position
    human: bool
    battery: float = 100.0
    home: Place | None = None
    answers: tuple[Mapping[str, Any], ...] = ()
    """Rules in order: match, options, after (seconds), never."""
    walk: tuple[Place, ...] = ()


@dataclass(frozen=True, slots=True)
class ScenarioTask:
    """One request: when, which task, with which runtime values."""

    at: Micros
    task: str
    params: Mapping[str, Any]
    priority: Priority | None = None
    texts: Mapping[str, Any] = field(default_factory=dict)
    """The parameters as written: texts, lists and mappings of texts."""


@dataclass(frozen=True, slots=True)
class ScenarioFault:
    """One thing that goes wrong; a fault that lasts for a while is two of these."""

    at: Micros
    agent: str
    kind: FaultKind
    count: int = 1
    as_id: str = "somebody_else"
    code: str = "not_now"
    delay_s: float = 0.0
    on: bool = True


@dataclass(frozen=True, slots=True)
class Scenario:
    """A checked scenario. Tasks and faults are in order of time."""

    name: str
    site: Site
    catalogue: Catalogue
    tasks: Mapping[str, Task]
    """The checked tasks that it uses, by name."""
    agents: tuple[ScenarioAgent, ...]
    requests: tuple[ScenarioTask, ...] = ()
    faults: tuple[ScenarioFault, ...] = ()
    speed: float = 1.0
    seed: int = 0
    file: str = ""


@dataclass(frozen=True, slots=True)
class LoadedScenario:
    """What became of a scenario file; `scenario` is None if there is any error."""

    scenario: Scenario | None
    diagnostics: list[Diagnostic]
    sources: Mapping[str, str] = field(default_factory=dict)


def load_scenario(path: Path, *, catalogue: Catalogue, library: Sequence[Path] | None = None) -> LoadedScenario:
    """Read and check a scenario file, its site and its tasks.

    Args:
        path: of the file.
        catalogue: agent types and actions.
        library: the folders where sites and tasks are looked up that are not beside the file; None = the packaged trees.
    """
    file = str(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        return LoadedScenario(None, [Diagnostic("E008", Mark(file, 1, 1), f"the file cannot be read: {error}")])
    return load_scenario_text(text, file, catalogue=catalogue, folders=(path.parent, *_library(library)))


def load_scenario_text(
    text: str, file: str, *, catalogue: Catalogue, folders: Sequence[Path] | None = None
) -> LoadedScenario:
    """Read the text of a scenario; `file` is its name in marks, `folders` where its site and tasks are looked up."""
    problems = Problems()
    sources = {file: text}
    node, found = parse(text, file)
    problems.extend(found)
    if node is None and not found:
        problems.add("E008", Mark(file, 1, 1), "the file is empty", "begin with: scenario: a_name")
    root = read_mapping(node, problems, "scenario") if node is not None else None
    scenario = None
    if root is not None:
        keys = read_keys(root, SCENARIO, problems, "a scenario")
        scenario = _Reader(problems, sources, keys, catalogue, folders or _library(None)).read(file)
    return LoadedScenario(None if problems.has_errors() else scenario, in_order(problems.found), sources)


def _library(library: Sequence[Path] | None) -> tuple[Path, ...]:
    return (folder("trees"),) if library is None else tuple(library)


class _Reader:
    """Reads the keys of one scenario."""

    def __init__(
        self,
        problems: Problems,
        sources: dict[str, str],
        keys: dict[str, Entry],
        catalogue: Catalogue,
        folders: Sequence[Path],
    ) -> None:
        self.problems = problems
        self.sources = sources
        self.keys = keys
        self.catalogue = catalogue
        self.folders = folders
        self.site = self._site()
        self.types: dict[str, str] = {}
        """Agent id -> type, of this scenario."""
        self.tasks: dict[str, Task | None] = {}
        self._files: dict[str, Path] | None = None

    def read(self, file: str) -> Scenario | None:
        """Build the scenario; what is wrong was reported."""
        name = self._name()
        speed, seed = self._speed(), self._seed()
        if self.site is None:
            return None  # nothing else can be read without places and agents
        agents = self._agents()
        requests = self._requests()
        faults = self._faults()
        return Scenario(
            name,
            self.site,
            self.catalogue,
            {one: task for one, task in self.tasks.items() if task is not None},
            tuple(agents),
            tuple(sorted(requests, key=lambda request: request.at)),
            tuple(sorted(faults, key=lambda fault: fault.at)),
            speed,
            seed,
            file,
        )

    # --- the head ----------------------------------------------------------------------------------------------

    def _name(self) -> str:
        at = read_text(self.keys["scenario"].value, self.problems, "scenario") if "scenario" in self.keys else None
        if at is not None and not _NAME.fullmatch(at.text):
            help_ = "a letter, then letters, digits, - and _"
            self.problems.add("E008", at.mark, f"'{shorten(at.text)}' cannot be a scenario's name", help_)
        return at.text if at is not None else ""

    def _speed(self) -> float:
        if "speed" not in self.keys:
            return 1.0
        node = self.keys["speed"].value
        speed = read_number(node, self.problems, "speed")
        if speed is not None and not 0.1 <= speed <= FASTEST:
            self.problems.add("E062", node.mark, f"'speed' must lie between 0.1 and {FASTEST:g}")
        return speed if speed is not None else 1.0

    def _seed(self) -> int:
        return self._whole(self.keys, "seed", 0, least=0)

    def _whole(self, keys: Mapping[str, Entry], key: str, default: int, least: int) -> int:
        if key not in keys:
            return default
        node = keys[key].value
        number = read_number(node, self.problems, key)
        if number is not None and (number != int(number) or not least <= number <= 1e9):
            self.problems.add("E062", node.mark, f"'{key}' must be a whole number from {least} on")
            return default
        return int(number) if number is not None else default

    def _site(self) -> Site | None:
        at = read_text(self.keys["site"].value, self.problems, "site") if "site" in self.keys else None
        if at is None:
            return None
        path = next((place / at.text for place in self.folders if at.text and _is_file(place / at.text)), None)
        if path is None:
            known = sorted({p.name for place in self.folders for p in place.glob("*site*.yaml")})
            what = f"no site file '{shorten(at.text)}'{did_you_mean(at.text, known)}"
            help_ = f"sites: {quoted_list(known)}" if known else "a path relative to this file"
            self.problems.add("E008", at.mark, what, help_, fix_word(at, nearest(at.text, known)))
            return None
        site, found, sources = load_site(path, self.catalogue)
        self.problems.extend(found)
        self.sources.update(sources)
        return site

    # --- agents ------------------------------------------------------------------------------------------------

    def _agents(self) -> list[ScenarioAgent]:
        nodes = self._items("agents")
        found: list[ScenarioAgent] = []
        for node in nodes:
            mapping = read_mapping(node, self.problems, "agent")
            keys = read_keys(mapping, _AGENT, self.problems, "an agent") if mapping is not None else {}
            agent = self._agent(keys, node.mark) if keys else None
            if agent is not None:
                self._check_room(agent, keys.get("at"), node.mark, found)
                found.append(agent)
        if "agents" in self.keys and not nodes and not self.problems.has_errors():
            self.problems.add("E044", self.keys["agents"].value.mark, "'agents' is an empty list")
        return found

    def _agent(self, keys: Mapping[str, Entry], mark: Mark) -> ScenarioAgent | None:
        assert self.site is not None
        id_ = read_name(keys["id"].value, self.problems, "id") if "id" in keys else None
        if id_ is None:
            return None
        listed = self.site.agents.get(id_.text)
        type_ = self._type(id_, keys)
        if type_ is None:
            return None
        if id_.text in self.types:
            self.problems.add("E018", id_.mark, f"there is an agent '{id_.text}' already")
            return None
        self.types[id_.text] = type_
        human = self.catalogue.types[type_].human
        battery = self._quantity(keys, "battery", "percent", 100.0)
        if not 0.0 <= battery <= 100.0:
            self.problems.add("E062", keys["battery"].value.mark, "'battery' must lie between 0 % and 100 %")
        if "person" in keys and not human:
            self.problems.add("E008", keys["person"].key.mark, f"'{id_.text}' is a {type_}: only people have 'person'")
        answers, walk = self._person(keys["person"].value) if "person" in keys and human else ((), ())
        home = self.site.ports.get(listed.home) if listed is not None else None
        at: Place | Position | None = home.at if home is not None else None
        if "at" in keys:
            node = keys["at"].value
            at = self._point(node)
            if home is None and isinstance(node, Scalar) and node.text in self.site.ports:
                home = self.site.ports[node.text]
        elif at is None:
            self.problems.add("E008", mark, f"'{id_.text}' has no port of its own: it needs 'at'", "add at:")
        if at is None:
            return None
        return ScenarioAgent(
            id_.text, type_, at, human, battery, home.at if home is not None and not human else None, answers, walk
        )

    def _type(self, id_: Scalar, keys: Mapping[str, Entry]) -> str | None:
        assert self.site is not None
        listed = self.site.agents.get(id_.text)
        if "type" not in keys:
            if listed is not None and listed.type in self.catalogue.types:
                return listed.type
            what = f"'{id_.text}' needs 'type': the site does not list it{did_you_mean(id_.text, self.site.agents)}"
            self.problems.add("E008", id_.mark, what, "add type:")
            return None
        at = read_name(keys["type"].value, self.problems, "type")
        if at is None:
            return None
        known = list(self.catalogue.types)
        if at.text not in known:
            what = f"no agent type is called '{shorten(at.text)}'{did_you_mean(at.text, known)}"
            self.problems.add(
                "E020", at.mark, what, f"types: {quoted_list(known)}", fix_word(at, nearest(at.text, known))
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
        if agent.human:
            return
        other = next((o for o in others if _touch(o, agent)), None)
        if other is not None:
            what = f"'{agent.id}' stands where '{other.id}' stands"
            self.problems.add("E018", at.value.mark if at is not None else mark, what, "drones need 2 m and more")

    def _person(self, node: Node) -> tuple[tuple[Mapping[str, Any], ...], tuple[Place, ...]]:
        mapping = read_mapping(node, self.problems, "person")
        keys = read_keys(mapping, _PERSON, self.problems, "a person") if mapping is not None else {}
        rules = read_listing(keys["answers"].value, self.problems, "answers") if "answers" in keys else ()
        way = read_listing(keys["walk"].value, self.problems, "walk") if "walk" in keys else ()
        points = [self._point(item) for item in way or ()]
        walk = tuple(point if isinstance(point, Place) else point.ground for point in points if point is not None)
        return tuple(rule for item in rules or () if (rule := self._answer(item)) is not None), walk

    def _answer(self, node: Node) -> Mapping[str, Any] | None:
        mapping = read_mapping(node, self.problems, "answers")
        if mapping is None:
            return None
        keys = read_keys(mapping, _ANSWER, self.problems, "an answer")
        match = read_text(keys["match"].value, self.problems, "match") if "match" in keys else None
        said = read_words(keys["options"].value, self.problems, "options") if "options" in keys else []
        never = read_flag(keys["never"].value, self.problems, "never") if "never" in keys else False
        if not never and not said:
            self.problems.add("E008", mapping.mark, "an answer needs 'options' or 'never: true'", "options: [loaded]")
        after = self._duration(keys, "after", 3.0)
        return {
            "match": match.text if match is not None else "*",
            "options": [word.text for word in said],
            "after": after,
            "never": never,
        }

    def _point(self, node: Node) -> Place | Position | None:
        """Read a port's name, a place's name, `lat,lng`, or a mapping with or without a height."""
        assert self.site is not None
        if isinstance(node, Scalar):
            if node.text in self.site.ports:
                at: Place = self.site.ports[node.text].at
                return at
            degrees = _LAT_LNG.fullmatch(node.text)
            if degrees is None and node.text not in self.site.places and node.text != "base":
                known = ["base", *self.site.ports, *self.site.places]
                what = f"no port or place is called '{shorten(node.text)}'{did_you_mean(node.text, known)}"
                meant = nearest(node.text, known)
                self.problems.add("E010", node.mark, what, f"known: {quoted_list(known)}", fix_word(node, meant))
                return None
            if node.text == "base":
                return Place(0.0, 0.0)
        height = node.get("height") if isinstance(node, Mapping_) else None
        if isinstance(node, Mapping_) and height is not None:
            node = Mapping_(tuple(entry for entry in node.entries if entry is not height), node.mark)
        place = self._value(node, Param("at", PLACE, node.mark))
        if not isinstance(place, Place) or height is None:
            return place if isinstance(place, Place) else None
        up_m = read_quantity(height.value, self.problems, "height", "distance")
        return Position(place.east_m, place.north_m, up_m) if up_m is not None else None

    # --- tasks -------------------------------------------------------------------------------------------------

    def _requests(self) -> list[ScenarioTask]:
        found = []
        for node in self._items("tasks"):
            mapping = read_mapping(node, self.problems, "task")
            keys = read_keys(mapping, _TASK, self.problems, "a task") if mapping is not None else {}
            name = read_name(keys["task"].value, self.problems, "task") if "task" in keys else None
            at = micros(self._duration(keys, "at", 0.0))
            priority = ""
            if "priority" in keys:
                priority = read_word(keys["priority"].value, self.problems, "priority", ("low", "medium", "high"))
            task = self._task(name) if name is not None else None
            if name is None or task is None:
                continue
            with self.problems.within(task.name):
                params = self._params(task, keys.get("params"), name)
            wanted: dict[str, Priority] = {"low": "low", "medium": "medium", "high": "high"}
            written = keys["params"].value if "params" in keys else None
            texts = plain(written) if isinstance(written, Mapping_) else {}
            found.append(ScenarioTask(at, task.name, params, wanted.get(priority), texts))
        return found

    def _task(self, name: Scalar) -> Task | None:
        if name.text in self.tasks:
            return self.tasks[name.text]
        files = self._task_files()
        if name.text not in files:
            what = f"no task is called '{shorten(name.text)}'{did_you_mean(name.text, files)}"
            meant = nearest(name.text, files)
            self.problems.add("E010", name.mark, what, f"tasks: {quoted_list(sorted(files))}", fix_word(name, meant))
            return None
        path = files[name.text]
        loaded = load_task(path, catalogue=self.catalogue, site=self.site)
        errors = [problem for problem in loaded.diagnostics if problem.severity == "error"]
        if errors:
            self.problems.add("E010", name.mark, f"{name.text} has errors ({path})", "mend the task first")
            self.problems.extend(errors)
            self.sources.update(loaded.sources)
        self.tasks[name.text] = loaded.task
        return loaded.task

    def _task_files(self) -> dict[str, Path]:
        """Return the task files beside the scenario and of the library, by the name of the task; the first one counts."""
        if self._files is None:
            self._files = {}
            for path in (p for place in self.folders for p in sorted(place.glob("*.yaml"))):
                try:
                    line = _TASK_LINE.search(path.read_text(encoding="utf-8"))
                except (OSError, UnicodeDecodeError):
                    continue
                if line is not None:
                    self._files.setdefault(line[1], path)
        return self._files

    def _params(self, task: Task, entry: Entry | None, name: Scalar) -> dict[str, Any]:
        mapping = read_mapping(entry.value, self.problems, "params") if entry is not None else None
        by_name = {alias: param for param in task.params.values() for alias in (param.name, *param.aliases)}
        values: dict[str, Any] = {}
        given = set()
        for one in mapping.entries if mapping is not None else ():
            param = by_name.get(one.key.text)
            if param is None:
                meant = nearest(one.key.text, by_name)
                what = f"{task.name} has no parameter '{shorten(one.key.text)}'{did_you_mean(one.key.text, by_name)}"
                help_ = f"parameters: {quoted_list(task.params) or 'none'}"
                self.problems.add("E010", one.key.mark, what, help_, fix_word(one.key, meant))
                given.add(meant)
                continue
            given.add(param.name)
            value = self._value(one.value, param)
            if value is not None:
                values[param.name] = value
        for param in task.params.values():
            if param.name not in given and param.default is None and not param.optional:
                what = f"{task.name} needs the parameter '{param.name}' ({param.type})"
                self.problems.add("E051", name.mark, what, f"params: {{{param.name}: ...}}")
        return values

    def _value(self, node: Node, param: Param) -> Any:
        """Return a literal as a runtime value, or None if it was reported."""
        assert self.site is not None
        if param.type.name == "agent":
            return self._agent_value(node, param)
        degrees = _LAT_LNG.fullmatch(node.text) if param.type.name == "place" and isinstance(node, Scalar) else None
        if degrees is not None:
            place = SiteEnv(self.site).place(float(degrees[1]), float(degrees[2]))
            self.problems.extend(outside(param, place, self.site, node.mark))
            return place
        expr, found = compile_value(node, Scope({}, site=self.site, built_ins=OUTSIDE), param.type)
        if not found:
            value, found = run_outside(expr, self.site, node.mark, param.name)
            found = found or outside(param, value, self.site, node.mark)
        self.problems.extend(found)
        if any(problem.severity == "error" for problem in found):
            return None
        self._check_bounds(param, value, node.mark)
        return value

    def _check_bounds(self, param: Param, value: Any, mark: Mark) -> None:
        assert self.site is not None
        if below_zero(param, value):
            self.problems.add("E062", mark, f"'{param.name}' is a duration, it cannot be below 0 s")
        for bound, word, beyond in ((param.min, "least", -1), (param.max, "most", 1)):
            if bound is None or not isinstance(value, int | float):
                continue
            limit, found = run_outside(bound, self.site, bound.mark, f"the limit of {param.name}")
            self.problems.extend(found)
            if not found and (value - limit) * beyond > 0:
                self.problems.add("E062", mark, f"'{param.name}' must be at {word} {bound.source}")
        if param.choices and str(value) not in param.choices:
            what = f"'{param.name}' must be one of {quoted_list(param.choices)}"
            self.problems.add("E014", mark, what + did_you_mean(str(value), param.choices))

    def _agent_value(self, node: Node, param: Param) -> AgentRef | None:
        at = read_text(node, self.problems, param.name)
        if at is None:
            return None
        of = self.types.get(at.text)
        fitting = [id_ for id_, type_ in self.types.items() if self._is_a(type_, param.type.of)]
        if of is None:
            what = f"no agent of this scenario is called '{shorten(at.text)}'{did_you_mean(at.text, fitting)}"
            meant = nearest(at.text, fitting)
            self.problems.add("E010", at.mark, what, f"agents: {quoted_list(fitting)}", fix_word(at, meant))
            return None
        if not self._is_a(of, param.type.of):
            what = f"'{param.name}' is a {' or '.join(param.type.of)}, '{at.text}' is a {of}"
            self.problems.add("E013", at.mark, what, f"agents: {quoted_list(fitting)}")
            return None
        return AgentRef(at.text)

    def _is_a(self, type_: str, of: Sequence[str]) -> bool:
        return not of or type_ in of or any(parent in of for parent in self.catalogue.types[type_].extends)

    # --- faults ------------------------------------------------------------------------------------------------

    def _faults(self) -> list[ScenarioFault]:
        found = []
        for node in self._items("faults"):
            mapping = read_mapping(node, self.problems, "fault")
            if mapping is not None:
                found += self._fault(mapping)
        return found

    def _fault(self, mapping: Mapping_) -> list[ScenarioFault]:
        entry = mapping.get("kind")
        kind = read_word(entry.value, self.problems, "kind", tuple(FAULTS)) if entry is not None else ""
        every = tuple({o.name: replace(o, required=False) for options in FAULTS.values() for o in options}.values())
        owner = f"the fault '{kind}'" if kind else "a fault"
        keys = read_keys(mapping, (*_FAULT, *(FAULTS[kind] if kind else every)), self.problems, owner)
        agent = read_name(keys["agent"].value, self.problems, "agent") if "agent" in keys else None
        at, lasts = micros(self._duration(keys, "at", 0.0)), self._duration(keys, "for", 0.0)
        if agent is not None and agent.text not in self.types:
            what = f"no agent of this scenario is called '{shorten(agent.text)}'{did_you_mean(agent.text, self.types)}"
            meant = nearest(agent.text, self.types)
            self.problems.add("E010", agent.mark, what, f"agents: {quoted_list(self.types)}", fix_word(agent, meant))
            return []
        if kind in _FOR_DRONES and agent is not None and self.catalogue.types[self.types[agent.text]].human:
            self.problems.add("E013", agent.mark, f"'{agent.text}' is a person: nobody can take over", "name a drone")
        if agent is None or not kind:
            return []
        as_id = read_name(keys["as"].value, self.problems, "as") if "as" in keys else None
        code = read_name(keys["code"].value, self.problems, "code") if "code" in keys else None
        known: Mapping[str, FaultKind] = {one: one for one in FAULTS}  # type: ignore[misc]  # its keys are the kinds
        begin = ScenarioFault(
            at,
            agent.text,
            known[kind],
            self._whole(keys, "count", 1, least=1),
            as_id.text if as_id is not None else "somebody_else",
            code.text if code is not None else "not_now",
            self._duration(keys, "delay", 0.0),
        )
        if lasts <= 0.0:
            return [begin]
        return [begin, ScenarioFault(at + micros(lasts), agent.text, _ENDS[kind], on=False)]

    # --- small parts -------------------------------------------------------------------------------------------

    def _items(self, key: str) -> Sequence[Node]:
        return read_listing(self.keys[key].value, self.problems, key) or () if key in self.keys else ()

    def _quantity(self, keys: Mapping[str, Entry], key: str, kind: str, default: float) -> float:
        value = read_quantity(keys[key].value, self.problems, key, kind) if key in keys else None
        return default if value is None else value

    def _duration(self, keys: Mapping[str, Entry], key: str, default: float) -> float:
        value = self._quantity(keys, key, "duration", default)
        if value < 0.0:
            self.problems.add("E062", keys[key].value.mark, f"'{key}' must not be negative")
        return max(0.0, value)


def _touch(a: ScenarioAgent, b: ScenarioAgent) -> bool:
    heights = [point.up_m if isinstance(point, Position) else 0.0 for point in (a.at, b.at)]
    return not a.human and horizontal_m(a.at, b.at) < 2.0 and abs(heights[0] - heights[1]) < 2.0


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
