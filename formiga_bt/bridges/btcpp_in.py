"""XML of BehaviorTree.CPP (3 and 4) as a task file in canonical style. Called by `formiga import`.

Reads what `btcpp_out` wrote and what others wrote. The text always parses as YAML of the language; what cannot be carried
over is reported at its XML line and stands as a `# TODO` where a person has to decide.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from formiga_bt.base.diagnostics import Diagnostic, Mark
from formiga_bt.base.units import LIKELY, format_quantity
from formiga_bt.bridges.conditions_in import Ports, named
from formiga_bt.bridges.elements import XmlElement, XmlRefused, parse
from formiga_bt.bridges.findings import Findings
from formiga_bt.bridges.leaves_in import Step
from formiga_bt.bridges.scripts import assigned_names
from formiga_bt.bridges.steps_in import StepReader
from formiga_bt.bridges.table import ERRORS, our_name
from formiga_bt.bridges.values_in import ImportScope, as_param, camel, clean, unfold, words
from formiga_bt.bridges.yaml_text import TODO, FlowMapping, document, one_line
from formiga_bt.lang.model import Catalogue
from formiga_bt.lang.text.formatting import format_text

_CATEGORIES: Final = ("Action", "Condition", "Control", "Decorator")
_KNOWN: Final = frozenset({"ID", "name", "_description", "_formiga"})
_MOST_TREES: Final = 500


@dataclass(frozen=True, slots=True)
class Imported:
    """The task file's text ("" if the XML is refused), and what was found (codes `X..`) in the order of the XML."""

    text: str
    found: list[Diagnostic]

    @property
    def errors(self) -> list[Diagnostic]:
        """What cannot be said in the language: the text, if there is one, fails at these places."""
        return [one for one in self.found if one.code in ERRORS]


def import_btcpp(data: bytes, file: str, catalogue: Catalogue | None = None) -> Imported:
    """Return an XML file of BehaviorTree.CPP as a task file.

    Args:
        data: of the XML file.
        file: its name in the places of what is found.
        catalogue: to tell the agent type that has the actions; None = it is left to be filled in.
    """
    findings = Findings()
    try:
        root = parse(data)
        text = _Importer(root, file, catalogue, findings).read()
    except XmlRefused as problem:
        findings.add("X01", Mark(file, problem.line, problem.col), problem.message, problem.mend)
        return Imported("", findings.all())
    return Imported(format_text(text, file).text or text, findings.all())


@dataclass(slots=True)
class _Subtree:
    """A tree that was read as a subtree."""

    name: str
    scope: ImportScope
    value: Step
    needs_robot: bool


