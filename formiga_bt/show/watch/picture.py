"""One task close by: its live tree with what it waits for, its values, goals, agents, questions and events, and why."""

from typing import cast

from formiga_bt.show.facts import Because, GoalFact, TaskPicture
from formiga_bt.show.tree.drawing import is_step, walk
from formiga_bt.show.tree.terminal import draw
from formiga_bt.show.watch.needs import question_lines
from formiga_bt.show.watch.text import TONES, Glyphs, Line, PaneRow, Tone, TonedText, clean, fit, left, line, span, wrap

INDENT = 2


def head_lines(picture: TaskPicture, width: int, glyphs: Glyphs) -> list[Line]:
    """Return what is always seen of a task: how it stands, what comes next, its open questions."""
    task = picture.task
    word = "HELD" if task.held and not task.is_over else task.status
    pieces: list[TonedText | str] = [
        TonedText(clean(task.id), "bold"),
        " ",
        TonedText(
            f"{glyphs.marks.get(word, '?')} {task.status}" + (" HELD" if word == "HELD" else ""),
            TONES.get(word, "plain"),
        ),
    ]
    if task.agents:
        pieces += ["  ", TonedText(clean(" ".join(task.agents)), "agent")]
    if task.urgent_at is not None:
        pieces += ["  ", TonedText(f"{left(task.urgent_at, picture.at)} {clean(task.urgent)}", "warn")]
    lines = [line(*pieces)]
    says = "; ".join(part for part in (", ".join(task.held), task.doing, f"{task.code} {task.reason}".strip()) if part)
    lines += [line(" " * INDENT, part) for part in wrap(clean(says), width - INDENT)[:2] if part]
    for question in picture.questions:
        lines += question_lines(question, picture.at, width, glyphs)
    return lines


def tree_rows(picture: TaskPicture, width: int, *, ascii_only: bool) -> list[PaneRow]:
    """Return the live tree; the id of a row is the path of its step."""
    steps = {step.path: step for step in picture.steps}
    drawn = draw(picture.drawing, steps, width=width, ascii_only=ascii_only, head=False)
    return [
        PaneRow(f"{number}|{one.path}", (tuple(TonedText(p.text, cast("Tone", p.style)) for p in one.pieces),))
        for number, one in enumerate(drawn)
    ]


def running_row(rows: list[PaneRow], picture: TaskPicture) -> int:
    """Return the place of the deepest step that runs; 0 if none does."""
    runs = {step.path for step in picture.steps if step.status == "running"}
    leaves = {b.path for b in walk(picture.drawing.sections) if is_step(b) and b.path in runs and not b.children}
    found = [number for number, row in enumerate(rows) if row.id.partition("|")[2] in (leaves or runs)]
    return found[0] if found else 0


def value_rows(picture: TaskPicture, width: int, glyphs: Glyphs) -> list[PaneRow]:
    """Return the values of the blackboard, those of the task first, then of its scopes."""
    rows = []
    for scope in sorted(picture.values):
        if scope:
            rows.append(PaneRow(f"{scope}|", (line(TonedText(clean(scope), "title")),)))
        for name, value in picture.values[scope].items():
            shown = clean(str(value))
            indent = " " * INDENT if scope else ""
            first, *rest = wrap(shown, max(10, width - 22))
            lines = [line(indent, TonedText(fit(clean(name), 20, glyphs), "agent"), " ", first)]
            lines += [line(" " * 21, indent, part) for part in rest]
            rows.append(PaneRow(f"{scope}|{name}", tuple(lines)))
    return rows


def goal_rows(picture: TaskPicture, glyphs: Glyphs) -> list[PaneRow]:
    """Return the goals in flight, and those that wait at the gate with the reason."""
    return [PaneRow(goal.id, (_goal(goal, picture.at, glyphs),)) for goal in picture.goals]


def _goal(goal: GoalFact, now: int, glyphs: Glyphs) -> Line:
    percent = "" if goal.progress is None else f"{100 * goal.progress:.0f} %"
    where = clean(goal.target)
    waits = goal.state == "gated"
    said = " ".join(part for part in (goal.phase, goal.code, goal.text) if part)
    return line(
        TonedText(fit(clean(goal.agent), 12, glyphs) + " ", "agent"),
        TonedText(fit(clean(goal.action), 12, glyphs) + " ", "kind"),
        TonedText(fit("WAITS" if waits else clean(goal.state), 11, glyphs) + " ", "warn" if waits else "good"),
        TonedText(f"{percent:>5} "),
        TonedText(f"{span(now - goal.since):>7} ", "dim"),
        " ".join(part for part in (where, clean(said)) if part),
    )


def why_rows(found: tuple[str, list[Because]], width: int) -> list[PaneRow]:
    """Return an explanation: how it stands, then the chain of causes with what helps."""
    state, because = found
    rows = [PaneRow("state", (line(TonedText(clean(state), "bold")),))]
    for number, one in enumerate(because):
        indent = " " * INDENT * (1 + one.depth)
        lines = [line(indent, part) for part in wrap(clean(one.text), max(10, width - len(indent)))]
        if one.hint:
            lines += [
                line(indent, TonedText(f"-> {part}", "agent"))
                for part in wrap(clean(one.hint), max(10, width - len(indent) - 3))
            ]
        rows.append(PaneRow(f"{number}", tuple(lines)))
    return rows
