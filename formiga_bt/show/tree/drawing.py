"""A checked task as a `Drawing`: the plain values that every picture of a tree is made from. No run, no py_trees.

`drawing_of` makes one from the model, `cut` leaves parts of it out. A drawing plus, for a task that runs, the facts of its
steps by path is all that any format reads.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping

from msgspec.structs import replace

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang import model
from formiga_bt.lang.model import Step, Task
from formiga_bt.lang.walk import Names, called_with, children, items_of
from formiga_bt.show.facts import Box, Drawing, FileSpot, StyledSpan
from formiga_bt.show.tree import phrases


def drawing_of(task: Task, *, sources: Mapping[str, str] | None = None) -> Drawing:
    """Return a task as a tree.

    Args:
        task: the checked task.
        sources: file -> text; those that the tree has steps in go into the drawing.
    """
    sections = (("steps", task.steps), ("on_failure", task.on_failure), ("on_abort", task.on_abort))
    drawing = Drawing(
        task=task.name,
        version=task.version,
        description=" ".join(task.description.split()),
        facts=phrases.facts_of(task),
        spot=_spot(task.mark),
        params=tuple(_row("param", phrases.param_label(p), p.mark) for p in task.params.values()),
        vars=tuple(_row("var", phrases.var_label(name, e), e.mark) for name, e in task.vars.items()),
        roles=tuple(_row("role", phrases.role_label(r), r.mark, role=r.name) for r in task.roles.values()),
        sections=tuple(
            Box(
                kind="section",
                path=f"{name}/",
                label=(StyledSpan(name, "title"),),
                children=_boxes(steps, f"{name}/", {}),
            )
            for name, steps in (*sections, ("finally", task.finally_))
            if steps
        ),
    )
    return drawing if sources is None else replace(drawing, sources=_used(drawing, sources))


def _row(kind: str, label: tuple[StyledSpan, ...], mark: Mark, role: str = "") -> Box:
    return Box(kind=kind, label=label, spot=_spot(mark), role=role)


def _spot(mark: Mark) -> FileSpot:
    return FileSpot(mark.file, mark.line, mark.col)


def _used(drawing: Drawing, sources: Mapping[str, str]) -> dict[str, str]:
    rows = (*drawing.params, *drawing.vars, *drawing.roles, *drawing.sections)
    files = {drawing.spot.file, *(box.spot.file for box in walk(rows) if box.spot)}
    return {file: text for file, text in sources.items() if file in files}


def _boxes(steps: Iterable[Step], prefix: str, names: Names) -> tuple[Box, ...]:
    return tuple(_box(step, prefix + step.seg, names) for step in steps)


def _box(step: Step, path: str, names: Names) -> Box:
    role = phrases.role_of(step)
    first = role.partition(", ")[0]
    behind = names.get(first, (first,))
    return Box(
        path=path,
        kind=step.kind,
        label=phrases.label_of(step),
        modifiers=phrases.modifiers_of(step),
        role=role,
        task_role=behind[0].partition("[")[0] if len(behind) == 1 else "",
        action=step.action if isinstance(step, model.Do) else "",
        guard=phrases.guard_of(step),
        spot=_spot(step.mark),
        children=_children(step, f"{path}.", names),
    )


def _children(step: Step, prefix: str, names: Names) -> tuple[Box, ...]:
    match step:
        case model.If() if step.otherwise:
            return _branch("then", step.then, prefix, names), _branch("else", step.otherwise, prefix, names)
        case model.If():
            return _boxes(step.then, prefix, names)
        case model.Switch():
            cases = tuple(_branch(str(case.value), case.steps, prefix, names, case.mark) for case in step.cases)
            return (*cases, _branch("default", step.default, prefix, names)) if step.default else cases
        case model.Sequence() if step.finally_:
            return *_boxes(step.steps, prefix, names), _branch("finally", step.finally_, prefix, names)
        case model.Call():
            return _boxes(step.subtree.steps, prefix, called_with(step, names))
        case model.For():
            return _boxes(step.steps, prefix, {**names, **items_of(step, names)})
        case _:
            return _boxes(children(step), prefix, names)


def _branch(word: str, steps: tuple[Step, ...], prefix: str, names: Names, mark: Mark | None = None) -> Box:
    spot = _spot(mark) if mark else None
    return Box(kind="branch", label=(StyledSpan(word, "kind"),), spot=spot, children=_boxes(steps, prefix, names))


# -- reading a drawing -------------------------------------------------------------------------------------------------
def walk(boxes: Iterable[Box]) -> Iterator[Box]:
    """Iterate over boxes and all that is below them, parents first."""
    stack = list(boxes)[::-1]
    while stack:
        box = stack.pop()
        yield box
        stack.extend(reversed(box.children))


def is_step(box: Box) -> bool:
    """Return whether a box is a step, and not a section, a branch, a param, a var or a role."""
    return bool(box.path) and box.kind != "section"


def text_of(box: Box) -> str:
    """Return what a box says on one line, without its modifiers."""
    return "".join(span.text for span in box.label)


def tip_of(box: Box) -> str:
    """Return what a picture says when a step is pointed at: its line of the file and its text in full."""
    where = f"{box.spot.file}:{box.spot.line}" if box.spot else ""
    return " ".join(part for part in (where, text_of(box), *box.modifiers) if part)


def names_of(box: Box) -> tuple[str, ...]:
    """Return what a step can be called by: its path, its name, the subtree that it calls or the task that it requests."""
    names = [span.text.removesuffix(": ") for span in box.label if span.style == "title"]
    if box.kind in ("call", "request"):
        names += [span.text for span in box.label if span.style == "agent"]
    return (box.path, *names) if is_step(box) else (box.path.rstrip("/"),)


# -- leaving parts out -------------------------------------------------------------------------------------------------
def cut(drawing: Drawing, *, depth: int | None = None, collapse: Collection[str] = ()) -> Drawing:
    """Return a drawing without what is too deep or collapsed; boxes say in `hidden` how many steps went.

    Args:
        drawing: the whole one.
        depth: levels of steps to keep; None = all. Branches (`then`, a case) are no level.
        collapse: the names (see `names_of`) of steps and sections whose inside is left out.
    """
    sections = tuple(_cut(box, depth, frozenset(collapse)) for box in drawing.sections)
    return replace(drawing, sections=sections)


def _cut(box: Box, left: int | None, collapse: frozenset[str]) -> Box:
    if is_step(box) and left is not None:
        left -= 1
    if left == 0 or not collapse.isdisjoint(names_of(box)):
        hidden = sum(is_step(one) + one.hidden for one in walk(box.children))
        return replace(box, children=(), hidden=box.hidden + hidden)
    return replace(box, children=tuple(_cut(one, left, collapse) for one in box.children))