class _Importer:
    def __init__(self, root: XmlElement, file: str, catalogue: Catalogue | None, findings: Findings) -> None:
        self.root, self.file, self.catalogue, self.findings = root, file, catalogue, findings
        self.old = root.get("BTCPP_format") != "4"
        self.trees = {tree.get("ID"): tree for tree in root.children if tree.tag == "BehaviorTree"}
        self.models: dict[str, Ports] = {}
        self.tree_ports: dict[str, dict[str, Any]] = {}
        self.done: dict[str, _Subtree] = {}
        self.reading: list[str] = []
        self.names: dict[str, str] = {}
        self.ordered: set[str] = set()
        """The actions of all trees whose node names no agent."""

    def read(self) -> str:
        """Return the text of the task file."""
        if self.root.tag != "root" or not self.trees:
            what = "no tree of BehaviorTree.CPP: <root> with a <BehaviorTree ID=...> is due"
            raise XmlRefused(max(1, self.root.line), max(1, self.root.col), what)
        if len(self.trees) > _MOST_TREES:
            raise XmlRefused(1, 1, f"more than {_MOST_TREES} trees")
        for child in self.root.children:
            if child.tag == "TreeNodesModel":
                self._read_models(child)
            elif child.tag != "BehaviorTree":
                what = f"<{child.tag}> is not read" + ("; import that file too" if child.tag == "include" else "")
                self.findings.add("X02", self._mark(child), what)
        main = self._main_tree()
        return document(self._task(main))

    def _mark(self, element: XmlElement) -> Mark:
        return Mark(self.file, max(1, element.line), max(1, element.col))

    def _main_tree(self) -> XmlElement:
        said = self.root.get("main_tree_to_execute")
        if said in self.trees:
            return self.trees[said]
        if said:
            self.findings.add("X08", self._mark(self.root), f"there is no tree '{said}'")
        called = {e.get("ID") for e in self.root.walk() if e.tag in ("SubTree", "SubTreePlus")}
        free = [tree for name, tree in self.trees.items() if name not in called]
        return (free or list(self.trees.values()))[0]

    def _read_models(self, models: XmlElement) -> None:
        for node in models.children:
            name = node.get("ID")
            ports = [port for port in node.children if port.tag in ("input_port", "output_port", "inout_port")]
            if node.tag == "SubTree":
                self.tree_ports[name] = {
                    our_name(port.get("name")): _param_of(port) for port in ports if port.tag != "output_port"
                }
            elif node.tag in _CATEGORIES:
                outputs = {port.get("name") for port in ports if port.tag == "output_port"}
                self.models[name] = Ports(node.tag, outputs)

    # -- the task -----------------------------------------------------------------------------------------------------
    def _task(self, main: XmlElement) -> dict[str, Any]:
        scope = ImportScope(self.file, self.findings, self.old)
        scope.params = dict(self.tree_ports.get(main.get("ID"), {}))
        reader = StepReader(scope, self.models, self._call, is_task=True)
        parts = _Parts(scope, reader)
        parts.learn_outputs(main)
        parts.read(main)
        aborts = [tree for tree in self.trees.values() if tree.get("_formiga") == "on_abort"]
        if aborts and aborts[0] is not main:
            parts.sections["on_abort"] = [s for child in aborts[0].children for s in reader.body(_bare(child))]
        task: dict[str, Any] = {"formiga": "1", "task": camel(main.get("ID"))}
        if main.get("_formiga_aliases"):
            task["aliases"] = words(main.get("_formiga_aliases"))
        for key in ("version", "description", "priority", "if_preempted", "preemptible", "expires"):
            text = main.get("_description" if key == "description" else f"_formiga_{key}")
            if text:
                task[key] = unfold(text)
        if main.get("_formiga_records"):
            task["records"] = unfold(main.get("_formiga_records"))
        self.ordered |= reader.ordered
        if reader.needs_robot:
            parts.roles["robot"] = self._robot()
        params = {name: _shown(long) for name, long in scope.params.items()}
        task |= {k: v for k, v in (("params", params), ("vars", reader.vars), ("agents", parts.roles)) if v}
        if parts.timeout:
            task["timeout"] = parts.timeout
        if main.get("_formiga_envelope"):
            task["envelope"] = unfold(main.get("_formiga_envelope"))
        task |= {
            key: parts.sections[key] for key in ("steps", "on_failure", "on_abort", "finally") if key in parts.sections
        }
        if main.get("_formiga_cleanup_timeout"):
            task["cleanup_timeout"] = unfold(main.get("_formiga_cleanup_timeout"))
        if self.done:
            task["subtrees"] = {one.name: one.value for one in self.done.values()}
        return task

    def _robot(self) -> Step:
        types = self.catalogue.types.values() if self.catalogue is not None else ()
        fit = [t.name for t in types if self.ordered and not t.human and self.ordered <= set(t.actions)]
        if len(fit) == 1:
            return {"type": fit[0]}
        said = "choose the agent type; formiga check shows which types have the actions"
        return {TODO: [said], "type": "robot"}

    # -- subtrees -----------------------------------------------------------------------------------------------------
    def _call(self, element: XmlElement, reader: StepReader) -> Step:
        name = element.get("ID") or element.get("name")
        scope = reader.scope
        if name not in self.trees or name in self.reading:
            why = "calls itself" if name in self.reading else "is not in this file"
            said = scope.report("X08", element, f"the subtree '{name}' {why}")
            return {TODO: [said], "fail": f"TODO: call {one_line(name)}"}
        given = {
            our_name(key): text
            for key, text in element.attrs.items()
            if key not in _KNOWN and not key.startswith("_") and key != "returns"
        }
        callee = self._subtree(name, given)
        step: Step = {"call": callee.name}
        values = {key: self._argument(name, key, text, element, scope) for key, text in given.items()}
        values = {key if key in callee.scope.params else clean(key): value for key, value in values.items()}
        extra = [key for key in values if key not in callee.scope.params]
        for key in extra:
            del values[key]
        shared = element.get("_autoremap") in ("true", "1") or element.get("__shared_blackboard") in ("true", "1")
        for key, long in callee.scope.params.items():
            optional = isinstance(long, Mapping) and ("default" in long or "optional" in long)
            if key not in values and not optional:
                values[key] = "${" + (key if key == "robot" else scope.entry(key, element)) + "}"
                if key == "robot":
                    reader.needs_robot = True
                    scope.agents.add("robot")
                    scope.known.add("robot")
        if values:
            step["with"] = values
        if element.get("returns"):
            step["save_as"] = scope.pointer(element.get("returns"))
            scope.known.add(step["save_as"])
        if shared:
            step[TODO] = [
                scope.report("X07", element, "the blackboards are joined there; here values go in, none come back")
            ]
        if extra:
            said = f"{callee.name} does not read {', '.join(extra)}; a value that comes back is its 'returns'"
            step.setdefault(TODO, []).append(scope.report("X02", element, said))
        return step

    def _argument(self, name: str, key: str, text: str, element: XmlElement, scope: ImportScope) -> Any:
        long = self.tree_ports.get(name, {}).get(key)
        type_ = long.get("type") if isinstance(long, Mapping) else None
        value = scope.value(text, element)
        return _with_unit(value, type_) if isinstance(value, str) and isinstance(type_, str) else value

    def _subtree(self, name: str, given: Mapping[str, str]) -> _Subtree:
        if name in self.done:
            return self.done[name]
        tree = self.trees[name]
        scope = ImportScope(self.file, self.findings, self.old)
        scope.params = dict(self.tree_ports.get(name, {}))
        scope.agents = {
            key for key, long in scope.params.items() if isinstance(long, Mapping) and long["type"] == "agent"
        }
        reader = StepReader(scope, self.models, self._call, is_task=False)
        parts = _Parts(scope, reader)
        parts.learn_outputs(tree)
        self.reading.append(name)
        for key in given:
            if _reads(tree, key):
                scope.params.setdefault(clean(key), {"type": "any"})
        child = tree.children[0] if tree.children else XmlElement("Sequence")
        returns: Any = None
        if child.children and child.children[-1].get("_formiga") == "returns":
            pairs = scope.assignments(child.children.pop())
            returns = pairs[0][1] if pairs else None
        plain = child.tag == "Sequence" and set(child.attrs) <= {"name"}
        steps = reader.steps(child.children if plain else tree.children)
        self.reading.pop()
        if reader.needs_robot:
            scope.params.setdefault("robot", {"type": "agent"})
        params = {key: _shown(long) for key, long in scope.params.items()}
        value: Step = ({"params": params} if params else {}) | {"steps": steps}
        if returns is not None:
            value["returns"] = returns
        self.ordered |= reader.ordered
        self.done[name] = _Subtree(self._free_name(camel(name)), scope, value, reader.needs_robot)
        return self.done[name]

    def _free_name(self, name: str) -> str:
        taken, number, found = {one.name for one in self.done.values()}, 2, name
        while found in taken:
            found, number = f"{name}{number}", number + 1
        return found


