"""A task as a tree of text lines, from the checked model: no run, no py_trees.

Called by `formiga show`. Each line is a list of styled spans with the place in the file at its right edge; lines never
exceed the width that is asked for. Kinds that this module does not know are drawn by their title and their children.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import PurePath
from typing import Final, Literal

from formiga_bt.diagnostics import Mark
from formiga_bt.lang import model
from formiga_bt.lang.model import Expr, Param, Role, Step, Task

Style = Literal["plain", "title", "kind", "agent", "dim", "warn"]

SGR: Final[Mapping[Style, str]] = {"plain": "", "title": "1", "kind": "36", "agent": "32", "dim": "2", "warn": "33"}
"""Terminal colours of each style (ISO 6429 select graphic rendition)."""


@dataclass(frozen=True, slots=True)
class Span:
    """A piece of a line in one style."""

    text: str
    style: Style = "plain"


@dataclass(frozen=True, slots=True)
class Line:
    """One line of the drawing."""

    spans: tuple[Span, ...]

    def plain(self) -> str:
        """Return the text without colours."""
        return "".join(span.text for span in self.spans).rstrip()

    def styled(self) -> str:
        """Return the text with terminal colours."""
        return "".join(f"\x1b[{SGR[s.style]}m{s.text}\x1b[0m" if SGR[s.style] else s.text for s in self.spans).rstrip()


@dataclass(frozen=True, slots=True)
class Glyphs:
    """The characters of the drawing."""

    tee: str
    corner: str
    bar: str
    cut: str


BOX: Final = Glyphs("├─ ", "└─ ", "│  ", "…")
ASCII: Final = Glyphs("|- ", "`- ", "|  ", "...")


@dataclass(frozen=True, slots=True)
class _Branch:
    """A row before layout: what it says, where it is written, what is under it."""

    spans: tuple[Span, ...]
    mark: Mark | None = None
    children: tuple["_Branch", ...] = ()


def draw(task: Task, *, width: int = 100, ascii_only: bool = False, depth: int | None = None) -> list[Line]:
    """Return the lines of a task.

    Args:
        task: the checked task.
        width: columns that no line exceeds.
        ascii_only: draw with `|-` and `...`, and escape what is not ASCII.
        depth: levels of steps to show; None = all.
    """
    layout = _Layout(width, ASCII if ascii_only else BOX, ascii_only, task.mark.file)
    lines = [layout.line("", _head(task), task.mark)]
    if task.description:
        lines.append(layout.line("", (Span(" ".join(task.description.split())),), None))
    lines += layout.group("params", [_param(p) for p in task.params.values()])
    lines += layout.group("vars", [_var(name, e) for name, e in task.vars.items()])
    lines += layout.group("agents", [_role(r) for r in task.roles.values()])
    sections = (("steps", task.steps), ("on_failure", task.on_failure), ("on_abort", task.on_abort))
    for title, steps in (*sections, ("finally", task.finally_)):
        lines += layout.group(title, [_branch(step, depth) for step in steps])
    return lines


def _head(task: Task) -> tuple[Span, ...]:
    facts = [f"priority {task.priority}"]
    if task.timeout:
        facts.append(f"timeout {source(task.timeout)}")
    if task.expires:
        facts.append(f"expires {source(task.expires)}")
    if not task.preemptible:
        facts.append("not preemptible")
    name = f"{task.name} {task.version}".rstrip()
    return Span(name, "title"), Span("  " + ", ".join(facts), "dim")


def _param(param: Param) -> _Branch:
    text = f": {param.type}"
    if param.default:
        text += f" = {source(param.default)}"
    limits = [f"{word} {source(e)}" for word, e in (("min", param.min), ("max", param.max)) if e]
    if param.optional:
        limits.append("optional")
    return _Branch((Span(param.name, "agent"), Span(text), Span(_bracket(limits), "dim")), param.mark)


def _var(name: str, expr: Expr) -> _Branch:
    return _Branch((Span(name, "agent"), Span(f" = {source(expr)}")), expr.mark)


def _kinds(role: Role) -> str:
    count = f"{_how_many(role)} x " if role.is_list else ""
    return count + " or ".join(role.types)


def _how_many(role: Role) -> str:
    if role.open is None:
        return str(role.count)
    if role.open.max is None:
        return "all" if role.open.min == 1 else f"{role.open.min} or more"
    return f"{role.open.min} to {role.open.max}"


def _role(role: Role) -> _Branch:
    facts = [f"{word} {source(e)}" for word, e in (("id", role.id), ("near", role.near), ("prefer", role.prefer)) if e]
    if role.battery_min:
        facts.append(f"battery >= {source(role.battery_min)}")
    if role.capabilities:
        facts.append("with " + ", ".join(role.capabilities))
    if role.wait:
        facts.append(f"waits {source(role.wait)}")
    if role.if_lost != "fail":
        facts.append(f"if lost: {role.if_lost}")
    if role.away:
        facts.append("may be away")
    return _Branch((Span(role.name, "agent"), Span(f": {_kinds(role)}"), Span(_bracket(facts), "dim")), role.mark)


def _branch(step: Step, depth: int | None) -> _Branch:
    below = None if depth is None else depth - 1
    children: tuple[_Branch, ...]
    if below == 0:
        hidden = sum(1 for _ in _steps_below(step))
        children = (_Branch((Span(f"({hidden} more)", "dim"),)),) if hidden else ()
    else:
        children = tuple(_children(step, below))
    modifiers = _bracket(_modifiers(step))
    return _Branch((*_label(step), Span(modifiers, "warn")), step.mark, children)


def _children(step: Step, depth: int | None) -> Iterator[_Branch]:
    if isinstance(step, model.If) and step.otherwise:
        yield _Branch((Span("then", "kind"),), None, tuple(_branch(s, depth) for s in step.then))
        yield _Branch((Span("else", "kind"),), None, tuple(_branch(s, depth) for s in step.otherwise))
        return
    if isinstance(step, model.Switch):
        for case in step.cases:
            yield _Branch((Span(str(case.value), "kind"),), case.mark, tuple(_branch(s, depth) for s in case.steps))
        if step.default:
            yield _Branch((Span("default", "kind"),), None, tuple(_branch(s, depth) for s in step.default))
        return
    if isinstance(step, model.Sequence) and step.finally_:
        for child in step.steps:
            yield _branch(child, depth)
        yield _Branch((Span("finally", "kind"),), None, tuple(_branch(s, depth) for s in step.finally_))
        return
    for child in _inner(step):
        yield _branch(child, depth)


def _inner(step: Step) -> list[Step]:
    """Return the steps directly inside a step of any kind: those of its subtree, or of its fields."""
    if isinstance(step, model.Call):
        return list(step.subtree.steps)
    if isinstance(step, model.Switch):
        return [item for branch in step.branches for item in branch]
    values = (getattr(step, f.name) for f in fields(step))
    return [item for value in values if isinstance(value, tuple) for item in value if isinstance(item, Step)]


def _steps_below(step: Step) -> Iterator[Step]:
    for child in _inner(step):
        yield child
        yield from _steps_below(child)


def _label(step: Step) -> tuple[Span, ...]:
    name = (Span(f"{step.name}: ", "title"),) if step.name else ()
    spans: tuple[Span, ...]
    match step:
        case model.Do():
            spans = (Span(f"{step.who.name}.", "agent"), Span(step.action, "kind"), Span(_args(step.fields)))
        case model.Ask():
            people = ", ".join(who.name for who in step.of)
            choices = " / ".join(step.options)
            spans = Span("ask ", "kind"), Span(people, "agent"), Span(f': "{source(step.question)}" {choices}')
        case model.Call():
            spans = Span("call ", "kind"), Span(step.subtree.name, "agent"), Span(_args(step.args))
        case model.Request():
            spans = Span("request ", "kind"), Span(step.task, "agent"), Span(_args(step.args))
        case model.Wait():
            spans = Span("wait ", "kind"), Span(source(step.duration))
        case model.Check():
            spans = Span("check ", "kind"), Span(source(step.cond))
        case model.Set():
            text = ", ".join(f"{key} = {source(e)}" for key, e in step.assign.items())
            spans = Span("set ", "kind"), Span(text)
        case model.Notify():
            to = " to " + ", ".join(who.name for who in step.to) if step.to else ""
            spans = Span("notify", "kind"), Span(f'{to}: "{source(step.text)}" ({step.severity})')
        case model.Fail():
            code = f" [{step.code}]" if step.code else ""
            spans = Span("fail", "kind"), Span(f'{code}: "{source(step.message)}"')
        case model.If():
            spans = Span("if ", "kind"), Span(source(step.cond))
        case model.Switch():
            spans = Span("switch ", "kind"), Span(source(step.on))
        case model.WaitUntil() | model.Guard() | model.BreakIf():
            spans = Span(f"{step.kind} ", "kind"), Span(source(step.cond))
        case model.WithAgents():
            who = ", ".join(f"{role.name}: {_kinds(role)}" for role in step.roles.values())
            spans = Span("with_agents ", "kind"), Span(who, "agent")
        case model.WaitFor():
            since = " (since the task's start)" if step.since_task else ""
            spans = Span("wait for ", "kind"), Span(step.who.name, "agent"), Span(f".{step.event}{since}")
        case model.Release():
            spans = Span("release ", "kind"), Span(step.who.name, "agent")
        case model.Loop():
            spans = Span(f"{step.kind} ", "kind"), Span(_how_long(step))
        case model.For():
            spans = Span("for ", "kind"), Span(", ".join(f"{name} in {_list(e)}" for name, e in step.lists.items()))
        case _:
            spans = (Span(step.kind, "kind"),)
    return (*name, *spans)


def _args(args: Mapping[str, Expr]) -> str:
    return f"({', '.join(f'{key}: {source(e)}' for key, e in args.items())})" if args else ""


def _modifiers(step: Step) -> list[str]:
    words = [f"when {source(step.when)}"] if step.when else []
    words += _options(step)
    if step.ignore_failure:
        words.append("failure ignored")
    if step.timeout:
        words.append(f"timeout {source(step.timeout)}")
    if step.retry:
        another = ", another agent" if step.retry.agent == "another" else ""
        words.append(f"{source(step.retry.attempts)} attempts{another}")
    if step.critical:
        words.append("critical")
    expect = getattr(step, "expect", None)
    if isinstance(expect, Expr):
        words.append(f"expect {source(expect)}")
    save_as = getattr(step, "save_as", "")
    return [*words, f"save as {save_as}"] if save_as else words


def _how_long(step: model.Loop) -> str:
    if step.cond is not None:
        return source(step.cond)
    if step.times is not None:
        return f"{source(step.times)} times"
    return source(step.duration) if step.duration is not None else "forever"


def _list(expr: Expr) -> str:
    return source(expr) or (f"{len(expr.const)} items" if isinstance(expr.const, tuple) else "a list")


def _options(step: Step) -> list[str]:
    """Return what the kinds with children say beside their own value."""
    match step:
        case model.Loop():
            facts = (("until", step.until), ("every", step.every), ("at most", step.max))
            return [f"{word} {source(e)}" for word, e in facts if e is not None]
        case model.Request():
            words = [f"priority {step.priority}"] if step.priority else []
            words += [] if step.wait else ["not waited for"]
            return [*words, "detached"] if step.detached else words
        case model.Sequence() | model.Fallback():
            return ["reactive"] if step.reactive else []
        case model.Parallel() | model.For():
            words = ["all at once"] if isinstance(step, model.For) and step.parallel else []
            if isinstance(step, model.For) and step.max_parallel is not None:
                words = [f"{step.max_parallel} at a time"]
            words += [f"need {step.need}"] if step.need != "all" else []
            words += ["cancel after a failure"] if step.on_child_failure == "cancel" else []
            return [*words, f"collect {step.collect}"] if isinstance(step, model.For) and step.collect else words
    return []


def _bracket(words: Sequence[str]) -> str:
    return f"  [{'; '.join(words)}]" if words else ""


def source(expr: Expr) -> str:
    """Return an expression as the author wrote it, on one line and without `${ }` around the whole."""
    text = " ".join(expr.source.split())
    whole = text.startswith("${") and text.endswith("}") and "${" not in text[2:]
    return text[2:-1].strip() if whole else text


@dataclass(frozen=True, slots=True)
class _Layout:
    """Turns branches into lines of at most `width` columns."""

    width: int
    glyphs: Glyphs
    ascii_only: bool
    main_file: str

    def group(self, title: str, branches: Sequence[_Branch]) -> list[Line]:
        if not branches:
            return []
        return [self.line("", (Span(title, "title"),), None), *self._rows(branches, "")]

    def _rows(self, branches: Sequence[_Branch], prefix: str) -> list[Line]:
        lines = []
        for branch in branches:
            last = branch is branches[-1]
            lines.append(
                self.line(prefix + (self.glyphs.corner if last else self.glyphs.tee), branch.spans, branch.mark)
            )
            lines += self._rows(branch.children, prefix + ("   " if last else self.glyphs.bar))
        return lines

    def line(self, prefix: str, spans: Sequence[Span], mark: Mark | None) -> Line:
        place = self._place(mark)
        room = self.width - (len(place) + 2 if place else 0)
        shown: list[Span] = []
        for span in (Span(prefix, "dim"), *spans):
            text = span.text.encode("ascii", "backslashreplace").decode() if self.ascii_only else span.text
            if len(text) > room:
                cut = self.glyphs.cut[: max(0, room)]
                shown.append(Span(text[: max(0, room - len(cut))] + cut, span.style))
                room = 0
                break
            room -= len(text)
            shown.append(Span(text, span.style))
        if place:
            shown.append(Span(" " * (room + 2) + place, "dim"))
        return Line(tuple(shown))

    def _place(self, mark: Mark | None) -> str:
        if mark is None:
            return ""
        name = PurePath(mark.file).name
        short = f":{mark.line}" if self.width < 72 and mark.file == self.main_file else f"{name}:{mark.line}"
        return short if len(short) < self.width // 2 else f":{mark.line}"
