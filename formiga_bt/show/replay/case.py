"""The story of a task as a case for `formiga test`: what people answered, what failed, who was there, and how it ended."""

import json
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any, Final

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.base.units import format_quantity
from formiga_bt.engine.kernel.inputs import Abort, LockdownOrder, Operator
from formiga_bt.engine.kernel.records import AgentRecord, Question
from formiga_bt.lang.codes import written_code
from formiga_bt.lang.model import Site, Task
from formiga_bt.lang.text.reading import shorten
from formiga_bt.lang.types import AgentRef, Type
from formiga_bt.rehearsal.cases.judging import standing
from formiga_bt.show.replay.case_story import CaseStory, Fault
from formiga_bt.show.replay.when import in_words

NEAR_M: Final = 1.0
FULL: Final = 99.5
MOST: Final = 80
"""Characters of a question behind its answer."""
LOOSE: Final = ("after", "clearances", "actions", "notices", "answers_asked", "end_state")
"""What of a case may be left out or made easier if it does not come again in simulation; of clearances, when all were given."""
CLEARANCE: Final = " is about to "
"""In the text of each question of the engine itself, between the machine and what it does."""
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def text_of(
    story: CaseStory, site: Site, model: Task, files: Mapping[str, str], zone: Any, loose: Collection[str] = ()
) -> str:
    """Return a test file with one case.

    Args:
        story: of the task.
        site: where it was.
        model: of the task.
        files: `task` and `site` as the file names them; no `site`: the demo site.
        zone: of the times that people read.
        loose: of `LOOSE`, what is left out or made easier.
    """
    task = story.task
    run = f", run {story.first.number}" if story.first.number > 1 else ""
    lines = [
        f"# {task.id}{run} as it was, from the journal of {site.name}: formiga replay --task {task.id} --as-test FILE",
        "# docs/testing.md explains each key. Times count from the request.",
        *(f"# {text}" for text in told(story)),
        "formiga_test: 1",
        *(f"{key}: {_quoted(name)}" for key, name in files.items()),
        "cases:",
        f"  - name: {_quoted(f'{task.id}{run} on {in_words(task.times.submitted_at, zone)}')}",
    ]
    params = {
        name: literal(value, model.params[name].type if name in model.params else None, site)
        for name, value in task.request.params.items()
        if value is not None
    }
    if params:
        lines.append(f"    params: {_flow(params)}")
    lines += _block("agents", [f"{name}: {_flow(keys)}{_why(why)}" for name, keys, why in _agents(story, site)])
    answers = [*_answers(story, easy="clearances" in loose), *_failures(story, easy="after" in loose)]
    lines += _block("answers", [f"- {_flow(keys)}{_why(why)}" for keys, why in answers])
    lines += _block("faults", [f"- {_flow(keys)}{_why(why)}" for keys, why in map(_fault(story), story.faults)])
    lines += _block("orders", [f"- {_flow(keys)}" for keys in _orders(story, site)])
    lines.append("    expect:")
    lines += [f"      {line}" for line in _expect(story, loose)]
    return "\n".join(lines) + "\n"


def told(story: CaseStory) -> list[str]:
    """Return what of the story the case does not tell, or tells otherwise, in sentences."""
    first = story.first
    found: list[str] = []
    if first.number > 1:
        before = next((run for run in reversed(story.runs) if run.number < first.number), first)
        why = {"preempted": "was preempted for another task", "agent_lost": "lost an agent"}.get(
            before.ended_by, "was restarted"
        )
        found.append(
            f"Run {before.number} {why}, which does not come again in a case: this is run {first.number}, from its beginning."
        )
    if first.waited_us >= SECOND:
        found.append(f"It waited {_seconds(first.waited_us)} for its agents; times count from when it got them.")
    for at in story.resumed:
        found.append(f"After {_seconds(at - story.at)} another engine went on with it; here one engine plays it all.")
    return found


def _why(text: str) -> str:
    return f"  # {text}" if text else ""


def _block(key: str, items: list[str]) -> list[str]:
    return [f"    {key}:", *(f"      {item}" for item in items)] if items else []


def _flow(keys: Mapping[str, str]) -> str:
    return "{" + ", ".join(f"{name}: {value}" for name, value in keys.items()) + "}"