class _Parts:
    """The head and the sections of the task's tree."""

    def __init__(self, scope: ImportScope, reader: StepReader) -> None:
        self.scope, self.reader = scope, reader
        self.roles: dict[str, Any] = {}
        self.sections: dict[str, list[Step]] = {}
        self.timeout: Any = ""

    def learn_outputs(self, tree: XmlElement) -> None:
        """Learn which entries the nodes of a tree write, before any of them is read."""
        for element in map(named, tree.walk()):
            if element.tag == "WaitFor":
                self.scope.known.add(self.scope.pointer(element.get("value")))
            elif not element.children and element.tag not in ("Agents", "Evaluate"):
                self.reader.outputs(element)
            if self.reader.is_task and element.tag in ("Script", "SetBlackboard", "UnsetBlackboard", "Evaluate"):
                said = element.get("key") or element.get("output_key")
                key = self.scope.pointer(said) or said
                pointer = self.scope.pointer(element.get("value")) if element.tag == "Evaluate" else key
                self.scope.known |= {clean(name) for name in (*assigned_names(element.get("code")), pointer) if name}
            if element.tag == "SubTree" and element.get("returns"):
                self.scope.known.add(self.scope.pointer(element.get("returns")))
        self.scope.fields = {e: one for e, one in self.scope.fields.items() if not one.startswith("result.")}

    def read(self, tree: XmlElement) -> None:
        """Read the tree of the task."""
        top = tree.children[0] if tree.children else XmlElement("Sequence", line=tree.line, col=tree.col)
        if top.get("_formiga") != "task":
            self.sections["steps"] = self.reader.body(top)
            return
        for element in top.children[:-1]:
            if element.tag == "Agents":
                self.roles = self.reader.roles(element)
            else:
                typed = element.get("_formiga_type")
                for name, value in self.scope.assignments(element):
                    self.reader.vars[name] = unfold(typed) if typed else value
        self._sections(top.children[-1])

    def _sections(self, element: XmlElement) -> None:
        marker = element.get("_formiga")
        last = element.children[-1] if element.children else element
        if marker == "finally" and len(element.children) == 2:
            self._sections(element.children[0])
            self.sections["finally"] = self.reader.body(_bare(last))
        elif marker == "on_failure" and len(element.children) == 2 and last.tag == "ForceFailure":
            self._sections(element.children[0])
            self.sections["on_failure"] = [s for child in last.children for s in self.reader.body(_bare(child))]
        elif marker == "copy":
            for child in element.children[:-1]:
                self.scope.copies.update(self.scope.assignments(child))
            self._sections(last)
        elif element.tag == "Timeout" and last.get("name") == "steps":
            self.timeout = self.scope.amount(element, "msec", "timeout")
            self._sections(last)
        else:
            self.sections["steps"] = self.reader.body(_bare(element))


