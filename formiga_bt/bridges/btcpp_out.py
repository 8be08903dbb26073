"""A checked task as XML of BehaviorTree.CPP 4, with what gets lost. Called by `formiga export`.

One tree for the task, one for each subtree that it calls; TreeNodesModel lists every node that the host must register, and
the ports of each tree, so that Groot2 shows them. The correspondences stand in `table`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from formiga_bt.base.diagnostics import Diagnostic
from formiga_bt.base.units import format_quantity
from formiga_bt.bridges.elements import XmlElement, write
from formiga_bt.bridges.findings import Findings
from formiga_bt.bridges.scripts import ScriptNames
from formiga_bt.bridges.steps_out import Shared, StepWriter, Tree, below, place
from formiga_bt.bridges.table import OWN, port_name
from formiga_bt.bridges.values_out import Texts, plain
from formiga_bt.bridges.yaml_text import flow, one_line
from formiga_bt.lang import model
from formiga_bt.lang.model import Catalogue, Expr, Param, Step, Subtree, Task
from formiga_bt.lang.text.document import Mapping_, parse
from formiga_bt.lang.types import Type


@dataclass(frozen=True, slots=True)
class Exported:
    """The XML, and what it loses (codes `L..`), in the order of the file."""

    xml: str
    lost: list[Diagnostic]


def export_btcpp(task: Task, catalogue: Catalogue, sources: Mapping[str, str]) -> Exported:
    """Return a task as XML of BT.CPP 4.

    Args:
        task: the checked task.
        catalogue: it was checked against.
        sources: text of its file and imports, by the names in marks.
    """
    return _Exporter(task, catalogue, sources).export()


class _Exporter:
    def __init__(self, task: Task, catalogue: Catalogue, sources: Mapping[str, str]) -> None:
        self.task = task
        self.findings = Findings()
        self.shared = Shared(Texts(sources), catalogue, self.findings, self.subtree_id)
        self.ids: dict[tuple[str, int], str] = {}
        self.waiting: list[Subtree] = []
        self.models: list[XmlElement] = []
        self.agents: list[str] = []

    def export(self) -> Exported:
        root = XmlElement("root", {"BTCPP_format": "4", "main_tree_to_execute": self.task.name})
        root.children.append(self._main())
        if self.task.on_abort:
            root.children.append(self._on_abort())
        while self.waiting:
            root.children.append(self._subtree(self.waiting.pop(0)))
        root.children.append(XmlElement("TreeNodesModel", {}, [*self._own_models(), *self.models]))
        lost = self.findings.all()
        return Exported(write(root, self._head(lost)), lost)

    def _head(self, lost: Sequence[Diagnostic]) -> str:
        lines = [f"{self.task.name}, written by formiga export from {place(self.task.mark)}. BehaviorTree.CPP 4."]
        lines.append("The host registers the nodes of TreeNodesModel and sets the params (SI units) on the blackboard.")
        lines += [f"{d.code} {place(d.mark)}: {d.message}" + (f"; {d.help}" if d.help else "") for d in lost]
        return "\n".join(lines)

    def subtree_id(self, subtree: Subtree) -> str:
        """Return the tree of a subtree; two of one name (from two files) become two trees."""
        key = (subtree.mark.file, subtree.mark.line)
        if key not in self.ids:
            name, number = subtree.name, 2
            while name in (self.task.name, f"{self.task.name}_on_abort", *self.ids.values()):
                name, number = f"{subtree.name}{number}", number + 1
            self.ids[key] = name
            self.waiting.append(subtree)
        return self.ids[key]

    def _names(self, sections: Sequence[Sequence[Step]], own: Sequence[str], agents: Sequence[str]) -> ScriptNames:
        steps = [step for section in sections for step in below(section)]
        records = {step.save_as for step in steps if isinstance(step, model.Do | model.Ask) and step.save_as}
        loops = {name for step in steps if isinstance(step, model.For) for name in (*step.lists, step.gives)}
        saved = {step.save_as for step in steps if isinstance(step, model.Call | model.WaitFor)}
        return ScriptNames(frozenset(records), frozenset(agents), frozenset({*own, *records, *loops, *saved}))

    def _main(self) -> XmlElement:
        task = self.task
        sections = (task.steps, task.on_failure, task.on_abort, task.finally_)
        single = [role.name for role in task.roles.values() if not role.is_list]
        names = self._names(sections, [*task.params, *task.vars, *task.roles], single)
        writer = StepWriter(self.shared, Tree(names, task.mark))
        body = writer.body(task.steps, "steps")
        if task.timeout is not None:
            msec, before = writer.amount(task.timeout, "timeout_ms", 1000)
            body = XmlElement("Timeout", {"msec": msec, "_formiga_timeout": writer.texts.value(task.timeout)}, [body])
            body = XmlElement("Sequence", {"_formiga": "copy"}, [*before, body]) if before else body
        if task.on_failure:
            failed = XmlElement("ForceFailure", {}, [writer.body(task.on_failure, "on_failure")])
            body = XmlElement("Fallback", {"_formiga": "on_failure"}, [body, failed])
        if task.finally_:
            outer = self.shared.own("Finally", {})
            outer.attrs["_formiga"] = "finally"
            outer.children = [body, writer.body(task.finally_, "finally")]
            body = outer
        head: list[XmlElement] = []
        for name, expr in task.vars.items():
            node = writer.assign(name, expr)
            node.attrs["_formiga"] = "var"
            if expr.const is None:
                node.attrs["_formiga_type"] = expr.source
            head.append(node)
        if task.roles:
            head.append(writer.agents("Agents", self.task.roles))
        tree = XmlElement("BehaviorTree", {"ID": task.name, **self._options(writer)})
        tree.children = [XmlElement("Sequence", {"name": task.name, "_formiga": "task"}, [*head, body])]
        self.models.insert(0, self._ports(task.name, task.params, None, writer))
        return tree

    def _options(self, writer: StepWriter) -> dict[str, str]:
        task, found = self.task, {}
        if task.description:
            found["_description"] = one_line(task.description)
        plain = {"aliases": ";".join(task.aliases), "version": task.version}
        plain |= {"priority": task.priority if task.priority != "medium" else ""}
        plain["if_preempted"] = task.if_preempted if task.if_preempted != "restart" else ""
        if task.preemptible != (task.priority != "high"):
            plain["preemptible"] = "true" if task.preemptible else "false"
        for name, expr in (("expires", task.expires), ("cleanup_timeout", task.cleanup_timeout)):
            plain[name] = writer.texts.value(expr) if expr is not None else ""
        if task.envelope:
            plain["envelope"] = self._envelope_text()
        if task.records:
            fields = {
                n: {f: _field_value(t, task.records) for f, t in of.fields.items()} for n, of in task.records.items()
            }
            plain["records"] = flow(fields)
        for name, text in plain.items():
            if text:
                found[f"_formiga_{name}"] = text
                if name not in ("aliases", "version"):
                    self.findings.add("L04", task.mark, f"'{name}: {text}' has no counterpart in BT.CPP")
        return found

    def _envelope_text(self) -> str:
        root, _ = parse(self.shared.texts.sources.get(self.task.mark.file, ""), self.task.mark.file)
        entry = root.get("envelope") if isinstance(root, Mapping_) else None
        if entry is None:
            return ""
        return flow(plain(entry.value))

    def _on_abort(self) -> XmlElement:
        task = self.task
        self.findings.add("L02", task.on_abort[0].mark, "nothing starts on_abort in BT.CPP, where halting is immediate")
        names = self._names((task.on_abort,), [*task.params, *task.vars, *task.roles], ())
        writer = StepWriter(self.shared, Tree(names, task.mark))
        attrs = {"ID": f"{task.name}_on_abort", "_formiga": "on_abort"}
        return XmlElement("BehaviorTree", attrs, [writer.body(task.on_abort, "on_abort")])

    def _subtree(self, subtree: Subtree) -> XmlElement:
        names = self._names((subtree.steps,), list(subtree.params), ())
        writer = StepWriter(self.shared, Tree(names, subtree.mark))
        name = self.subtree_id(subtree)
        body = writer.body(subtree.steps, name)
        if subtree.returns is not None:
            last = writer.assign("returns", subtree.returns)
            last.attrs["_formiga"] = "returns"
            body.children.append(last)
        self.models.append(self._ports(name, subtree.params, subtree.returns, writer))
        return XmlElement("BehaviorTree", {"ID": name, "_description": f"[{place(subtree.mark)}]"}, [body])

    def _ports(self, name: str, params: Mapping[str, Param], returns: Expr | None, writer: StepWriter) -> XmlElement:
        node = XmlElement("SubTree", {"ID": name, "editable": "true"})
        for param in params.values():
            attrs = {"name": port_name(param.name), "type": param.type.name}
            if param.default is not None:
                attrs["default"] = writer.texts.number_port(param.default, ScriptNames())
            attrs["_formiga"] = flow(_param(param, writer, self.task.records))
            node.children.append(XmlElement("input_port", attrs, text=one_line(param.help or param.label)))
        if returns is not None:
            attrs = {"name": "returns", "type": returns.type.name}
            node.children.append(XmlElement("output_port", attrs))
        return node

    def _own_models(self) -> list[XmlElement]:
        found = []
        for tag, used in sorted(self.shared.ports.items()):
            own = OWN.get(tag)
            node = XmlElement(own.category if own is not None else "Action", {"ID": tag, "editable": "true"})
            spec = self.shared.catalogue.actions.get(tag.removeprefix("Do"), self.shared.catalogue.actions.get(tag))
            ports: dict[str, str] = {**(own.ports if own is not None else {}), **used}
            if own is None and spec is not None:
                ports = {"agent": "input", **dict.fromkeys(spec.fields, "input"), **used}
            for port, direction in ports.items():
                attrs = {"name": port}
                if own is None and spec is not None:
                    attrs["type"] = _type_of(port, direction, spec)
                node.children.append(XmlElement(f"{direction}_port", attrs))
            if own is not None and own.help:
                node.comment = own.help
            found.append(node)
        return found


def _type_of(port: str, direction: str, spec: model.ActionSpec) -> str:
    if port == "agent" and direction == "input":
        return "agent"
    if direction == "output":
        of = spec.result.get(port) or spec.result.get(port.removesuffix("_result"))
        return of.name if of is not None else "any"
    return spec.fields[port].type.name if port in spec.fields else "any"


def _type_value(type_: Type, records: Mapping[str, Type]) -> Any:
    """Return a type as a task file has it."""
    if type_.name == "list" and type_.item is not None:
        return {"list": _type_value(type_.item, records)}
    if type_.name == "record":
        return next((name for name, of in records.items() if of == type_), "any")
    return type_.name


def _field_value(type_: Type, records: Mapping[str, Type]) -> Any:
    """Return the type of a record's field as a task file has it."""
    of = _type_value(type_, records)
    return {"type": of, "values": list(type_.values)} if type_.values else of


def _param(param: Param, writer: StepWriter, records: Mapping[str, Type]) -> dict[str, Any]:
    """Return the long form of a param, as a task file has it."""
    value: dict[str, Any] = {"type": _type_value(param.type, records)}
    if param.type.values:
        value["values"] = list(param.type.values)
    if param.type.of:
        value["of"] = list(param.type.of)
    if param.default is not None:
        value["default"] = writer.texts.structure(param.default) or _text(param.default, writer)
    if param.optional:
        value["optional"] = "true"
    for key, bound in (("min", param.min), ("max", param.max)):
        if bound is not None:
            value[key] = _text(bound, writer)
    value |= {key: one_line(text) for key, text in (("label", param.label), ("help", param.help)) if text}
    for key, words in (("choices", param.choices), ("aliases", param.aliases)):
        if words:
            value[key] = list(words)
    return value


def _text(expr: Expr, writer: StepWriter) -> str:
    text = writer.texts.value(expr)
    if not text and expr.is_const and isinstance(expr.const, float | int):
        return format_quantity(expr.type.name, float(expr.const))
    return text