def _quoted(text: str) -> str:
    return text if re.fullmatch(r"[\w./-]+", text) and not text[0].isdigit() else json.dumps(text, ensure_ascii=False)


def literal(value: Any, kind: Type | None, site: Site) -> str:
    """Return a runtime value as it is written in a file."""
    match value:
        case AgentRef():
            return value.id
        case bool():
            return "true" if value else "false"
        case int() | float():
            return format_quantity(kind.name if kind is not None else "", float(value))
        case Position():
            return _flow({**_metres(value), "height": f"{value.up_m:g} m"})
        case Place():
            return next((name for name, at in site.places.items() if at == value), None) or _flow(_metres(value))
        case Region():
            known = next((name for name, one in site.regions.items() if one == value), None)
            return known or "[" + ", ".join(_flow(_metres(corner)) for corner in value.corners) + "]"
        case tuple() | list():
            item = kind.item if kind is not None else None
            return "[" + ", ".join(literal(one, item, site) for one in value) + "]"
        case dict():
            return _flow({name: literal(one, None, site) for name, one in value.items()})
        case _:
            return _quoted(str(value))


def _metres(at: Place | Position) -> dict[str, str]:
    return {"east": f"{round(at.east_m, 2):g} m", "north": f"{round(at.north_m, 2):g} m"}


def _seconds(us: Micros) -> str:
    return f"{max(0.0, us / SECOND):.1f} s"


def _at(story: CaseStory, at: Micros) -> dict[str, str]:
    return {"at": _seconds(at - story.at)}


def _agents(story: CaseStory, site: Site) -> Iterator[tuple[str, dict[str, str], str]]:
    """Yield how the fleet differed from the site at rest, and why; who was busy with something else is not there."""
    task = story.task
    mine = {*task.agents.granted, *(one.agent for one in story.sent)}
    for name, known in site.agents.items():
        agent = story.began.agents.get(name)
        why = "no engine had seen it" if agent is None else "" if agent.human or name in mine else _away(agent, task.id)
        if agent is None or why:
            yield name, {"absent": "true"}, f"not in this case: {why}"
            continue
        keys = {} if agent.human else _charge(agent)
        port = site.ports.get(known.home)
        spot = port.at if port is not None else None
        is_here = name in mine and agent.task in ("", task.id)  # else it came to its port before it was granted
        if agent.position is not None and is_here and not (isinstance(spot, Place) and _near(agent, spot)):
            keys["at"] = _flow(_metres(agent.position.ground))
        if keys:
            yield name, keys, ""
    for name in sorted(mine - set(site.agents)):
        agent = story.began.agents.get(name)
        if agent is not None and agent.position is not None:
            yield name, {"type": agent.type, "at": _flow(_metres(agent.position.ground)), **_charge(agent)}, ""


def _away(agent: AgentRecord, task: str) -> str:
    """Return why a machine could not have been granted, or nothing."""
    if agent.task not in ("", task):
        return f"it was busy with {agent.task}"
    if agent.quarantine:
        return f"it was quarantined ({agent.quarantine})"
    return "" if agent.present else "it was switched off"


