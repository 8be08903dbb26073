"""The tools that an assistant has: name, what it does in words, what it takes, what it gives, and who does it.

There is none that starts, stops, approves or answers anything: `propose_task` writes a file for a person.
"""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

import anyio.to_thread
import msgspec
from msgspec import Struct

from formiga_bt.base.errors import FormigaError, UnusableFile
from formiga_bt.llm.drafts import TASK, KeptDraft, drafts_folder
from formiga_bt.llm.mcp import catalogue, live, pages
from formiga_bt.llm.mcp import records as r
from formiga_bt.llm.mcp.ground import ServedSite, ServerFiles, ground_of
from formiga_bt.llm.mcp.judge import JobResult, JudgeJob, texts_of
from formiga_bt.llm.mcp.live import Connect
from formiga_bt.llm.mcp.outside import fenced
from formiga_bt.llm.mcp.proposals import assistant, doubles, draft_of, needed, next_steps, propose, wrote
from formiga_bt.llm.mcp.worker import JobProcesses
from formiga_bt.llm.origin import Asker
from formiga_bt.show.facts import ParamFact
from formiga_bt.show.listed import where_words

Progress = Callable[[float, str], Awaitable[None]]
Said = tuple[Struct, str]
"""An answer with its schema, and the same in few words."""
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Desk:
    """What tools work with."""

    where: ServerFiles
    connect: Connect
    crew: JobProcesses
    wall_millis: Callable[[], int]
    """Unix time, for what is written down."""
    people: tuple[str, ...] = ()
    """For whom assistants work here: who started the server."""

    async def ground(self) -> ServedSite:
        """Return site, catalogue and tasks as their files are now."""
        return await in_thread(partial(ground_of, self.where))


@dataclass(frozen=True, slots=True)
class McpCaller:
    """Who asks."""

    client: str
    progress: Progress


@dataclass(frozen=True, slots=True)
class Tool:
    """A tool; `writes` if it leaves a file behind."""

    name: str
    title: str
    does: str
    takes: type[Struct]
    gives: type[Struct]
    run: Callable[[Desk, Any, McpCaller], Awaitable[Said]]
    writes: bool = False


async def in_thread(function: Callable[[], T]) -> T:
    """Return what a function that blocks returns; giving up does not wait for it."""
    return await anyio.to_thread.run_sync(function, abandon_on_cancel=True)


# -- what there is ------------------------------------------------------------------------------------------------------
async def _list_agents(desk: Desk, _: r.Nothing, caller: McpCaller) -> Said:
    del caller
    ground = await desk.ground()
    engine, now = await in_thread(partial(live.agents_now, desk.connect))
    told = catalogue.agents(ground, engine, now)
    lines = [_agent(one) for one in told.agents]
    text = "\n".join(
        [f"{told.site}, mode {told.mode}; engine: {told.engine}", *lines, f"places: {', '.join(told.places)}"]
    )
    return told, fenced(text) if now else text


def _agent(one: r.ListedAgent) -> str:
    words = [f"{one.id}: {one.type}, {one.kind}", f"home {one.home}" if one.home else ""]
    if (now := one.now) is not None:
        words += [f"{now.battery:g} %" if now.battery is not None else ""]
        words += [where_words(now)]
        words += [now.pool, now.task, now.order, now.breach, now.quarantine, now.refused]
    words += ["not heard of" if one.here is False else ""]
    return ", ".join(word for word in words if word)


async def _list_actions(desk: Desk, asked: r.OfType, caller: McpCaller) -> Said:
    del caller
    ground = await desk.ground()
    types = ground.catalogue.types
    if asked.agent_type and asked.agent_type not in types:
        raise UnusableFile(f"there is no agent type '{asked.agent_type}'", help=f"types: {', '.join(types)}")
    told = catalogue.actions(ground.catalogue, asked.agent_type)
    lines = [
        f"{one.name}({', '.join(_field(f) for f in one.fields)}): {one.help} Of {', '.join(one.agent_types) or 'nobody'}."
        for one in told.actions
    ]
    return told, "\n".join(lines)


