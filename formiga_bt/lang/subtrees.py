"""Subtrees: found by name as seen from a file, read once, with what they need of the agents that are passed to them."""

from msgspec.structs import replace

from formiga_bt.lang.body import Body
from formiga_bt.lang.files import Unit
from formiga_bt.lang.flow import NamedValue
from formiga_bt.lang.keyed import read_keys
from formiga_bt.lang.kinds import SUBTREE
from formiga_bt.lang.model import Subtree
from formiga_bt.lang.own_records import records_of
from formiga_bt.lang.params import read_params
from formiga_bt.lang.steps.step import read_steps
from formiga_bt.lang.text.document import Entry, Scalar
from formiga_bt.lang.text.reading import Problems, did_you_mean, fix_word, quoted_list, read_mapping
from formiga_bt.lang.text.synonyms import surely
from formiga_bt.lang.types import ANY
from formiga_bt.lang.world import Callee, World, agent_types_of
from formiga_bt.lang.written import saves


class Subtrees:
    """The subtrees of all files of one task."""

    def __init__(self, world: World, problems: Problems) -> None:
        self.world = world
        self.problems = problems
        self.dropped = False
        self.called: set[tuple[str, str]] = set()
        self.words: set[str] = set()
        """Used in the bodies of subtrees, also in steps with errors."""
        self._done: dict[tuple[str, str], Callee | None] = {}
        self._worlds: dict[str, World] = {}
        self._open: list[tuple[str, str]] = []

    def read_all(self, unit: Unit) -> None:
        """Read every subtree that a file defines, called or not."""
        for name in unit.own:
            self._get(unit, name)

    def world_of(self, unit: Unit) -> World:
        """Return the world as a file sees it: with the records that it declares or imports."""
        if unit.file not in self._worlds:
            records = records_of(unit, self.world.catalogue, self.problems)
            self._worlds[unit.file] = replace(self.world, records=records) if records else self.world
        return self._worlds[unit.file]

    def read_one(self, unit: Unit, name: str) -> Callee | None:
        """Return a subtree that a file defines, with what it calls; None if there is none of that name."""
        return self._get(unit, name) if name in unit.own else None

    def callee(self, unit: Unit, name: str) -> Callee | None:
        """Return a subtree of a file that was read before."""
        return self._done.get((unit.file, name))

    def resolve(self, unit: Unit, at: Scalar) -> Callee | None:
        """Return the subtree that a call in `unit` names; report E050 or E051 if there is none."""
        owner = unit.find(at.text)
        if owner is None:
            known = unit.visible()
            unit.called.update(imported.file for _, imported in unit.imports)
            meant = surely(at.text, known)
            help_ = f"subtrees: {quoted_list(known)}" if known else "import a library or add subtrees:"
            what = f"no subtree is called '{at.text}'{did_you_mean(at.text, known)}"
            self.problems.add("E050", at.mark, what, help_, fix_word(at, meant))
            return None
        unit.called.add(owner.file)
        key = (owner.file, at.text)
        self.called.add(key)
        if key in self._open:
            names = [name for _, name in self._open[self._open.index(key) :]]
            through = f" through {' and '.join(names[1:])}" if len(names) > 1 else ""
            self.problems.add("E051", at.mark, f"{at.text} calls itself{through}", "a subtree cannot be recursive")
            return None
        return self._get(owner, at.text)

    def _get(self, unit: Unit, name: str) -> Callee | None:
        key = (unit.file, name)
        if key not in self._done:
            self._open.append(key)
            with self.problems.outermost(name):
                self._done[key] = self._read(unit, unit.own[name])
            self._open.pop()
        return self._done[key]

    def _read(self, unit: Unit, entry: Entry) -> Callee | None:
        mapping = read_mapping(entry.value, self.problems, entry.key.text)
        if mapping is None:
            return None
        keys = read_keys(mapping, SUBTREE, self.problems, f"subtree '{entry.key.text}'")
        world = self.world_of(unit)
        params = read_params(keys["params"].value, world, self.problems) if "params" in keys else {}
        body = Body(world, self.problems, lambda at: self.resolve(unit, at))
        for param in params.values():
            body.define(
                param.name, NamedValue(param.type, param.mark, "param"), param.optional and param.default is None
            )
        body.agents = agent_types_of(params)
        steps_node = keys["steps"].value if "steps" in keys else None
        if steps_node is not None:
            body.later = {at.text: at.mark for at in saves(steps_node)}
        with self.problems.within("steps"):
            steps = read_steps(body, steps_node, "steps", "steps") if steps_node is not None else ()
        returns = body.value(keys["returns"].value, ANY, "returns", optional=False) if "returns" in keys else None
        self.dropped = self.dropped or body.dropped
        self.words |= body.used
        body.report_unused(params, "param")
        body.report_unread()
        subtree = Subtree(entry.key.text, params, steps, entry.key.mark, returns)
        needs = {name: tuple(actions) for name, actions in body.needs.items()}
        releases = tuple(name for name in params if name in body.flow.released)
        heights = {name: agent for name, agent in body.heights.items() if name in params and agent in params}
        return Callee(subtree, needs, returns.type if returns is not None else None, releases, heights)
