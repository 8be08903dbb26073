"""What a person reads before they approve a draft: what it will do, step by step, from the tree and not from the model.

Warnings first, then the steps in plain words, the values with the words that they came from or `assumed`, and what the dry run
showed. Lines are plain text; whoever prints them cuts them to the terminal.
"""

import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from formiga_bt.lang import model
from formiga_bt.lang.model import Expr, Step, Task
from formiga_bt.llm.records import Draft, ParamValue, RehearsedFlight
from formiga_bt.llm.shaping.lifting import ASSUMED
from formiga_bt.show.clean import cleaned
from formiga_bt.show.tree.phrases import label_of, source

CALLS: Final[Mapping[str, str]] = {
    "FlyTo": "{drone} flies to {to} and hovers {height} over it",
    "FlyAlong": "{drone} flies along {way}, {height} over the ground",
    "FlyAndLand": "{drone} flies to {at} and lands there",
    "FlyOver": "{drone} flies to over {to}",
    "ReturnHome": "{drone} comes home and lands",
    "FetchHome": "{drone} takes off and comes home",
    "LandNear": "{drone} lands at {at}",
}
ACTIONS: Final[Mapping[str, str]] = {
    "TakeOff": "{agent} takes off",
    "GoTo": "{agent} flies to {to}",
    "LandIn": "{agent} lands at {at}",
    "Explore": "{agent} looks at all of {region} from {altitude}",
    "MiniFinder": "the tracker of {agent} says where to go",
}
_NAME: Final = re.compile(r"(?<![\w.'])[A-Za-z_]\w*(?![\w(]|\s*=(?!=))")


def in_words(draft: Draft, task: Task | None, *, width: int = 100) -> list[str]:
    """Return what a person is told of a draft.

    Args:
        draft: what came of a request.
        task: the checked task of its YAML, if there is one.
        width: columns.
    """
    if draft.kind in ("question", "impossible"):
        head = "A question back:" if draft.kind == "question" else "This cannot be done:"
        return [head, *_wrapped(draft.say, width, "  ")]
    lines = []
    if draft.kind == "failed":
        lines += ["No task came of it that passes:", *_wrapped(draft.say, width, "  "), ""]
    warnings = [one for one in draft.shortfalls if one.severity == "warning"]
    for one in warnings:
        lines += _wrapped(f"warning {one.code}: {one.text}", width, "")
    if warnings:
        lines.append("")
    if task is None:
        return lines
    lines += [f"{task.name}: {cleaned(task.description)}"[:width], "", "What it will do:"]
    lines += told(task, draft.values, width)
    if draft.values:
        lines += ["", "With:", *_values(draft.values)]
    if draft.flight is not None:
        lines += ["", "In the dry run:", *(f"  {line}" for line in flown(draft.flight))]
    mends = draft.rounds[-1].mends if draft.rounds else ()
    if mends:
        lines += ["", "Put right by a program:", *(f"  {mend}" for mend in mends)]
    return lines


def told(task: Task, values: Sequence[ParamValue], width: int = 100) -> list[str]:
    """Return the steps of a task in plain words, numbered."""
    known = {one.name: one.text for one in values}
    lines: list[str] = []
    for number, step in enumerate(task.steps, 1):
        inner = list(_said(step, known))
        lines += _wrapped(inner[0][1], width, f"{number:3}. ", "     ")
        for depth, text in inner[1:]:
            lines += _wrapped(text, width, "     " + "  " * (depth - 1) + "- ", "     " + "  " * depth)
    return lines