def _field(one: ParamFact) -> str:
    default = f" = {one.default}" if one.default else "" if one.required else " (optional)"
    return f"{one.name}: {one.type}{default}"


async def _list_tasks(desk: Desk, asked: r.TaskQuery, caller: McpCaller) -> Said:
    del caller
    ground = await desk.ground()
    told = await in_thread(partial(catalogue.tasks, ground, asked.find))
    lines = [f"{one.task}({', '.join(_field(p) for p in one.params)}): {one.description}" for one in told.tasks]
    return told, "\n".join(lines) or "no task has this in its name or description; list_tasks without `find` has all"


async def _language(desk: Desk, asked: r.Topic, caller: McpCaller) -> Said:
    del desk, caller
    text = pages.language(asked.topic)
    return r.PageOut(asked.topic or "the language in short", text, pages.topics()), text


async def _explain_code(desk: Desk, asked: r.Code, caller: McpCaller) -> Said:
    del desk, caller
    text = pages.code_page(asked.code)
    return r.PageOut(asked.code, text), text


async def _schema(desk: Desk, asked: r.Which, caller: McpCaller) -> Said:
    del caller
    ground = await desk.ground()
    if asked.form == "yaml":
        from formiga_bt.editor.schema import editor_schema

        schema = editor_schema(ground.catalogue, ground.site)
    else:
        from formiga_bt.editor.llm_schema import llm_schema

        schema = llm_schema(ground.catalogue)
    return r.SchemaOut(asked.form, schema), f"the JSON Schema of the {asked.form} form is in the structured content"


# -- what a task would do -----------------------------------------------------------------------------------------------
def _one_of(**given: str) -> None:
    named = [name for name, value in given.items() if value]
    if len(named) != 1:
        raise UnusableFile(f"give one of {', '.join(given)}; given: {', '.join(named) or 'none'}")
    if len(given.get("yaml", "").encode("utf-8", "surrogatepass")) > r.MAX_YAML:
        raise UnusableFile("the task is larger than 64 kB", help="loops and subtrees say the same with less")


async def _check(desk: Desk, asked: r.TaskText, caller: McpCaller) -> Said:
    del caller
    _one_of(yaml=asked.yaml)
    told = _must((await desk.crew.do(JudgeJob(kind="check", yaml=asked.yaml))).check)
    return told, told.rendered


async def _show(desk: Desk, asked: r.DrawQuery, caller: McpCaller) -> Said:
    del caller
    _one_of(yaml=asked.yaml, task=asked.task, id=asked.id)
    if asked.id:
        seen = await in_thread(partial(live.shown, desk.connect, asked.id))
        return seen, fenced(f"{seen.status}\n{seen.tree}")
    told = _must((await desk.crew.do(JudgeJob(kind="tree", yaml=asked.yaml, task=asked.task))).tree)
    return told, told.tree


async def _dry_run(desk: Desk, asked: r.Flown, caller: McpCaller) -> Said:
    told = await _fly(desk, asked, caller, asked.hours)
    return told, _in_words(told)


async def _fly(desk: Desk, asked: r.Flown | r.Proposed, caller: McpCaller, hours: float) -> r.FlightOut:
    _one_of(yaml=asked.yaml, task=asked.task)
    params: dict[str, Any] = dict(texts_of(asked.params))
    job = JudgeJob(kind="fly", yaml=asked.yaml, task=asked.task, params=params, answers=asked.answers, hours=hours)
    done: JobResult = await desk.crew.do(job, caller.progress)
    return _must(done.flight)


