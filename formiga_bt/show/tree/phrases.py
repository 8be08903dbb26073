"""How steps, roles and params of a checked task are said on one line: as the author wrote them, in styled spans.

Used by `drawing`. Kinds that this module does not know are said by their name.
"""

from collections.abc import Mapping, Sequence
from typing import assert_never

from formiga_bt.lang import model
from formiga_bt.lang.model import Expr, Param, Role, Step, Task
from formiga_bt.show.facts import StyledSpan


def source(expr: Expr) -> str:
    """Return an expression as the author wrote it, on one line and without `${ }` around the whole."""
    text = " ".join(expr.source.split())
    whole = text.startswith("${") and text.endswith("}") and "${" not in text[2:]
    return text[2:-1].strip() if whole else text


def facts_of(task: Task) -> tuple[str, ...]:
    """Return what holds for all of a task: priority, timeout and the like."""
    facts = [f"priority {task.priority}"]
    if task.timeout:
        facts.append(f"timeout {source(task.timeout)}")
    if task.expires:
        facts.append(f"expires {source(task.expires)}")
    if not task.preemptible:
        facts.append("not preemptible")
    return tuple(facts)


def param_label(param: Param) -> tuple[StyledSpan, ...]:
    """Return a param with its type, default and limits."""
    text = f": {param.type}"
    if param.default:
        text += " = " + (source(param.default) or '""')
    limits = [f"{word} {source(e)}" for word, e in (("min", param.min), ("max", param.max)) if e]
    if param.optional:
        limits.append("optional")
    return (StyledSpan(param.name, "agent"), StyledSpan(text), *_bracket(limits))


def var_label(name: str, expr: Expr) -> tuple[StyledSpan, ...]:
    """Return a var with its value."""
    return StyledSpan(name, "agent"), StyledSpan(f" = {source(expr)}")


def role_label(role: Role) -> tuple[StyledSpan, ...]:
    """Return a role with the agents that can play it."""
    facts = [f"{word} {source(e)}" for word, e in (("id", role.id), ("near", role.near), ("prefer", role.prefer)) if e]
    if role.battery_min:
        facts.append(f"battery >= {source(role.battery_min)}")
    if role.capabilities:
        facts.append("with " + ", ".join(role.capabilities))
    if role.wait:
        facts.append(f"waits {source(role.wait)}")
    if role.if_lost != "fail":
        facts.append(f"if lost: {role.if_lost}")
    if role.hand_over_at:
        facts.append(f"hands over at {source(role.hand_over_at)}")
    if role.away:
        facts.append("may be away")
    if role.preempt is not None:
        facts.append("takes busy ones" if role.preempt else "takes no busy ones")
    return (StyledSpan(role.name, "agent"), StyledSpan(f": {_types(role)}"), *_bracket(facts))


def _types(role: Role) -> str:
    count = f"{_how_many(role)} x " if role.is_list else ""
    return count + " or ".join(role.types)


def _how_many(role: Role) -> str:
    if role.open is None:
        return str(role.count)
    if role.open.max is None:
        return "all" if role.open.min == 1 else f"{role.open.min} or more"
    return f"{role.open.min} to {role.open.max}"


def _tracked(track: model.Track | None) -> tuple[StyledSpan, ...]:
    if track is None:
        return ()
    near = [f"within {source(track.within)}"] if track.within is not None else []
    return _bracket(["tracks", f"every {source(track.every)}", *near])


def _bracket(words: Sequence[str]) -> tuple[StyledSpan, ...]:
    return (StyledSpan(f"  [{'; '.join(words)}]", "dim"),) if words else ()


def label_of(step: Step) -> tuple[StyledSpan, ...]:
    """Return what a step does; its name, if it has one, first."""
    name = (StyledSpan(f"{step.name}: ", "title"),) if step.name else ()
    return (*name, *_said(step))


def _said(step: Step) -> tuple[StyledSpan, ...]:
    match step:
        case model.Do():
            return (
                StyledSpan(f"{step.who.name}.", "agent"),
                StyledSpan(step.action, "kind"),
                *_args(step.fields),
                *_tracked(step.track),
            )
        case model.Ask():
            people = ", ".join(who.name for who in step.of)
            choices = " / ".join(step.options)
            return (
                StyledSpan("ask ", "kind"),
                StyledSpan(people, "agent"),
                StyledSpan(f': "{source(step.question)}" {choices}'),
            )
        case model.Call():
            return StyledSpan("call ", "kind"), StyledSpan(step.subtree.name, "agent"), *_args(step.args)
        case model.Request():
            return StyledSpan("request ", "kind"), StyledSpan(step.task, "agent"), *_args(step.args)
        case model.Wait():
            return StyledSpan("wait ", "kind"), StyledSpan(source(step.duration))
        case model.Check():
            return StyledSpan("check ", "kind"), StyledSpan(source(step.cond))
        case model.Set():
            text = ", ".join(f"{key} = {source(e)}" for key, e in step.assign.items())
            return StyledSpan("set ", "kind"), StyledSpan(text)
        case model.Notify():
            to = " to " + ", ".join(who.name for who in step.to) if step.to else ""
            return StyledSpan("notify", "kind"), StyledSpan(f'{to}: "{source(step.text)}" ({step.severity})')
        case model.Fail():
            code = f" [{step.code}]" if step.code else ""
            data = ", ".join(f"{key}: {source(e)}" for key, e in step.data.items())
            carries = f" with {data}" if data else ""
            return StyledSpan("fail", "kind"), StyledSpan(f'{code}: "{source(step.message)}"{carries}')
        case model.WaitFor():
            since = " (since the task's start)" if step.since_task else ""
            return (
                StyledSpan("wait for ", "kind"),
                StyledSpan(step.who.name, "agent"),
                StyledSpan(f".{step.event}{since}"),
            )
        case model.Release():
            return StyledSpan("release ", "kind"), StyledSpan(step.who.name, "agent")
        case _:
            return _said_of_parent(step)


