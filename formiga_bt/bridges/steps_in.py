"""Nodes of BehaviorTree.CPP to steps of a task file. Called by `btcpp_in` for each tree.

A step is a mapping as `yaml_text` writes it. Helper nodes that our exporter made (`_formiga`) are folded back; all others
are read for what they do. What has no counterpart is reported and stands as a TODO.

Long on purpose: one method for each node of BT.CPP and of ours (`_node_<name>`) and each helper node (`_fold_<marker>`), all in
one class because nodes nest in any way. Those that hold no others are in `leaves_in`.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from typing import Any, Final

from formiga_bt.bridges.conditions_in import Ports, named, negated
from formiga_bt.bridges.elements import XmlElement
from formiga_bt.bridges.leaves_in import LeafReader, Step
from formiga_bt.bridges.table import BTCPP, NAV2, OWN
from formiga_bt.bridges.values_in import ImportScope, unfold, words
from formiga_bt.bridges.yaml_text import TODO, one_line

_RANK: Final[Mapping[str, int]] = {"retry": 1, "timeout": 2, "ignore_failure": 3, "when": 4}
_PLACE: Final = re.compile(r"\s*\[[^\[\]]*:\d+\]$")
_READ: Final = frozenset({*BTCPP, *OWN, *NAV2})
_INLINE: Final = "put its node into the tree that calls it"
_FEW: Final = 1000
"""Attempts that stand for `num_attempts="-1"`."""


class StepReader(LeafReader):
    """Reads the nodes of one tree."""

    def __init__(
        self,
        scope: ImportScope,
        models: Mapping[str, Ports],
        call: "Callable[[XmlElement, StepReader], Step]",
        *,
        is_task: bool,
    ) -> None:
        super().__init__(scope, models, is_task=is_task)
        self.call = call

    # -- lists and modifiers ------------------------------------------------------------------------------------------
    def body(self, element: XmlElement) -> list[Step]:
        """Return the steps of a branch: those of a plain `Sequence`, else the one node."""
        plain = element.tag == "Sequence" and not set(element.attrs) - {"_formiga"} and not element.get("_formiga")
        return self.steps(element.children if plain else [element])

    def steps(self, elements: Sequence[XmlElement]) -> list[Step]:
        """Return the steps of nodes; those that do nothing are left out, but an empty list gets a TODO."""
        found = [step for element in elements for step in [self.step(element)] if step is not None]
        return found or [self._todo(["nothing is done here"])]

    def step(self, element: XmlElement) -> Step | None:
        """Return the step of a node with its modifiers; None = it does nothing."""
        element = named(element)
        step = self._kind(element)
        if step is None:
            return None
        if element.tag in _READ or step.get("do") or step.get("call"):
            self._described(element, step)
        return self._conditions(element, step)

    @staticmethod
    def _described(element: XmlElement, step: Step) -> None:
        if element.get("_formiga") in ("expect", "args", "copy", "pause", "switch", "set") or not element.attrs:
            return
        tag = next((key for key in step if key != TODO), "")
        said = {}
        named_by = tag == "fail" and not element.get("_formiga_fail")  # its name is the message
        if element.get("name") and element.get("name") != element.tag and not named_by:
            said["name"] = one_line(element.get("name"))
        note = _PLACE.sub("", element.get("_description"))
        if note and "note" not in step:
            said["note"] = note
        if said:
            rest = dict(step)
            step.clear()
            step.update({key: rest[key] for key in (TODO, tag) if key in rest})
            step.update(said)
            step.update({key: value for key, value in rest.items() if key not in step})

    def _conditions(self, element: XmlElement, step: Step) -> Step:
        attrs, scope = element.attrs, self.scope
        if element.get("_formiga_critical") == "true":
            step["critical"] = "true"
        if "_failureIf" in attrs:
            cond = scope.expression(attrs["_failureIf"], element)
            if cond is not None:
                step = {"sequence": [{"check": negated(cond)}, step]}
        if "_while" in attrs:
            cond = scope.expression(attrs["_while"], element)
            if cond is not None:
                said = scope.report("X07", element, "'_while' skips when it ends; guard fails")
                step = {TODO: [said], "guard": cond, "steps": [step]}
        for key in ("_skipIf", "_successIf"):
            if key in attrs:
                step = self._when(element, key, step)
        for key in ("_onSuccess", "_onFailure", "_onHalted", "_post"):
            if key in attrs:
                said = scope.report("X09", element, f"'{key}={attrs[key]}' has no counterpart", "write a step for it")
                step.setdefault(TODO, []).append(said)
        return step

    def _when(self, element: XmlElement, key: str, step: Step) -> Step:
        code, scope = element.get(key), self.scope
        said = element.get("_formiga_when")
        if key == "_skipIf" and said and code.startswith("!(") and scope.unchanged(said, code[2:-1]):
            return modified(step, "when", said)
        cond = scope.expression(code, element)
        if cond is None:
            return step
        if key == "_successIf":
            step.setdefault(TODO, []).append(scope.report("X07", element, "'_successIf' succeeds; when skips"))
        return modified(step, "when", negated(cond))

    # -- kinds --------------------------------------------------------------------------------------------------------
    def _kind(self, element: XmlElement) -> Step | None:
        marker = element.get("_formiga")
        fold: Any = getattr(self, f"_fold_{marker}", None) if marker and element.children else None
        if fold is not None:
            folded = fold(element)
            assert isinstance(folded, dict)
            return folded
        tag = element.tag
        if tag in ("Sequence", "ReactiveSequence", "Fallback", "ReactiveFallback") and element.children:
            return self._composite(element)
        if self.conditions.looks(element, modified=True):
            cond = self.conditions.read(element)
            return self._check(element, cond) if cond is not None else self._todo(["a condition that cannot be read"])
        read: Any = getattr(self, f"_node_{tag.lower()}", None) if tag in _READ else None
        if read is not None:
            step = read(element)
            assert step is None or isinstance(step, dict)
            return step
        return self._foreign(element)

    def _check(self, element: XmlElement, cond: str) -> Step:
        message = element.get("_formiga_message")
        return {"check": cond} | ({"message": message} if message else {})

    def _composite(self, element: XmlElement) -> Step:
        kind = "sequence" if "Sequence" in element.tag else "fallback"
        children = [c for c in element.children if c.get("_formiga") != "nothing_applied"]
        step: Step = {kind: self.steps(children)}
        if element.tag.startswith("Reactive"):
            before = [self.conditions.read(child) if self.conditions.looks(child) else None for child in children[:-1]]
            live = [cond for cond in before if cond and any(f"{one}." in cond for one in self.scope.agents)]
            ours = any(e.tag == "Expression" or e.get("_formiga_cond") for c in children for e in c.walk())
            if all(before) and (live or ours):
                step["reactive"] = "true"
            elif all(before):
                said = "its checks read no agent, so there is nothing to watch: here it is not reactive"
                step[TODO] = [self.scope.report("X07", element, said, "add reactive: true when they do")]
            else:
                said = "a reactive node restarts what moves machines; here it is not reactive"
                step[TODO] = [self.scope.report("X07", element, said, "use guard")]
        return step

    def _same_as_sequence(self, element: XmlElement) -> Step:
        kind = "sequence" if "Sequence" in element.tag else "fallback"
        step: Step = {kind: self.steps(element.children)}
        if "WithMemory" in element.tag or "Star" in element.tag:
            said = "after a failure it begins with its first step, not with the one that failed"
            step[TODO] = [self.scope.report("X07", element, said)]
        return step

    _node_sequencestar = _node_sequencewithmemory = _node_asyncsequence = _node_fallbackstar = _node_asyncfallback = (
        _same_as_sequence
    )
    _node_sequence = _node_fallback = _node_reactivesequence = _node_reactivefallback = _same_as_sequence

    def _child(self, element: XmlElement) -> Step:
        if len(element.children) != 1:
            self.scope.report("X02", element, f"{element.tag} has {len(element.children)} children, not one")
        steps = self.steps(element.children)
        return steps[0] if len(steps) == 1 else {"sequence": steps}

    def _node_parallel(self, element: XmlElement) -> Step:
        step: Step = {"parallel": self.steps(element.children)}
        count = len(element.children)
        success = _number(element.get("success_count") or element.get("success_threshold"), -1)
        failure = _number(element.get("failure_count") or element.get("failure_threshold"), 1)
        if success == failure == 1 < count and not element.get("_formiga_need"):
            return {"race": self.steps(element.children)}
        need = element.get("_formiga_need") or ("all" if success in (-1, count) else str(success))
        need = need if need in ("all", "any") or need == str(success) else str(success)
        if need != "all":
            step["need"] = need
        if element.get("_formiga_on_child_failure") != "finish":
            step["on_child_failure"] = "cancel"
        if need != "all" and failure not in (-1, count) and failure <= count - max(success, 1):
            said = f"it failed after {failure} failures; here it fails when {need} cannot be reached"
            step[TODO] = [self.scope.report("X07", element, said)]
        return step

    def _node_parallelall(self, element: XmlElement) -> Step:
        step: Step = {"parallel": self.steps(element.children)}
        most = _number(element.get("max_failures"), 1)
        if most != 1:
            step["need"] = str(max(1, len(element.children) - max(0, most - 1)))
            step[TODO] = [self.scope.report("X07", element, "here it ends as soon as enough have succeeded")]
        return step

    def _node_ifthenelse(self, element: XmlElement) -> Step:
        if len(element.children) not in (2, 3):
            return self._foreign(element)
        first, then, *other = element.children
        cond = self.conditions.read(first) if self.conditions.looks(first) else None
        if cond is None:
            said = self.scope.report("X07", element, "the condition does something; a failed 'then' runs 'else' too")
            branches = [{"sequence": [*self.steps([first]), *self.body(then)]}]
            return {TODO: [said], "fallback": [*branches, *(s for o in other for s in self.body(o))]}
        step: Step = {"if": cond, "then": self.body(then)}
        if not other:
            step["else"] = [{"fail": "The condition does not hold."}]
        elif not (other[0].tag == "AlwaysSuccess" and other[0].get("_skipIf") == "true"):
            step["else"] = self.body(other[0])
        return step

    def _node_whiledoelse(self, element: XmlElement) -> Step:
        if len(element.children) not in (2, 3) or not self.conditions.looks(element.children[0]):
            return self._foreign(element)
        cond = self.conditions.read(element.children[0])
        if cond is None:
            return self._todo(["a condition that cannot be read"])
        said = self.scope.report("X07", element, "a condition that turns false fails here, and does not start 'else'")
        guard: Step = {TODO: [said], "guard": cond, "steps": self.body(element.children[1])}
        if len(element.children) == 2:
            return guard
        return {"if": cond, "then": [guard], "else": self.body(element.children[2])}

    def _switch(self, element: XmlElement, on: str = "", *, ours: bool = False) -> Step:
        number = int(element.tag[-1])
        on = on or unwrap(self.scope.value(element.get("variable"), element))
        cases: dict[str, Any] = {}
        for i, child in enumerate(element.children[:number], 1):
            cases.setdefault(element.get(f"case_{i}"), self.body(child))
        step: Step = {"switch": on, "cases": cases}
        last = element.children[number] if len(element.children) > number else None
        if last is not None and last.get("_formiga") == "more" and last.tag.startswith("Switch"):
            more = self._switch(last, on, ours=ours)
            cases.update(more["cases"])
            if "default" in more:
                step["default"] = more["default"]
        elif last is not None and not (ours and last.tag == "AlwaysFailure" and not last.attrs):
            step["default"] = self.body(last)
        return step

    _node_switch2 = _node_switch3 = _node_switch4 = _node_switch5 = _node_switch6 = _switch

    def _unsaid(self, element: XmlElement, what: str, mend: str = "write it anew with steps of this language") -> Step:
        """Report a node that cannot be said; its children stay for whoever writes it anew, behind a step that fails."""
        said = self.scope.report("X09", element, what, mend)
        fail: Step = {TODO: [said], "fail": f"TODO: {one_line(element.tag)} cannot be said here."}
        return {"sequence": [fail, *self.steps(element.children)]} if element.children else fail

    def _variable(self, stem: str, first: str) -> str:
        """Return a new variable of the task; "" where there are none: in a subtree, which is reported."""
        if not self.is_task:
            return ""
        number = 1
        while (name := f"{stem}_{number}") in self.vars or name in self.scope.known or name in self.scope.params:
            number += 1
        self.vars[name] = first
        self.scope.known.add(name)
        return name

    def _node_inverter(self, element: XmlElement) -> Step:
        """Read the Inverter of something that does, not only looks: how its child ended is kept in a variable."""
        done = self._variable("inverted", "false")
        if not done:
            return self._unsaid(element, "Inverter of an action needs a variable, and a subtree has none", _INLINE)
        tried = {"sequence": [self._child(element), {"set": {done: "true"}}], "ignore_failure": "true"}
        return {"sequence": [{"set": {done: "false"}}, tried, {"check": f"not {done}"}]}

    def _node_recoverynode(self, element: XmlElement) -> Step:
        """Read child 1; where it fails, so often as is said, child 2 and then child 1 again."""
        if len(element.children) != 2:
            return self._unsaid(element, f"a RecoveryNode has two children, not {len(element.children)}")
        times = (
            self.scope.amount(element, "number_of_retries", type_="int") if element.get("number_of_retries") else "1"
        )
        first, recovery = element.children
        body = self._one(self.steps([first]))
        if times == "0":
            return {"sequence": [body]}
        again: Step = {"sequence": [*self.steps([recovery]), deepcopy(body)]}
        if times != "1":
            again["retry"] = {"attempts": times}
            said = "a recovery that fails is tried again here, as long as attempts are left; there the node fails"
            again[TODO] = [self.scope.report("X07", element, said)]
        return {"fallback": [body, again]}

    def _node_roundrobin(self, element: XmlElement) -> Step:
        """Read children of which one succeeds; the next time it begins with the one after that: a variable says which."""
        count = len(element.children)
        turn = self._variable("turn", "0")
        if not turn:
            return self._unsaid(element, "RoundRobin needs a variable, and a subtree has none", _INLINE)
        ways: list[Step] = [
            {"sequence": [{"check": f"{turn} <= {i}"}, {"set": {turn: str(i + 1)}}, *self.steps([child])]}
            for i, child in enumerate(element.children)
        ]
        said = "the last child's success is one here; after the last one has failed it does not go on with the first"
        return {
            TODO: [self.scope.report("X07", element, said)],
            "sequence": [{"set": {turn: "0"}, "when": f"{turn} >= {count}"}, {"fallback": ways}],
        }

    @staticmethod
    def _one(steps: list[Step]) -> Step:
        return steps[0] if len(steps) == 1 else {"sequence": steps}

    def _node_retryuntilsuccessful(self, element: XmlElement) -> Step:
        step = self._child(element)
        pause = step.pop("_pause", {})
        attempts = self.scope.amount(element, "num_attempts", type_="int")
        if attempts == "-1":
            attempts = str(_FEW)
            said = self.scope.report("X07", element, f"without end there, {_FEW} attempts here")
            step.setdefault(TODO, []).append(said)
        retry: dict[str, Any] = {"attempts": attempts, **pause}
        if step.get("timeout") and not set(step) & {"retry", "when", "ignore_failure"}:
            retry["attempt_timeout"] = step.pop("timeout")
        if element.get("_formiga_agent"):
            retry["agent"] = element.get("_formiga_agent")
        for key in ("on", "unless"):
            if element.get(f"_formiga_{key}"):
                retry[key] = words(element.get(f"_formiga_{key}"))
        return modified(step, "retry", retry)

    _node_retryuntilsuccesful = _node_retryuntilsuccessful  # as version 3 spells it

    def _node_timeout(self, element: XmlElement) -> Step:
        return modified(self._child(element), "timeout", self.scope.amount(element, "msec", "timeout"))

    def _node_forcesuccess(self, element: XmlElement) -> Step:
        return modified(self._child(element), "ignore_failure", "true")

    def _node_forcefailure(self, element: XmlElement) -> Step:
        step = modified(self._child(element), "ignore_failure", "true")
        return {"sequence": [step, {"fail": "It fails in any case."}]}

    def _node_repeat(self, element: XmlElement) -> Step:
        steps = [s for child in element.children for s in self.body(child)]
        times = self.scope.amount(element, "num_cycles", type_="int")
        return self._endless(element, steps) if times == "-1" else {"repeat": times, "steps": steps}

    def _node_keeprunninguntilfailure(self, element: XmlElement) -> Step:
        return self._endless(element, [s for child in element.children for s in self.body(child)])

    def _endless(self, element: XmlElement, steps: list[Step]) -> Step:
        said = self.scope.report("X07", element, "it repeats for ever", "say how long at most, or when it ends")
        return {TODO: [said], "repeat": "1 d", "every": "1 s", "steps": steps}

    def _node_delay(self, element: XmlElement) -> Step:
        return {"sequence": [{"wait": self.scope.amount(element, "delay_msec")}, self._child(element)]}

    def _node_precondition(self, element: XmlElement) -> Step:
        cond = self.scope.expression(element.get("if"), element)
        step = self._child(element)
        if cond is None:
            return step
        if element.get("else", "FAILURE").upper() == "FAILURE":
            return {"sequence": [{"check": cond}, step]}
        if element.get("else").upper() != "SKIPPED":
            said = self.scope.report("X07", element, f"else {element.get('else')}: here it is skipped")
            step.setdefault(TODO, []).append(said)
        return modified(step, "when", cond)

    def _no_counterpart(self, element: XmlElement) -> Step:
        return self._unsaid(element, f"{element.tag} has no counterpart")

    _node_runonce = _node_skipunlessupdated = _node_waitvalueupdate = _no_counterpart
    _node_loopint = _node_loopbool = _node_loopdouble = _node_loopstring = _no_counterpart

    def _node_trycatch(self, element: XmlElement) -> Step:
        said = self.scope.report("X07", element, "TryCatch becomes a fallback")
        return {TODO: [said], "fallback": self.steps(element.children)}

    def _node_subtree(self, element: XmlElement) -> Step:
        return self.call(element, self)

    _node_subtreeplus = _node_subtree

    # -- our own nodes ------------------------------------------------------------------------------------------------

    def _node_when(self, element: XmlElement) -> Step:
        return modified(self._child(element), "when", element.get("cond"))

    def _node_loop(self, element: XmlElement) -> Step:
        value = {key: self.scope.value(text, element) for key, text in element.attrs.items() if key[0] != "_"}
        step: Step = {"while": element.get("while")} if element.get("while") else {}
        if not step:
            step["repeat"] = value.get("times") or value.get("duration") or "1"
        step |= {key: value[key] for key in ("until", "every", "max") if key in value}
        return step | {"steps": [s for child in element.children for s in self.body(child)]}

    def _node_foreach(self, element: XmlElement) -> Step:
        lists: dict[str, Any] = {}
        for key in element.attrs:
            if key == "item" or key.startswith("item_"):
                name = self.scope.pointer(element.get(key)) or "item"
                lists[name] = self.scope.value(element.get("in" + key[4:]), element)
                self.scope.known.add(name)
        step: Step = {"for": lists}
        for key in ("mode", "max_parallel", "need", "on_child_failure"):
            if element.get(key):
                step[key] = element.get(key)
        for key in ("collect", "first"):
            if element.get(key):
                step[key] = self.scope.pointer(element.get(key))
                self.scope.known.add(step[key])
        return step | {"steps": [s for child in element.children for s in self.body(child)]}

    def _node_finally(self, element: XmlElement) -> Step:
        if len(element.children) != 2:
            return self._foreign(element)
        body, last = element.children
        inner = (
            self._composite(body) if body.tag in ("Sequence", "ReactiveSequence") else {"sequence": self.steps([body])}
        )
        return inner | {"finally": self.body(last)}

    def _node_withagents(self, element: XmlElement) -> Step:
        roles = self.roles(element)
        return {"with_agents": roles, "steps": [s for child in element.children for s in self.body(child)]}

    def _node_withresource(self, element: XmlElement) -> Step:
        claims = [
            {name.strip(): int(units)} if units.strip().isdigit() else one
            for one in words(element.get("resources"))
            for name, _, units in [one.partition(":")]
        ]
        step: Step = {"with_resource": claims}
        if element.get("wait"):
            step["wait"] = self.scope.value(element.get("wait"), element)
        return step | {"steps": [s for child in element.children for s in self.body(child)]}

    # -- helper nodes of our exporter ---------------------------------------------------------------------------------
    def _fold_expect(self, element: XmlElement) -> Step:
        action, cond = element.children[0], element.children[-1]
        step = self.step(action)
        expect = self.conditions.read(cond)
        self.scope.saved = ""
        if step is None or expect is None or len(element.children) != 2 or not step.keys() & {"do", "ask"}:
            return {"sequence": self.steps(element.children)}
        step["expect"] = expect
        return step

    def _fold_copy(self, element: XmlElement) -> Step:
        for child in element.children[:-1]:
            for name, value in self.scope.assignments(child):
                self.scope.copies[name] = value
        return self._child(XmlElement(element.tag, {}, element.children[-1:], line=element.line, col=element.col))

    _fold_args = _fold_copy

    def _fold_pause(self, element: XmlElement) -> Step:
        pause = element.children[-1]
        if pause.get("_formiga") == "copy":
            for name, value in self.scope.assignments(pause.children[0]):
                self.scope.copies[name] = value
            pause = pause.children[-1]
        sleep = pause.children[0] if pause.tag == "ForceFailure" and pause.children else None
        if sleep is None or sleep.tag != "Sleep" or len(element.children) != 2:
            return self._same_as_sequence(element)
        step = self._child(XmlElement(element.tag, {}, element.children[:1], line=element.line, col=element.col))
        retry = {"delay": self.scope.amount(sleep, "msec", "delay")}
        if sleep.get("_formiga_backoff"):
            retry["backoff"] = unfold(sleep.get("_formiga_backoff"))
        step["_pause"] = retry
        return step

    def _fold_set(self, element: XmlElement) -> Step:
        merged: dict[str, Any] = {}
        for child in element.children:
            merged.update(self._node_script(child).get("set", {}))
        return {"set": merged} if merged else self._todo(["nothing is assigned"])

    def _fold_switch(self, element: XmlElement) -> Step:
        if len(element.children) != 2 or not element.children[1].tag.startswith("Switch"):
            return self._same_as_sequence(element)
        pairs = self.scope.assignments(element.children[0])
        on = unwrap(pairs[0][1]) if pairs else ""
        return self._switch(element.children[1], on, ours=True)

    def _fold_guard(self, element: XmlElement) -> Step:
        cond = self.conditions.read(element.children[0]) if len(element.children) == 2 else None
        if cond is None:
            return self._composite(element)
        return {"guard": cond, "steps": self.body(element.children[1])}

    # -- nodes of others ----------------------------------------------------------------------------------------------
    def _foreign(self, element: XmlElement) -> Step:
        if element.children:
            return self._unsaid(element, f"what {element.tag} does with its children is not known")
        return self._action(element)


def modified(step: Step, key: str, value: Any) -> Step:
    """Return a step with one more modifier outside those it has; where the order would be wrong, a sequence around it."""
    if any(_RANK[one] >= _RANK[key] for one in _RANK if one in step) or "_pause" in step:
        step = {"sequence": [step]}
    step[key] = value
    return step


def unwrap(value: Any) -> str:
    """Return the bare expression of a value."""
    text = str(value)
    return text[2:-1] if text.startswith("${") and text.endswith("}") else text


def _number(text: str, default: int) -> int:
    try:
        return int(text) if text else default
    except ValueError:
        return default