def _in_words(told: r.FlightOut) -> str:
    verdict = f"{told.task} {told.status} after {told.duration_s:g} s"
    if told.code or told.reason:
        verdict += f": {told.code} {told.reason}".rstrip()
    battery = ", ".join(f"{agent} {left:g} %" for agent, left in told.least_battery_percent.items())
    roles = ", ".join(f"{role}: {' '.join(ids)}" for role, ids in told.agents.items())
    broken = f"crashes: {told.crashes}, unsafe starts: {told.unsafe_starts}, low flights: {told.low_flights}"
    rows = [
        f"{one.start_s:7.1f} s  {one.agent}  {one.action} {one.where}  {one.state}".rstrip() for one in told.actions
    ]
    asked = [f"asks {one.who}: {one.text} ({', '.join(one.options)})" for one in told.questions]
    near = f", closest pass {told.closest_pass_m:g} m" if told.closest_pass_m is not None else ""
    parts = [verdict, f"agents: {roles}", f"least battery: {battery}" if battery else "", broken + near, told.why]
    return "\n".join(part for part in [*parts, *told.warnings, *asked, *rows, told.tree] if part)


FLOWN: Final = ("SUCCEEDED", "UNFINISHED")


async def _propose(desk: Desk, asked: r.Proposed, caller: McpCaller) -> Said:
    flight = await _fly(desk, asked, caller, 6.0)
    if flight.status not in FLOWN or flight.crashes or flight.unsafe_starts or flight.low_flights:
        raise FormigaError(
            f"not proposed, because its dry run went wrong:\n{_in_words(flight)}",
            help="mend the task, or give the `answers` of people with which it is meant to go well",
        )
    ground = await desk.ground()
    yaml = asked.yaml or ground.read(ground.file_of(asked.task))
    warnings, params = [*flight.warnings], texts_of(asked.params)
    if flight.status == "UNFINISHED":
        warnings.append("its dry run did not end within 6 h of virtual time")
    now = desk.wall_millis()
    asker = Asker(assistant(caller.client), desk.people)
    text = asker.marked(yaml) if asked.yaml else yaml
    draft, origin = draft_of(text, flight, params, asked.why, caller.client, warnings, now)
    folder = drafts_folder(Path(desk.where.site) if desk.where.site is not None else None, ground.site.name)

    def keep_it() -> KeptDraft:
        kept = propose(folder, draft, origin, needed(folder, ground, partial(live.running, desk.connect)))
        if asked.yaml:
            wrote(kept, yaml, ground, asker, now)
        return kept

    kept = await in_thread(keep_it)
    file = str(kept.folder / TASK)
    then = next_steps(kept, ground, params, is_there=bool(asked.task), asker=asker if asked.yaml else None)
    warnings += doubles(kept, ground) if asked.yaml else []
    told = r.ProposedOut(kept.number, flight.task, file, flight.status, then, warnings)
    text = f"{flight.task} waits as draft {kept.number} in {kept.folder}. It does not run. What a person does now:"
    return told, "\n".join([text, *(f"  {one}" for one in then), *warnings])


def _must(found: T | None) -> T:
    assert found is not None, "a job of this kind has such a result"
    return found


# -- what goes on -------------------------------------------------------------------------------------------------------
async def _now(desk: Desk, _: r.Nothing, caller: McpCaller) -> Said:
    del caller
    ground = await desk.ground()
    told = await in_thread(partial(live.now, desk.connect, ground.site.name, ground.site.mode))
    counts = ", ".join(f"{number} {status}" for status, number in told.counts.items()) or "no tasks"
    lines = [f"{told.site}: {counts}; in the air {told.airborne}, need a person {told.needs_a_person}"]
    lines += [f"LOCKDOWN {told.lockdown}"] if told.lockdown else []
    lines += [
        f"{t.id} {t.status}{' HELD' if t.held else ''} {', '.join(t.agents)} {t.doing or t.reason}".rstrip()
        for t in told.tasks
    ]
    lines += [
        f"{q.number} of {q.task} asks {', '.join(q.asked)}: {q.text} ({', '.join(q.options)})" for q in told.questions
    ]
    return told, fenced("\n".join(lines))