def _bare(element: XmlElement) -> XmlElement:
    """Return a section's `Sequence` without its name, which only says which section it is."""
    if element.tag != "Sequence" or set(element.attrs) != {"name"}:
        return element
    return XmlElement("Sequence", {}, element.children, line=element.line, col=element.col)


def _reads(tree: XmlElement, key: str) -> bool:
    return any("{" + key + "}" in text or key in text.split() for e in tree.walk() for text in e.attrs.values())


def _param_of(port: XmlElement) -> dict[str, Any]:
    kept = unfold(port.get("_formiga"))
    if isinstance(kept, dict) and isinstance(kept.get("type"), str | dict):
        if isinstance(kept.get("default"), str) and kept["type"] != "text":
            kept["default"] = unfold(kept["default"])  # a list or mapping is kept as it was written
        return kept
    return {TODO: [f"give it a type (the file says: {one_line(port.get('type')) or 'nothing'})"], "type": "any"}


def _shown(long: Any) -> Any:
    if not isinstance(long, Mapping):
        return long
    if TODO in long:
        return dict(long)
    short = as_param(long)
    return FlowMapping(short) if isinstance(short, dict) else short


def _with_unit(value: str, type_: str) -> str:
    try:
        return format_quantity(type_, float(value)) if type_ in LIKELY else value
    except ValueError:
        return value
