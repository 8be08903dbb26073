"""Steps of the model to nodes of BehaviorTree.CPP. Called by `btcpp_out` for each list of steps.

What people wrote and BT.CPP has no room for stands in attributes that begin with `_formiga`: BT.CPP ignores them, and the
importer believes them as long as they fit the node. `_formiga` itself tells which construct a helper node belongs to.

Long on purpose: one method for each kind of step, in one class because steps nest in any way.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from formiga_bt.base.diagnostics import Mark
from formiga_bt.bridges.elements import XmlElement
from formiga_bt.bridges.findings import Findings
from formiga_bt.bridges.scripts import ScriptNames, to_script
from formiga_bt.bridges.table import BTCPP, OWN, port_name
from formiga_bt.bridges.values_out import Texts
from formiga_bt.bridges.yaml_text import flow, one_line
from formiga_bt.lang import model
from formiga_bt.lang.model import Catalogue, Expr, Step, Subtree, Who
from formiga_bt.lang.walk import children

_MOST_CASES: Final = 6


@dataclass(slots=True)
class Tree:
    """What one tree of the file knows: its names, and what it reads of agents."""

    names: ScriptNames
    mark: Mark


@dataclass(slots=True)
class Shared:
    """What all trees of one file share."""

    texts: Texts
    catalogue: Catalogue
    findings: Findings
    subtree_id: Callable[[Subtree], str]
    """Gives a subtree its tree, and returns its id."""
    ports: dict[str, dict[str, str]] = field(default_factory=dict)
    """Ports of own nodes and actions that were used: node -> port -> direction."""
    numbers: dict[str, int] = field(default_factory=dict)

    def fresh(self, stem: str) -> str:
        """Return a new name of an entry."""
        self.numbers[stem] = self.numbers.get(stem, 0) + 1
        return f"{stem}_{self.numbers[stem]}"

    def own(self, tag: str, inputs: Mapping[str, str], outputs: Mapping[str, str] | None = None) -> XmlElement:
        """Return a node that the host registers, with these ports; empty ones are left away."""
        used = self.ports.setdefault(tag, {})
        attrs: dict[str, str] = {}
        for ports, direction in ((inputs, "input"), (outputs or {}, "output")):
            for port, value in ports.items():
                used.setdefault(port_name(port), direction)
                if value:
                    attrs[port_name(port)] = value
        return XmlElement(tag, attrs)


class StepWriter:
    """Writes the steps of one tree."""

    def __init__(self, shared: Shared, tree: Tree) -> None:
        self.shared, self.tree = shared, tree
        self.texts, self.findings = shared.texts, shared.findings

    def body(self, steps: Sequence[Step], name: str = "") -> XmlElement:
        """Return a `Sequence` of steps."""
        return XmlElement("Sequence", {"name": name} if name else {}, [self.step(step) for step in steps])

    def step(self, step: Step) -> XmlElement:
        """Return the node of a step inside those of its modifiers."""
        node = self._describe(self._kind(step), step)
        if step.retry is not None:
            node = self._retry(node, step.retry)
        if step.timeout is not None:
            node = self._timeout(node, step.timeout)
        if step.ignore_failure:
            node = XmlElement("ForceSuccess", {}, [node])
        if step.critical:
            node.attrs["_formiga_critical"] = "true"
            self.findings.add("L04", step.mark, "'critical' has no counterpart in BT.CPP")
        return self._when(node, step.when) if step.when is not None else node

    def _describe(self, node: XmlElement, step: Step) -> XmlElement:
        inner = node
        while inner.get("_formiga") in ("expect", "args", "copy") and inner.children:
            inner = next((c for c in inner.children if c.tag not in ("Script", "Evaluate")), inner.children[0])
        if step.name:
            inner.attrs = {"name": step.name, **inner.attrs}
        note = one_line(self.texts.value(step.note)) if step.note is not None else ""
        inner.attrs["_description"] = f"{note} [{place(step.mark)}]".strip()
        return node

    # -- conditions and values ----------------------------------------------------------------------------------------
    def port(self, expr: Expr, what: str) -> str:
        """Return a value as a port, or "" with a finding."""
        text = self.texts.port(expr, self.tree.names)
        if not text:
            self.findings.add("L01", expr.mark, f"the value of '{what}' cannot be written as a port")
        return text

    def optional(self, expr: Expr | None, what: str) -> str:
        """Return a value that may be absent as a port."""
        return self.port(expr, what) if expr is not None else ""

    def script(self, expr: Expr, renamed: Mapping[str, str] | None = None) -> str | None:
        """Return a condition or value as a script; fields of agents that it reads are reported once."""
        names = self.tree.names
        before = set(names.read)
        script = to_script(expr.source, names, renamed)
        for name, one in sorted(names.read - before):
            mend = f"keep the blackboard entry '{name}_{one}' up to date"
            self.findings.add("L07", expr.mark, f"{name}.{one} is read from the agent", mend)
        return script

    def condition(self, expr: Expr, renamed: Mapping[str, str] | None = None) -> XmlElement:
        """Return a condition node."""
        script = self.script(expr, renamed)
        if script is not None:
            return XmlElement("ScriptCondition", {"code": script, "_formiga_cond": one_line(expr.source)})
        self._kept(expr)
        return self.shared.own("Expression", {"text": one_line(expr.source)})

    def _kept(self, expr: Expr) -> None:
        self.findings.add("L06", expr.mark, f"'{one_line(expr.source)}' is beyond BT.CPP's scripts: kept as text")

    def assign(self, name: str, expr: Expr, factor: int = 1) -> XmlElement:
        """Return the node that computes a value into a blackboard entry; `factor` scales what scripts can compute."""
        if expr.const is None:
            return XmlElement("UnsetBlackboard", {"key": name})
        literal = self.texts.is_literal(expr)
        text = self.texts.number_port(expr, self.tree.names)
        code: str | None
        if literal:
            is_text = expr.type.name in ("text", "enum", "agent", "any")
            is_number = isinstance(expr.const, float | int) and not is_text
            code = ("true" if expr.const else "false") if isinstance(expr.const, bool) else text if is_number else None
            if is_text and isinstance(expr.const, str) and "'" not in expr.const:
                code = f"'{expr.const}'"
        else:
            code = self.script(expr) if "${" not in expr.source else None
        if code is not None:
            code = f"({code}) * {factor}" if factor != 1 else code
            return XmlElement("Script", {"code": f"{name} := {code}", "_formiga_value": self.texts.value(expr)})
        return self.shared.own("Evaluate", {"text": self.texts.value(expr)}, {"value": "{" + name + "}"})

    def amount(self, expr: Expr, stem: str, factor: int = 1) -> tuple[str, list[XmlElement]]:
        """Return a number as a port of BT.CPP's own nodes, and the nodes that compute it before.

        Durations come in milliseconds (`factor` 1000).
        """
        if expr.is_const and isinstance(expr.const, float | int):
            return str(round(float(expr.const) * factor)), []
        entry = self.texts.entry(expr.source, self.tree.names)
        if entry and factor == 1:
            return "{" + entry + "}", []
        name = self.shared.fresh(stem)
        return "{" + name + "}", [self.assign(name, expr, factor)]

    # -- modifiers ----------------------------------------------------------------------------------------------------
    def _when(self, node: XmlElement, when: Expr) -> XmlElement:
        script = self.script(when)
        if script is None:
            self._kept(when)
            outer = self.shared.own("When", {"cond": one_line(when.source)})
            outer.children.append(node)
            return outer
        node.attrs["_skipIf"] = f"!({script})"
        node.attrs["_formiga_when"] = one_line(when.source)
        return node

    def _timeout(self, node: XmlElement, timeout: Expr) -> XmlElement:
        msec, before = self.amount(timeout, "timeout_ms", 1000)
        outer = XmlElement("Timeout", {"msec": msec, "_formiga_timeout": self.texts.value(timeout)}, [node])
        return self._after(before, outer)

    @staticmethod
    def _after(before: list[XmlElement], node: XmlElement) -> XmlElement:
        return XmlElement("Sequence", {"_formiga": "copy"}, [*before, node]) if before else node

    def _retry(self, node: XmlElement, retry: model.Retry) -> XmlElement:
        if retry.attempt_timeout is not None:
            node = self._timeout(node, retry.attempt_timeout)
        if retry.delay is not None:
            msec, before = self.amount(retry.delay, "pause_ms", 1000)
            attrs = {"msec": msec, "_formiga_delay": self.texts.value(retry.delay)}
            if retry.backoff is not None:
                attrs["_formiga_backoff"] = self.texts.value(retry.backoff)
            pause = XmlElement("ForceFailure", {}, [XmlElement("Sleep", attrs)])
            node = XmlElement("Fallback", {"_formiga": "pause"}, [node, self._after(before, pause)])
            self.findings.add("L03", retry.mark, "in BT.CPP the pause also follows the last attempt, and does not grow")
        times, before = self.amount(retry.attempts, "attempts")
        outer = XmlElement("RetryUntilSuccessful", {"num_attempts": times}, [node])
        if retry.agent != "same":
            outer.attrs["_formiga_agent"] = retry.agent
            self.findings.add("L04", retry.mark, "'agent: another' has no counterpart in BT.CPP")
        for key, codes in (("on", retry.on), ("unless", retry.unless)):
            if codes:
                outer.attrs[f"_formiga_{key}"] = ";".join(codes)
                self.findings.add("L04", retry.mark, f"'{key}' of a retry has no counterpart in BT.CPP")
        return self._after(before, outer)

    # -- kinds --------------------------------------------------------------------------------------------------------
    def _kind(self, step: Step) -> XmlElement:
        write = getattr(self, f"_{type(step).__name__.lower()}", None)
        if write is None:
            return self._unknown(step)
        node = write(step)
        assert isinstance(node, XmlElement)
        return node

    def _unknown(self, step: Step) -> XmlElement:
        tag = "".join(word.capitalize() for word in step.kind.split("_"))
        self.findings.add("L11", step.mark, f"'{step.kind}' has no counterpart: it becomes the node {tag}")
        node = self.shared.own(tag, {})
        steps = getattr(step, "steps", ())
        if steps:
            node.children.append(self.body(steps))
        return node

    def _do(self, step: model.Do) -> XmlElement:
        spec = self.shared.catalogue.actions.get(step.action)
        fields = {}
        for name, expr in step.fields.items():
            default = spec.fields[name].default if spec is not None and name in spec.fields else None
            if expr != default:
                fields[name] = self.port(expr, name)
        saved = step.save_as or ("result" if step.expect is not None else "")
        outputs = {}
        if saved and spec is not None:
            outputs = {_output(name, fields): "{" + f"{saved}_{name}" + "}" for name in spec.result}
        tag = f"Do{step.action}" if step.action in BTCPP or step.action in OWN else step.action
        node = self.shared.own(tag, {"agent": self._who(step.who), **fields}, outputs)
        if step.track is not None:
            self.findings.add("L13", step.track.mark, f"{step.action} follows what moves")
            said = {"every": step.track.every, "within": step.track.within}
            node.attrs |= {f"_formiga_track_{key}": self.optional(expr, key) for key, expr in said.items() if expr}
        return self._expect(node, step.expect, saved)

    def _expect(self, node: XmlElement, expect: Expr | None, saved: str) -> XmlElement:
        if expect is None:
            return node
        return XmlElement("Sequence", {"_formiga": "expect"}, [node, self.condition(expect, {"result": saved})])

    @staticmethod
    def _who(who: Who) -> str:
        return who.name if who.site_role else "{" + who.name + "}"

    def _ask(self, step: model.Ask) -> XmlElement:
        saved = step.save_as or ("result" if step.expect is not None else "")
        ports = {
            "question": self.port(step.question, "question"),
            "of": ";".join(who.name for who in step.of),
            "options": ";".join(step.options),
            "policy": step.policy if step.policy != "any" else "",
            "escalate_after": self.optional(step.escalate_after, "escalate_after"),
            "clears": step.clears.name if step.clears is not None else "",
            "clears_on": ";".join(step.clears_on),
            "if_no_answer": self.optional(step.if_no_answer, "if_no_answer"),
        }
        if step.form:
            self.findings.add("L04", step.mark, "'form' has no counterpart in BT.CPP")
        outputs = {name: "{" + f"{saved}_{name}" + "}" for name in ("answer", "by", "at")} if saved else {}
        node = self.shared.own("Ask", ports, outputs)
        if step.form:
            node.attrs["_formiga_form"] = flow({one.name: one.plain() for one in step.form})
        return self._expect(node, step.expect, saved)

    def _call(self, step: model.Call) -> XmlElement:
        node = XmlElement("SubTree", {"ID": self.shared.subtree_id(step.subtree)})
        before: list[XmlElement] = []
        for name, expr in step.args.items():
            text = self.texts.number_port(expr, self.tree.names)
            if text.startswith("$") or "${" in text:
                entry = self.shared.fresh(f"{name}_arg")
                before.append(self.assign(entry, expr))
                text = "{" + entry + "}"
            if text:
                node.attrs[port_name(name)] = text
            else:
                self.findings.add("L01", expr.mark, f"the argument '{name}' cannot be written")
        if step.save_as:
            node.attrs["returns"] = "{" + step.save_as + "}"
        return XmlElement("Sequence", {"_formiga": "args"}, [*before, node]) if before else node

    def _wait(self, step: model.Wait) -> XmlElement:
        msec, before = self.amount(step.duration, "wait_ms", 1000)
        node = XmlElement("Sleep", {"msec": msec, "_formiga_wait": self.texts.value(step.duration)})
        return self._after(before, node)

    def _check(self, step: model.Check) -> XmlElement:
        node = self.condition(step.cond)
        if step.message is not None:
            node.attrs["_formiga_message"] = self.texts.value(step.message)
            self.findings.add("L08", step.mark, "BT.CPP does not tell why a check failed")
        return node

    def _set(self, step: model.Set) -> XmlElement:
        nodes = [self.assign(name, expr) for name, expr in step.assign.items()]
        return nodes[0] if len(nodes) == 1 else XmlElement("Sequence", {"_formiga": "set"}, nodes)

    def _notify(self, step: model.Notify) -> XmlElement:
        ports = {
            "text": self.port(step.text, "notify"),
            "to": ";".join(who.name for who in step.to),
            "severity": step.severity if step.severity != "info" else "",
        }
        return self.shared.own("Notify", ports)

    def _fail(self, step: model.Fail) -> XmlElement:
        attrs = {"_formiga_fail": self.texts.value(step.message)}
        if step.code:
            attrs["_formiga_code"] = step.code
        if step.data:
            attrs["_formiga_data"] = flow({name: self.texts.value(one) for name, one in step.data.items()})
            self.findings.add("L04", step.mark, "'with' of a failure has no counterpart in BT.CPP")
        self.findings.add("L08", step.mark, "BT.CPP does not tell the message of a failure")
        return XmlElement("AlwaysFailure", attrs)

    def _release(self, step: model.Release) -> XmlElement:
        return self.shared.own("Release", {"agent": self._who(step.who)})

    def _waituntil(self, step: model.WaitUntil) -> XmlElement:
        self._kept(step.cond)
        return self.shared.own("WaitUntil", {"cond": one_line(step.cond.source)})

    def _waitfor(self, step: model.WaitFor) -> XmlElement:
        ports = {"agent": self._who(step.who), "event": step.event, "since": "task" if step.since_task else ""}
        return self.shared.own("WaitFor", ports, {"value": "{" + step.save_as + "}" if step.save_as else ""})

    def _breakif(self, step: model.BreakIf) -> XmlElement:
        return self.shared.own("BreakIf", {"cond": one_line(step.cond.source)})

    def _sequence(self, step: model.Sequence) -> XmlElement:
        body = XmlElement("ReactiveSequence" if step.reactive else "Sequence", {}, [self.step(s) for s in step.steps])
        if not step.finally_:
            return body
        outer = self.shared.own("Finally", {})
        outer.children = [body, self.body(step.finally_)]
        return outer

    def _fallback(self, step: model.Fallback) -> XmlElement:
        children = [self.step(s) for s in step.steps]
        if all(may_skip(s) for s in step.steps):
            children.append(XmlElement("AlwaysFailure", {"_formiga": "nothing_applied"}))
        return XmlElement("ReactiveFallback" if step.reactive else "Fallback", {}, children)

    def _parallel(self, step: model.Parallel) -> XmlElement:
        children = [self.step(s) for s in step.steps]
        if step.need == "first":
            if any(may_skip(s) for s in step.steps):
                self.findings.add("L12", step.mark, "a branch may be skipped: BT.CPP may then wait for ever")
            return XmlElement("Parallel", {"success_count": "1", "failure_count": "1"}, children)
        if step.need == "all" and step.on_child_failure == "finish":
            return XmlElement("ParallelAll", {"max_failures": "1"}, children)
        if step.need == "all":
            return XmlElement("Parallel", {"success_count": "-1", "failure_count": "1"}, children)
        count = 1 if step.need == "any" else step.need
        attrs = {"success_count": str(count), "failure_count": str(len(children))}
        attrs["_formiga_need"] = str(step.need)
        if step.on_child_failure == "finish":
            attrs["_formiga_on_child_failure"] = "finish"
            if count > 1:
                what = f"BT.CPP cancels the others as soon as {count} cannot be reached; here they would finish"
                self.findings.add("L05", step.mark, what)
        if any(may_skip(s) for s in step.steps):
            self.findings.add("L12", step.mark, "a branch may be skipped: BT.CPP may then wait for ever")
        return XmlElement("Parallel", attrs, children)

    def _if(self, step: model.If) -> XmlElement:
        otherwise = self.body(step.otherwise) if step.otherwise else XmlElement("AlwaysSuccess", {"_skipIf": "true"})
        return XmlElement("IfThenElse", {}, [self.condition(step.cond), self.body(step.then), otherwise])

    def _switch(self, step: model.Switch) -> XmlElement:
        entry = self.shared.fresh("switch")
        cases = list(step.cases)
        default = self.body(step.default) if step.default else XmlElement("AlwaysFailure")
        node = self._cases(entry, cases, default)
        return XmlElement("Sequence", {"_formiga": "switch"}, [self.assign(entry, step.on), node])

    def _cases(self, entry: str, cases: list[model.SwitchCase], default: XmlElement) -> XmlElement:
        now, more = cases[:_MOST_CASES], cases[_MOST_CASES:]
        if more:
            default = self._cases(entry, more, default)
            default.attrs["_formiga"] = "more"
        if len(now) == 1:  # BT.CPP has no Switch1
            now = [*now, *now]
        attrs = {"variable": "{" + entry + "}"}
        attrs |= {f"case_{i}": str(case.value) for i, case in enumerate(now, 1)}
        return XmlElement(f"Switch{len(now)}", attrs, [*(self.body(case.steps) for case in now), default])

    def _loop(self, step: model.Loop) -> XmlElement:
        body = self.body(step.steps)
        simple = step.until is None and step.every is None and step.max is None
        if step.times is not None and simple and not any(isinstance(s, model.BreakIf) for s in below(step.steps)):
            times, before = self.amount(step.times, "rounds")
            return self._after(before, XmlElement("Repeat", {"num_cycles": times}, [body]))
        ports = {
            "while": one_line(step.cond.source) if step.cond is not None else "",
            "times": "forever" if step.forever else self.optional(step.times, "repeat"),
            "duration": self.optional(step.duration, "repeat"),
            "until": one_line(step.until.source) if step.until is not None else "",
            "every": self.optional(step.every, "every"),
            "max": self.optional(step.max, "max"),
        }
        node = self.shared.own("Loop", ports)
        node.children.append(body)
        return node

    def _for(self, step: model.For) -> XmlElement:
        inputs: dict[str, str] = {}
        outputs: dict[str, str] = {}
        for number, (name, expr) in enumerate(step.lists.items(), 1):
            tail = f"_{number}" if number > 1 else ""
            inputs[f"in{tail}"] = self.port(expr, name)
            outputs[f"item{tail}"] = "{" + name + "}"
        inputs |= {
            "mode": "parallel" if step.parallel else "",
            "max_parallel": str(step.max_parallel) if step.max_parallel is not None else "",
            "need": str(step.need) if step.need != "all" else "",
            "on_child_failure": step.on_child_failure if step.on_child_failure != "finish" else "",
        }
        if step.collect:
            outputs["collect"] = "{" + step.collect + "}"
        if step.first:
            outputs["first"] = "{" + step.first + "}"
        node = self.shared.own("ForEach", inputs, outputs)
        node.children.append(self.body(step.steps))
        return node

    def _guard(self, step: model.Guard) -> XmlElement:
        return XmlElement("ReactiveSequence", {"_formiga": "guard"}, [self.condition(step.cond), self.body(step.steps)])

    def _withagents(self, step: model.WithAgents) -> XmlElement:
        node = self.agents("WithAgents", step.roles)
        node.children.append(self.body(step.steps))
        return node

    def _withresource(self, step: model.WithResource) -> XmlElement:
        ports = {"resources": step.said.replace(", ", ";"), "wait": self.optional(step.wait, "wait")}
        node = self.shared.own("WithResource", {name: value for name, value in ports.items() if value})
        node.children.append(self.body(step.steps))
        return node

    def agents(self, tag: str, roles: Mapping[str, model.Role]) -> XmlElement:
        """Return the node that claims agents for roles."""
        inputs: dict[str, str] = {}
        outputs: dict[str, str] = {}
        for role in roles.values():
            outputs[role.name] = "{" + role.name + "}"
            inputs |= {f"{role.name}__{key}": text for key, text in self._role(role).items() if text}
        return self.shared.own(tag, inputs, outputs)

    def _role(self, role: model.Role) -> dict[str, str]:
        count = str(role.count) if role.count is not None else ""
        if role.open is not None:
            bounds = {"min": str(role.open.min)} | ({"max": str(role.open.max)} if role.open.max is not None else {})
            count = "all" if role.open.max is None and role.open.min == 1 else "$" + "{" + flow(bounds) + "}"
        return {
            "type": role.types[0] if len(role.types) == 1 else "",
            "any_of": ";".join(role.types) if len(role.types) > 1 else "",
            "id": self.optional(role.id, "id"),
            "near": self.optional(role.near, "near"),
            "prefer": self.optional(role.prefer, "prefer"),
            "count": count,
            "battery_min": self.optional(role.battery_min, "battery_min"),
            "capabilities": ";".join(role.capabilities),
            "wait": self.optional(role.wait, "wait"),
            "if_lost": role.if_lost if role.if_lost != "fail" else "",
            "hand_over_at": self.optional(role.hand_over_at, "hand_over_at"),
            "away": "true" if role.away else "",
            "preempt": "" if role.preempt is None else str(role.preempt).lower(),
        }


def _output(name: str, fields: Mapping[str, str]) -> str:
    return f"{name}_result" if name in fields or name == "agent" else name


def place(mark: Mark) -> str:
    """Return a place in a file as people read it, without folders."""
    return f"{mark.file.replace(chr(92), '/').rsplit('/', 1)[-1]}:{mark.line}"


def may_skip(step: Step) -> bool:
    """Return whether a step may be skipped, as far as its own words tell."""
    if step.when is not None:
        return True
    match step:
        case model.If():
            return not step.otherwise or all(map(may_skip, step.then)) or all(map(may_skip, step.otherwise))
        case model.Sequence() | model.Parallel() | model.Guard():
            return all(map(may_skip, step.steps))
        case model.Call():
            return all(map(may_skip, step.subtree.steps))
        case model.Switch():
            return any(all(map(may_skip, branch)) for branch in step.branches)
    return False


def below(steps: Sequence[Step]) -> list[Step]:
    """Return these steps and all inside them, subtrees left out."""
    found: list[Step] = []
    for step in steps:
        found.append(step)
        found += below(children(step))
    return found