async def _explain(desk: Desk, asked: r.OfId, caller: McpCaller) -> Said:
    del caller
    told = await in_thread(partial(live.explained, desk.connect, asked.id))
    lines = [f"{'  ' * (one.depth + 1)}{one.text}{f' -> {one.hint}' if one.hint else ''}" for one in told.because]
    return told, fenced("\n".join([told.of, *lines]))


TOOLS: Final[tuple[Tool, ...]] = (
    Tool(
        "list_agents",
        "Machines and people",
        "List the machines and people of the site, its named places and regions. With a running engine also where each"
        " machine is, its battery, and what it does.",
        r.Nothing,
        r.ListedAgents,
        _list_agents,
    ),
    Tool(
        "list_actions",
        "Actions",
        "List the actions of the catalogue that a task may order: fields with types, units, defaults and bounds, which agent"
        " types have them, and how the machine must be (airborne, grounded).",
        r.OfType,
        r.ActionsOut,
        _list_actions,
    ),
    Tool(
        "list_tasks",
        "Tasks that are there",
        "List the tasks of the site and those that ship, with their parameters. Use one of these before you write a new one.",
        r.TaskQuery,
        r.OfferedTasks,
        _list_tasks,
    ),
    Tool(
        "language",
        "The language of tasks",
        "Read how tasks are written: in short with an example, or a page on one topic. Read it before you write a task.",
        r.Topic,
        r.PageOut,
        _language,
    ),
    Tool(
        "explain_code",
        "What a code means",
        "Read the page of a code of the checker (E030) or of a reason (no_clearance), with examples wrong and right.",
        r.Code,
        r.PageOut,
        _explain_code,
    ),
    Tool(
        "schema",
        "JSON Schema",
        "Get the JSON Schema of tasks with the live catalogue; about 60 to 80 kB. Only for constrained decoding or an editor.",
        r.Which,
        r.SchemaOut,
        _schema,
    ),
    Tool(
        "check_task",
        "Check a task",
        "Check a whole task file against the site and the catalogue. Returns all problems with line, column and how to mend"
        " them. ok means that it can be flown in a dry run, not that it does what was asked for.",
        r.TaskText,
        r.CheckOut,
        _check,
    ),
    Tool(
        "show_task",
        "Draw a task",
        "Draw a task as a tree of text: of a YAML text, of a task that is there, or with its id one that the engine runs,"
        " then with how each step stands.",
        r.DrawQuery,
        r.TreeOut,
        _show,
    ),
    Tool(
        "dry_run",
        "Fly a task in virtual time",
        "Run a task with the real engine on simulated agents of the site, in virtual time; nothing leaves the computer."
        " Returns how it ended and why, who did what when, questions to people, the least battery, crashes, and the tree.",
        r.Flown,
        r.FlightOut,
        _dry_run,
    ),
    Tool(
        "propose_task",
        "Propose a task to a person",
        "Put a task before a person. It is checked and flown in a dry run once more, and kept as a draft that waits. It does"
        " NOT run: only a person can approve and run it, with the command that is returned. Say in `why` what was asked for.",
        r.Proposed,
        r.ProposedOut,
        _propose,
        writes=True,
    ),
    Tool(
        "now",
        "The site now",
        "See the running site: tasks by urgency, who is in the air, questions that wait for a person, the last of the log."
        " You cannot answer questions or stop machines; tell the person.",
        r.Nothing,
        r.NowOut,
        _now,
    ),
    Tool(
        "explain",
        "Why a task or machine stands as it does",
        "Explain a task of the running engine (PickUp-12) or an agent (hwd_1): what it waits for, why it failed, who is in"
        " the way, and what a person can do.",
        r.OfId,
        r.ExplainOut,
        _explain,
    ),
)


def schema_of(kind: type[Struct]) -> dict[str, Any]:
    """Return the JSON Schema of what a tool takes or gives, with an object at its root."""
    schema = msgspec.json.schema(kind)
    defs = dict(schema["$defs"])
    root: dict[str, Any] = dict(defs.pop(kind.__name__))
    return {**root, "$defs": defs} if defs else root
