"""A checked task as the tree that is compared: each param, role and step a node with its fields in the author's words.

A subtree stands once, under `subtrees`, with the file that it comes from, however often it is called; a call is a leaf. So a
change in a library is told once. A subtree of a library that nothing calls is left out.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang import model
from formiga_bt.lang.model import Expr, Param, Role, Step, Subtree, Task
from formiga_bt.lang.types import spelled
from formiga_bt.lang.walk import children
from formiga_bt.show.diff import values
from formiga_bt.show.diff.values import SUBTREE, FieldValue

DEFINED: Final = ("param", "var", "role", "subtree", "branch", "group")
"""Kinds of nodes that are known by their name, wherever they stand among their siblings."""


@dataclass(eq=False, slots=True)
class OutlineNode:
    """A thing in a task. Compared by identity; what it says is in `kind`, `sub` and `fields`."""

    kind: str
    """Of a step its kind; else `task`, `group`, `branch`, `param`, `var`, `role`, `subtree`."""
    sub: str
    """What makes two of a kind alike: the action, the subtree, the name of what is defined."""
    mark: Mark
    scope: str = ""
    """The subtree whose names it uses; "" = the task itself."""
    path: str = ""
    fields: dict[str, FieldValue] = field(default_factory=dict)
    children: list["OutlineNode"] = field(default_factory=list)
    thing: Step | Param | Role | Subtree | Task | None = None

    @property
    def is_step(self) -> bool:
        """Return whether it is a step of the language."""
        return isinstance(self.thing, Step)

    def below(self) -> Iterator["OutlineNode"]:
        """Iterate over it and all inside, parents first."""
        yield self
        for child in self.children:
            yield from child.below()


def outline(task: Task, texts: Mapping[str, str]) -> OutlineNode:
    """Return a task as a tree.

    Args:
        task: the checked task.
        texts: of its files.
    """
    main = _Scope(texts, "")
    root = OutlineNode("task", task.name, task.mark, fields=main.of_task(task), thing=task)
    root.children = [
        main.group("params", task.mark, [main.param(one) for one in task.params.values()]),
        main.group("vars", task.mark, [main.var(key, expr) for key, expr in task.vars.items()]),
        main.group("agents", task.mark, [main.role(one, "agents/") for one in task.roles.values()]),
    ]
    sections = {"steps": task.steps, "on_failure": task.on_failure, "on_abort": task.on_abort, "finally": task.finally_}
    for key, steps in sections.items():
        root.children.append(main.group(key, task.mark, [main.step(one, f"{key}/") for one in steps]))
    subtrees = [_subtree(called, one, texts) for called, one in _called(task).items()]
    root.children.append(main.group("subtrees", task.mark, subtrees))
    return root


def _called(task: Task) -> dict[str, Subtree]:
    """Return the subtrees that a task defines or calls, directly or not, by their names."""
    found: dict[Mark, Subtree] = {}
    queue = [*task.steps, *task.on_failure, *task.on_abort, *task.finally_]
    own = [one for one in task.subtrees.values() if one.mark.file == task.mark.file]
    while queue or own:
        if not queue:
            one = own.pop()
            if one.mark not in found:
                found[one.mark] = one
                queue += one.steps
            continue
        step = queue.pop()
        if isinstance(step, model.Call) and step.subtree.mark not in found:
            found[step.subtree.mark] = step.subtree
            queue += step.subtree.steps
        queue += children(step)
    names: dict[str, Subtree] = {}
    for mark in sorted(found):
        one = found[mark]
        names[one.name if one.name not in names else f"{one.name} of {mark.file}"] = one
    return names


def _subtree(called: str, subtree: Subtree, texts: Mapping[str, str]) -> OutlineNode:
    inside = _Scope(texts, called)
    node = OutlineNode("subtree", called, subtree.mark, called, f"subtrees/{called}", thing=subtree)
    if subtree.returns is not None:
        node.fields["returns"] = inside.value(subtree.returns)
    node.children = [
        inside.group("params", subtree.mark, [inside.param(one) for one in subtree.params.values()]),
        inside.group("steps", subtree.mark, [inside.step(one, f"subtrees/{called}/") for one in subtree.steps]),
    ]
    return node


@dataclass(frozen=True, slots=True)
class _Scope:
    """Makes the nodes of one body: of the task or of a subtree."""

    texts: Mapping[str, str]
    name: str

    def group(self, title: str, mark: Mark, inside: list[OutlineNode]) -> OutlineNode:
        return OutlineNode("group", title, mark, self.name, f"{title}/", {}, inside)

    def value(self, expr: Expr) -> FieldValue:
        return values.value_of(expr, self.texts)

    def exprs(self, given: Mapping[str, Expr | None]) -> dict[str, FieldValue]:
        return {key: self.value(expr) for key, expr in given.items() if expr is not None}

    def of_task(self, task: Task) -> dict[str, FieldValue]:
        words = {"task": task.name, "version": task.version, "description": " ".join(task.description.split())}
        words |= {"aliases": ", ".join(task.aliases), "priority": task.priority, "if_preempted": task.if_preempted}
        if task.preemptible != (task.priority != "high"):
            words["preemptible"] = str(task.preemptible).lower()
        found = {key: values.text(said) for key, said in words.items() if said}
        bounds = {"timeout": task.timeout, "expires": task.expires, "cleanup_timeout": task.cleanup_timeout}
        found |= self.exprs(bounds)
        return found | {f"envelope {key}": values.text(f"{most:g}") for key, most in task.envelope.items()}

    def param(self, param: Param) -> OutlineNode:
        fields = {"type": values.text(spelled(param.type))}
        fields |= self.exprs({"default": param.default, "min": param.min, "max": param.max})
        words = {"label": param.label, "help": param.help, "choices": ", ".join(param.choices)}
        words |= {"optional": "true" if param.optional else "", "aliases": ", ".join(param.aliases)}
        fields |= {key: values.text(said) for key, said in words.items() if said}
        return OutlineNode("param", param.name, param.mark, self.name, f"params/{param.name}", fields, thing=param)

    def var(self, key: str, expr: Expr) -> OutlineNode:
        return OutlineNode("var", key, expr.mark, self.name, f"vars/{key}", {"value": self.value(expr)})

    def role(self, role: Role, prefix: str) -> OutlineNode:
        fields = {"type": values.text(" or ".join(role.types))}
        bounds = {"id": role.id, "near": role.near, "prefer": role.prefer, "battery_min": role.battery_min}
        fields |= self.exprs(bounds | {"wait": role.wait, "hand_over_at": role.hand_over_at})
        words = {"count": _how_many(role), "capabilities": ", ".join(sorted(role.capabilities))}
        words |= {"if_lost": role.if_lost if role.if_lost != "fail" else "", "away": "true" if role.away else ""}
        words["preempt"] = "" if role.preempt is None else str(role.preempt).lower()
        fields |= {key: values.text(said) for key, said in words.items() if said}
        return OutlineNode("role", role.name, role.mark, self.name, f"{prefix}{role.name}", fields, thing=role)

    def step(self, step: Step, prefix: str) -> OutlineNode:
        path = f"{prefix}{step.seg}"
        fields = {**self.own(step), **self.modifiers(step)}
        return OutlineNode(
            step.kind, _sub(step), step.mark, self.name, path, fields, self.inside(step, f"{path}."), step
        )

    def inside(self, step: Step, prefix: str) -> list[OutlineNode]:
        def branch(title: str, steps: tuple[Step, ...]) -> OutlineNode:
            mark = steps[0].mark if steps else step.mark
            return OutlineNode(
                "branch", title, mark, self.name, f"{prefix}{title}", {}, [self.step(one, prefix) for one in steps]
            )

        match step:
            case model.If():
                return [branch("then", step.then), *([branch("else", step.otherwise)] if step.otherwise else [])]
            case model.Switch():
                cases = [branch(str(case.value), case.steps) for case in step.cases]
                return [*cases, *([branch("default", step.default)] if step.default else [])]
            case model.Sequence() if step.finally_:
                return [*(self.step(one, prefix) for one in step.steps), branch("finally", step.finally_)]
            case model.WithAgents():
                roles = [self.role(one, prefix) for one in step.roles.values()]
                return [*roles, *(self.step(one, prefix) for one in step.steps)]
        return [self.step(one, prefix) for one in children(step)]

    def modifiers(self, step: Step) -> dict[str, FieldValue]:
        found = {"name": values.text(step.name)} if step.name else {}
        found |= self.exprs({"note": step.note, "when": step.when, "timeout": step.timeout})
        if step.retry is not None:
            retry = step.retry
            bounds = {"retry attempts": retry.attempts, "retry delay": retry.delay, "retry backoff": retry.backoff}
            found |= self.exprs(bounds | {"retry attempt_timeout": retry.attempt_timeout})
            found |= {"retry agent": values.text(retry.agent)} if retry.agent != "same" else {}
            codes = {"retry on": retry.on, "retry unless": retry.unless}
            found |= {key: values.text(", ".join(said)) for key, said in codes.items() if said}
        flags = {"ignore_failure": step.ignore_failure, "critical": step.critical}
        found |= {key: values.text("true") for key, said in flags.items() if said}
        expect, save_as = getattr(step, "expect", None), getattr(step, "save_as", "")
        found |= {"expect": self.value(expect)} if isinstance(expect, Expr) else {}
        return found | ({"save_as": values.name(save_as)} if save_as else {})

    def own(self, step: Step) -> dict[str, FieldValue]:
        """Return what only steps of its kind say."""
        match step:
            case model.Do():
                with_ = {key: self.value(expr) for key, expr in step.fields.items()}
                track = {"track every": step.track.every, "track within": step.track.within} if step.track else {}
                said = {"agent": values.name(step.who.name), "action": values.text(step.action)}
                return said | with_ | self.exprs(track)
            case model.Ask():
                people = values.names(who.name for who in step.of)
                words = {"options": ", ".join(step.options), "clears_on": ", ".join(step.clears_on)}
                words["form"] = ", ".join(one.told for one in step.form)
                words["policy"] = step.policy if step.policy != "any" else ""
                found = {"ask": self.value(step.question), "of": people}
                found |= {key: values.text(said) for key, said in words.items() if said}
                found |= {"clears": values.name(step.clears.name)} if step.clears is not None else {}
                return found | self.exprs({"escalate_after": step.escalate_after, "if_no_answer": step.if_no_answer})
            case model.Call():
                found = {"call": FieldValue(((SUBTREE, step.subtree.name),), step.subtree.name)}
                return found | {f"with {key}": self.value(expr) for key, expr in step.args.items()}
            case model.Request():
                words = {"request": step.task, "priority": step.priority, "wait": "" if step.wait else "false"}
                words["detached"] = "true" if step.detached else ""
                found = {key: values.text(said) for key, said in words.items() if said}
                return found | {f"with {key}": self.value(expr) for key, expr in step.args.items()}
            case model.Wait():
                return {"wait": self.value(step.duration)}
            case model.Check():
                return self.exprs({"check": step.cond, "message": step.message})
            case model.WaitUntil() | model.BreakIf() | model.Guard() | model.If():
                return {step.kind: self.value(step.cond)}
            case model.Set():
                return self.assigned(step)
            case model.Notify():
                people = values.names(who.name for who in step.to)
                found = {"notify": self.value(step.text), "severity": values.text(step.severity)}
                return found | ({"to": people} if step.to else {})
            case model.Fail():
                found = {"fail": self.value(step.message)} | self.exprs(step.data)
                return found | ({"code": values.text(step.code)} if step.code else {})
            case model.WaitFor():
                found = {"agent": values.name(step.who.name), "event": values.text(step.event)}
                return found | ({"since": values.text("task")} if step.since_task else {})
            case model.WithResource():
                return {"with_resource": values.text(step.said)} | self.exprs({"wait": step.wait})
            case model.Release():
                return {"release": values.name(step.who.name)}
            case model.Switch():
                return {"switch": self.value(step.on)}
            case model.Loop():
                bounds = {"while": step.cond, "repeat": step.times or step.duration, "until": step.until}
                found = {"repeat": values.text("forever")} if step.forever else {}
                return found | self.exprs(bounds | {"every": step.every, "max": step.max})
        return self.of_many(step)

    def of_many(self, step: Step) -> dict[str, FieldValue]:
        """Return what a composite or `for` says."""
        words: dict[str, str] = {}
        if isinstance(step, model.Sequence | model.Fallback) and step.reactive:
            words["reactive"] = "true"
        if isinstance(step, model.Parallel | model.For):
            words["need"] = str(step.need) if step.need not in ("all", "first") else ""
            words["on_child_failure"] = step.on_child_failure if step.on_child_failure != "finish" else ""
        found: dict[str, FieldValue] = {}
        if isinstance(step, model.For):
            for key, expr in step.lists.items():
                found[f"for {key}"] = values.defining(key, "in", self.value(expr))
            words["mode"] = "parallel" if step.parallel else ""
            words["max_parallel"] = str(step.max_parallel or "")
            found |= {"collect": values.name(step.collect)} if step.collect else {}
            found |= {"first": values.name(step.first)} if step.first else {}
        return found | {key: values.text(said) for key, said in words.items() if said}

    def assigned(self, step: model.Set) -> dict[str, FieldValue]:
        """Return what is set; the order counts only where one reads what another sets."""
        found = {f"set {key}": values.defining(key, "=", self.value(expr)) for key, expr in step.assign.items()}
        if any(
            read.name in step.assign and read.name != key for key, expr in step.assign.items() for read in expr.reads
        ):
            found["order"] = values.names(step.assign)
        return found


def _sub(step: Step) -> str:
    match step:
        case model.Do():
            return step.action
        case model.Call():
            return step.subtree.name
        case model.Request():
            return step.task
        case model.WaitFor():
            return step.event
    return ""


def _how_many(role: Role) -> str:
    if role.open is None:
        return str(role.count) if role.count is not None else ""
    most = "any" if role.open.max is None else str(role.open.max)
    return f"{role.open.min} to {most}"