def _said(step: Step, known: Mapping[str, str], depth: int = 0) -> Iterator[tuple[int, str]]:
    """Yield a step and the steps inside it, each with its depth."""
    lead = f"if {_value(step.when, known)}: " if step.when is not None else ""
    inside: Sequence[Step] = ()
    match step:
        case model.Call():
            args = {name: _value(expr, known) for name, expr in step.args.items()}
            text = _phrase(CALLS.get(step.subtree.name, ""), args) or f"{step.subtree.name} {_list_of(args)}"
        case model.Do():
            args = {"agent": step.who.name, **{name: _value(expr, known) for name, expr in step.fields.items()}}
            text = _phrase(ACTIONS.get(step.action, ""), args) or f"{step.who.name}: {step.action} {_list_of(args)}"
        case model.Ask():
            people = ", ".join(who.name for who in step.of)
            word = _one_word(step.expect)
            only = f'; it goes on only with "{word}"' if word else ""
            text = f'{people} is asked: "{cleaned(source(step.question))}" ({" / ".join(step.options)}){only}'
        case model.Wait():
            text = f"wait {_value(step.duration, known)}"
        case model.Notify():
            text = f'people are told: "{cleaned(source(step.text))}"'
        case model.Parallel():
            text, inside = "at the same time:", step.steps
        case model.Sequence():
            text, inside = "one after another:", step.steps
        case model.Loop():
            text, inside = f"{_rounds(step, known)}:", step.steps
        case model.For():
            text, inside = "".join(span.text for span in label_of(step)) + ":", step.steps
        case model.If():
            yield depth, lead + f"if {_value(step.cond, known)}:"
            for one in step.then:
                yield from _said(one, known, depth + 1)
            if step.otherwise:
                yield depth + 1, "otherwise:"
                for one in step.otherwise:
                    yield from _said(one, known, depth + 2)
            return
        case _:
            text = "".join(span.text for span in label_of(step))
    yield depth, lead + text
    for one in inside:
        yield from _said(one, known, depth + 1)


def _one_word(expect: Expr | None) -> str:
    """Return the one answer that is wanted, or ""."""
    match = re.fullmatch(r"result\.answer == '([^']*)'", expect.source.strip()) if expect is not None else None
    return match[1] if match is not None else ""


def _rounds(step: model.Loop, known: Mapping[str, str]) -> str:
    if step.times is not None:
        return f"{_value(step.times, known)} times"
    if step.duration is not None:
        return f"again and again for {_value(step.duration, known)}"
    return "again and again" if step.forever else f"as long as {_value(step.cond, known)}"


def _phrase(pattern: str, args: Mapping[str, str]) -> str:
    try:
        return pattern.format(**args)
    except (KeyError, IndexError):
        return ""


def _list_of(args: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {text}" for name, text in args.items())


def _value(expr: Expr | None, known: Mapping[str, str]) -> str:
    """Return an expression with the values of params in it."""
    if expr is None:
        return ""
    return cleaned(_NAME.sub(lambda m: known.get(m[0], m[0]), source(expr)))


def _values(values: Sequence[ParamValue]) -> list[str]:
    wide = max(len(one.name) for one in values)
    broad = max(len(one.text) for one in values)
    return [
        f"  {one.name:<{wide}}  {one.text:<{broad}}  " + (f'"{cleaned(one.words)}"' if one.words else ASSUMED)
        for one in values
    ]


def flown(flight: RehearsedFlight) -> list[str]:
    """Return what a dry run showed, a line each."""
    why = f": {flight.code} {flight.reason}".rstrip(": ") if flight.code or flight.reason else ""
    lines = [f"{flight.status} after {_minutes(flight.duration_s)}{why}"]
    for agent, left in flight.least_battery.items():
        where = flight.stands.get(agent, "")
        ends = {"home": "ends at its own port", "in the air": "is still in the air"}.get(where, f"ends at {where}")
        over = flight.visited.get(agent, ())
        way = f", by way of {', '.join(over)}" if over else ""
        lines.append(f"{agent} {ends}{way}; {left:g} % charge left at the least")
    if flight.asked:
        lines.append(f"asked: {', '.join(flight.asked)}")
    if flight.moved_unasked:
        lines.append(f"moved without a role: {', '.join(flight.moved_unasked)}")
    lines.append(f"crashes: {flight.crashes}")
    return lines


def _minutes(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole} s" if whole < 120 else f"{whole // 60} min {whole % 60} s"


def _wrapped(text: str, width: int, first: str, later: str | None = None) -> list[str]:
    rest = later if later is not None else " " * len(first)
    return textwrap.wrap(cleaned(text), max(40, width), initial_indent=first, subsequent_indent=rest) or [
        first.rstrip()
    ]