def _fault(story: CaseStory) -> Callable[[Fault], tuple[dict[str, str], str]]:
    def keys(fault: Fault) -> tuple[dict[str, str], str]:
        found = {**_at(story, fault.at), "agent": fault.agent, "kind": fault.kind}
        if fault.presence:
            found["presence"] = fault.presence
        if fault.until is not None:
            found["for"] = _seconds(max(fault.until - fault.at, SECOND // 10))
        if fault.kind not in ("kill", "link_loss"):
            return found, ""
        lost = f"; at {_seconds(fault.lost_at - story.at)} it was given up" if fault.lost_at is not None else ""
        back = "then it was back, its process started anew" if fault.kind == "kill" else "then it was back"
        return found, f"nothing was heard of it from then on{lost}" + (f"; {back}" if fault.until is not None else "")

    return keys


def _charge(agent: AgentRecord) -> dict[str, str]:
    return {} if agent.battery is None or agent.battery >= FULL else {"battery": f"{agent.battery:.0f} %"}


def _near(agent: AgentRecord, spot: Place) -> bool:
    at = agent.position
    return at is not None and abs(at.east_m - spot.east_m) <= NEAR_M and abs(at.north_m - spot.north_m) <= NEAR_M


def _answers(story: CaseStory, *, easy: bool) -> Iterator[tuple[dict[str, str], str]]:
    asks = [one for one in story.questions.values() if one.kind == "ask"]
    for n, question in enumerate(asks, 1):
        yield {"ask": str(n), **_reply(question)}, shorten(question.text, MOST)
    others = [one for one in story.questions.values() if one.kind != "ask"]
    if not easy or any(one.reply is None or one.reply["answer"] != "clear" for one in others):
        for question in others:
            yield {"ask": _quoted(question.text.partition(":")[0]), **_reply(question)}, "asked by the engine itself"


def _reply(question: Question) -> dict[str, str]:
    if question.reply is None:
        return {"never": "true"}
    return {
        "answer": _quoted(str(question.reply["answer"])),
        "after": _seconds(int(question.reply.get("at", question.asked_at)) - question.asked_at),
    }


def _failures(story: CaseStory, *, easy: bool) -> Iterator[tuple[dict[str, str], str]]:
    for one in story.failed:
        keys = {"do": f"{one.who}.{one.action}", "nth": str(one.nth)}
        code = one.goal.code if _NAME.fullmatch(one.goal.code) else "failed"
        which = f"its {_ordinal(one.nth)} {one.action}"
        if one.goal.state == "rejected":
            yield {**keys, "reject": code}, f"{which} was refused"
        else:
            after = _seconds(one.ended_at - one.sent_at)
            why = f"{which} failed" + (f" after {after}; in simulation it ends before" if easy else "")
            yield {**keys, "fail": code, "after": "0.5 s" if easy else after}, why


def _ordinal(n: int) -> str:
    last = {1: "st", 2: "nd", 3: "rd"}.get(n % 10, "th") if n % 100 not in (11, 12, 13) else "th"
    return f"{n}{last}"


def _orders(story: CaseStory, site: Site) -> Iterator[dict[str, str]]:
    for at, order in story.orders:
        by = {"by": order.by} if order.by in site.agents else {}
        match order:
            case Abort(task, how) if task == story.task.id:
                yield {**_at(story, at), "abort": story.task.name, **({"how": how} if how else {}), **by}
            case LockdownOrder(how):
                yield {**_at(story, at), "lockdown": how, **by}
            case Operator(ordered, target):
                name = story.task.name if target == story.task.id else target or "all"
                verb, _, rest = ordered.partition("_")
                yield {**_at(story, at), "order": verb, "target": name, **({"how": rest} if rest else {}), **by}


def _expect(story: CaseStory, loose: Collection[str]) -> Iterator[str]:
    task = story.task
    yield f"status: {task.status.lower()}"
    code = written_code(task.outcome.code)
    if task.status != "SUCCEEDED" and code:
        yield f"code: {code}"
    if "actions" not in loose:
        yield f"actions: [{', '.join(f'{one.who}.{one.action}' for one in story.sent)}]{_why('goals sent, ways home too')}"
    ends = _ends(story)
    if ends and "end_state" not in loose:
        yield f"end_state: {_flow(ends)}{_why('where its machines were when it ended')}"
    asks = sum(one.kind == "ask" for one in story.questions.values())
    if "answers_asked" not in loose:
        yield f"answers_asked: {asks}{_why('questions of its own ask steps')}"
    if story.notices and "notices" not in loose:
        parts = ", ".join(json.dumps(_part(text), ensure_ascii=False) for text in story.notices)
        yield f"notices: [{parts}]{_why('a part of each notice, without names and numbers')}"


def _ends(story: CaseStory) -> dict[str, str]:
    """Return how its machines were at the end: by role, or by machine if those of a role were not all the same."""
    of: dict[str, dict[str, str]] = {}
    for one in story.sent:
        agent = story.ended.agents.get(one.agent)
        if agent is not None and not agent.human:
            of.setdefault(one.who, {})[one.agent] = standing(agent)
    found: dict[str, str] = {}
    for who, each in of.items():
        found |= {who: next(iter(each.values()))} if len(set(each.values())) == 1 else each
    return found


def _part(notice: str) -> str:
    """Return the longest part of a notice between words with a digit: ids and amounts come otherwise another time."""
    return max((one.strip() for one in re.split(r"\S*\d\S*", notice)), key=len)