def _said_of_parent(
    step: model.If
    | model.Switch
    | model.WaitUntil
    | model.Guard
    | model.BreakIf
    | model.WithAgents
    | model.WithResource
    | model.Loop
    | model.For
    | model.Sequence
    | model.Fallback
    | model.Parallel,
) -> tuple[StyledSpan, ...]:
    match step:
        case model.If():
            return StyledSpan("if ", "kind"), StyledSpan(source(step.cond))
        case model.Switch():
            return StyledSpan("switch ", "kind"), StyledSpan(source(step.on))
        case model.WaitUntil() | model.Guard() | model.BreakIf():
            return StyledSpan(f"{step.kind} ", "kind"), StyledSpan(source(step.cond))
        case model.WithAgents():
            who = ", ".join(f"{role.name}: {_types(role)}" for role in step.roles.values())
            return StyledSpan("with_agents ", "kind"), StyledSpan(who, "agent")
        case model.WithResource():
            waits = _bracket([f"waits {source(step.wait)}"] if step.wait else [])
            return StyledSpan("with_resource ", "kind"), StyledSpan(step.said), *waits
        case model.Loop():
            return StyledSpan(f"{step.kind} ", "kind"), StyledSpan(_how_long(step))
        case model.For():
            lists = ", ".join(f"{name} in {_list(e)}" for name, e in step.lists.items())
            return StyledSpan("for ", "kind"), StyledSpan(lists)
        case model.Sequence() | model.Fallback() | model.Parallel():
            return (StyledSpan(step.kind, "kind"),)
        case _:
            assert_never(step)


def _args(args: Mapping[str, Expr]) -> tuple[StyledSpan, ...]:
    return (StyledSpan(f"({', '.join(f'{key}: {source(e)}' for key, e in args.items())})"),) if args else ()


def _how_long(step: model.Loop) -> str:
    if step.cond is not None:
        return source(step.cond)
    if step.times is not None:
        return f"{source(step.times)} times"
    return source(step.duration) if step.duration is not None else "forever"


def _list(expr: Expr) -> str:
    return source(expr) or (f"{len(expr.const)} items" if isinstance(expr.const, tuple) else "a list")


def modifiers_of(step: Step) -> tuple[str, ...]:
    """Return what holds for a step beside what it does: `when ...`, `timeout 2 min`, `3 attempts`."""
    words = [f"when {source(step.when)}"] if step.when else []
    words += _options(step)
    if step.ignore_failure:
        words.append(IGNORED)
    if step.timeout:
        words.append(f"timeout {source(step.timeout)}")
    if step.retry:
        another = ", another agent" if step.retry.agent == "another" else ""
        on = f", on {', '.join(step.retry.on)}" if step.retry.on else ""
        unless = f", unless {', '.join(step.retry.unless)}" if step.retry.unless else ""
        words.append(f"{source(step.retry.attempts)} attempts{another}{on}{unless}")
    if step.critical:
        words.append("critical")
    expect = getattr(step, "expect", None)
    if isinstance(expect, Expr):
        words.append(f"expect {source(expect)}")
    save_as = getattr(step, "save_as", "")
    return (*words, f"save as {save_as}") if save_as else tuple(words)


IGNORED = "failure ignored"
"""The modifier in words of a step whose failure does not count."""


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
            words += [f"need {step.need}"] if step.need not in ("all", "first") else []
            words += ["cancel after a failure"] if step.on_child_failure == "cancel" else []
            if isinstance(step, model.For) and step.gives:
                words.append(f"collect {step.collect}" if step.collect else f"first {step.first}")
            return words
    return []


def role_of(step: Step) -> str:
    """Return whom a step names: the agent that acts, the people that are asked or told."""
    match step:
        case model.Do() | model.WaitFor() | model.Release():
            return step.who.name
        case model.Ask():
            return ", ".join(who.name for who in step.of)
        case model.Notify():
            return ", ".join(who.name for who in step.to)
        case _:
            return ""


def guard_of(step: Step) -> str:
    """Return the condition that lets a step run: that of `if` and `guard`, else of `when`."""
    if isinstance(step, model.If | model.Guard):
        return source(step.cond)
    return source(step.when) if step.when else ""
