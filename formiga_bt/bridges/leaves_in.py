"""Nodes without children, of BehaviorTree.CPP and of ours, to steps: actions, questions, notices, waits, values that are set.

`steps_in` builds on this: it adds the nodes that hold others, and the modifiers.
"""

from collections.abc import Mapping
from typing import Any, Final

from formiga_bt.bridges.conditions_in import ConditionReader, Ports
from formiga_bt.bridges.elements import XmlElement
from formiga_bt.bridges.table import BTCPP, OWN, our_name
from formiga_bt.bridges.values_in import ImportScope, clean, snake, unfold, words
from formiga_bt.bridges.yaml_text import TODO, one_line
from formiga_bt.lang.forms import DONE, YES_NO

Step = dict[str, Any]

_SILENT: Final = frozenset({"name", "ID", "_description", "_skipIf", "_uid", "_fullpath", "_autoremap"})


class LeafReader:
    """Reads the leaves of one tree."""

    def __init__(self, scope: ImportScope, models: Mapping[str, Ports], *, is_task: bool) -> None:
        self.scope, self.models, self.is_task = scope, models, is_task
        self.conditions = ConditionReader(scope, models)
        self.vars: dict[str, Any] = {}
        self.needs_robot = False
        self.ordered: set[str] = set()
        """The actions whose node names no agent: they are the robot's."""

    def _todo(self, texts: list[str]) -> Step:
        return {TODO: texts, "notify": "TODO: " + one_line(texts[0])}

    def _node_alwayssuccess(self, _element: XmlElement) -> None:
        return None

    def _node_alwaysfailure(self, element: XmlElement) -> Step:
        step: Step = {"fail": unfold(element.get("_formiga_fail")) or element.get("name") or "It always fails here."}
        code, carried = element.get("_formiga_code"), unfold(element.get("_formiga_data"))
        data = {name: unfold(text) for name, text in carried.items()} if carried else {}
        return step | ({"code": code} if code else {}) | ({"with": data} if data else {})

    def _node_sleep(self, element: XmlElement) -> Step:
        return {"wait": self.scope.amount(element, "msec", "wait")}

    def _node_script(self, element: XmlElement) -> Step:
        pairs = self.scope.assignments(element)
        if not pairs:
            return self._todo([f"the script '{one_line(element.get('code'))}' has no counterpart"])
        if not self.is_task:
            said = self.scope.report("X02", element, "a subtree has no variables of its own", "use returns")
            return self._todo([said])
        for name, value in pairs:
            self._declare(element, name, value)
        if len(dict(pairs)) < len(pairs):
            return {"sequence": [{"set": {name: value}} for name, value in pairs]}
        return {"set": dict(pairs)}

    _node_evaluate = _node_setblackboard = _node_unsetblackboard = _node_script

    def _declare(self, element: XmlElement, name: str, value: Any) -> None:
        if value is None and not isinstance(self.vars.get(name), Mapping):
            self.scope.report("X04", element, f"'{name}' needs its type", "give it one in vars, such as {type: place}")
            self.vars[name] = {"type": "any"}
        if name in self.vars:
            return
        constant = not (isinstance(value, str) and "${" in value)
        self.vars[name] = value if constant else "0"
        if not constant:
            self.scope.report("X04", element, f"'{name}' needs a first value of its type", "give it one in vars")

    def _node_ask(self, element: XmlElement) -> Step:
        step: Step = {"ask": self.scope.value(element.get("question"), element), "of": words(element.get("of"))}
        usual = [*DONE] if element.get("_formiga_form") else [*YES_NO]
        if words(element.get("options")) != usual:
            step["options"] = words(element.get("options"))
        if element.get("_formiga_form"):
            step["form"] = unfold(element.get("_formiga_form"))
        if element.get("policy"):
            step["policy"] = element.get("policy")
        if element.get("clears"):
            step["clears"] = {"role": element.get("clears"), "on": words(element.get("clears_on"))}
        for key in ("escalate_after", "if_no_answer"):
            if element.get(key):
                step[key] = self.scope.value(element.get(key), element)
        return self._saved(element, step)

    def _saved(self, element: XmlElement, step: Step) -> Step:
        saved = self.outputs(element)
        if saved and saved != "result":
            step["save_as"] = saved
        self.scope.saved = saved
        return step

    def outputs(self, element: XmlElement) -> str:
        """Return the name under which a node's outputs are saved, and learn their entries."""
        known = self.models.get(element.tag)
        ports = known.outputs if known is not None else set()
        own = OWN.get(element.tag)
        ports = ports | {port for port, way in own.ports.items() if way == "output"} if own is not None else ports
        entries = {p: self.scope.pointer(element.get(p)) for p in ports if self.scope.pointer(element.get(p))}
        if not entries:
            return ""
        bases = {e.removesuffix(f"_{p.removesuffix('_result')}") for p, e in entries.items()}
        fits = all(e.endswith(f"_{p.removesuffix('_result')}") for p, e in entries.items())
        base = bases.pop() if fits and len(bases) == 1 else f"{snake(element.tag)}_result"
        for port, entry in entries.items():
            self.scope.fields[entry] = f"{base}.{port.removesuffix('_result') if fits else clean(port)}"
        self.scope.known.add(base)
        return base

    def _node_notify(self, element: XmlElement) -> Step:
        step: Step = {"notify": self.scope.value(element.get("text"), element)}
        if element.get("to"):
            step["to"] = words(element.get("to"))
        return step | ({"severity": element.get("severity")} if element.get("severity") else {})

    def _node_release(self, element: XmlElement) -> Step:
        return {"release": self.scope.pointer(element.get("agent"))}

    def _node_waituntil(self, element: XmlElement) -> Step:
        return {"wait_until": element.get("cond")}

    def _node_waitfor(self, element: XmlElement) -> Step:
        agent, saved = self.scope.pointer(element.get("agent")), self.scope.pointer(element.get("value"))
        step: Step = {"wait_for": f"{agent}.{element.get('event')}"}
        if element.get("since"):
            step["since"] = element.get("since")
        if saved:
            self.scope.known.add(saved)
            step["save_as"] = saved
        return step

    def _node_breakif(self, element: XmlElement) -> Step:
        return {"break_if": element.get("cond")}

    def roles(self, element: XmlElement) -> dict[str, Any]:
        """Return the roles that an `Agents` or `WithAgents` claims."""
        found: dict[str, Any] = {}
        for key, text in element.attrs.items():
            port, sep, option = key.rpartition("__")
            if not sep or key.startswith("_"):
                continue
            many = option in ("any_of", "capabilities")
            role = found.setdefault(our_name(port), {})
            role[option] = words(text) if many else self.scope.value(text, element)
        self.scope.known |= set(found)
        self.scope.agents |= {name for name, role in found.items() if "count" not in role}
        return found

    def _node_agents(self, element: XmlElement) -> Step:
        return self._todo([self.scope.report("X02", element, "agents are named in the file's head", "move them there")])

    def _action(self, element: XmlElement) -> Step:
        agent = self.scope.pointer(element.get("agent"))
        if not agent:
            agent = "robot"
            if not self.needs_robot:
                said = f"{element.tag} names no agent, as perhaps others: 'robot' gets their orders"
                self.scope.report("X05", element, said)
            self.needs_robot = True
            self.scope.agents.add(agent)
            self.scope.known.add(agent)
        known = self.models.get(element.tag)
        outputs = known.outputs if known is not None else set()
        saved = self.outputs(element)
        fields = {
            our_name(key): self.scope.value(text, element)
            for key, text in element.attrs.items()
            if key not in outputs and key not in _SILENT and key[0] != "_" and (key != "agent" or agent == "robot")
        }
        action = clean(element.tag)
        if element.tag.startswith("Do") and (element.tag[2:] in BTCPP or element.tag[2:] in OWN):
            action = element.tag[2:]
        if agent == "robot":
            self.ordered.add(action)
        step: Step = {"do": f"{agent}.{action}"}
        if fields:
            step["with"] = fields
        told = [(key, element.get(f"_formiga_track_{key}")) for key in ("every", "within")]
        if told[0][1]:
            step["track"] = {key: self.scope.value(text, element) for key, text in told if text}
        if saved and saved != "result":
            step["save_as"] = saved
        self.scope.saved = saved
        return step
