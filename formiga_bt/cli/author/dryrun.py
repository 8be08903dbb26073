"""`formiga dryrun`: run one task on the virtual clock, with the production engine and simulated agents.

What it tells: each action with agent, start and end, the least battery, closest pass, crashes, and how the task ended. Nothing
leaves this process.
"""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import FormigaError, TreeError
from formiga_bt.base.packaged import folder
from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.author.flown import check_pictures, draw_steps
from formiga_bt.cli.inputs import CheckWorld, UnusableFile, read_task, read_world, shipped_task
from formiga_bt.cli.params import ParamsFromOption, ProfileOption, of_profile, read_params, value_files
from formiga_bt.rehearsal.spending import MOST_S, MOST_WAKES, RunSpending

if TYPE_CHECKING:
    from collections.abc import Sequence

    from agents_sim.referee import Verdict as Findings
    from formiga_bt.base.clock import Micros
    from formiga_bt.engine.kernel.records import Verdict
    from formiga_bt.lang.model import Catalogue, Site, Task
    from formiga_bt.lang.request.value_files import ValueFile
    from formiga_bt.rehearsal.rehearsal import Rehearsal
    from formiga_bt.show.facts import Because
    from formiga_bt.show.history.runlog import RunLog

MostSteps = Annotated[
    int, typer.Option(help="Give up after so many steps by the clocks of tasks (waits, rounds).", metavar="N", min=1)
]
MostSeconds = Annotated[
    float, typer.Option(help="Give up after so many seconds of this computer.", metavar="S", min=0.1)
]
RULES = ("unsafe_starts", "low_flights")
"""What the referee counts besides crashes."""


def command(
    file: Annotated[Path, typer.Argument(help="Task file, or the name of a task that ships.", metavar="FILE")],
    param: Annotated[
        list[str] | None, typer.Option("--param", "-p", help="A parameter; may be repeated.", metavar="NAME=VALUE")
    ] = None,
    params_from: ParamsFromOption = None,
    site: Annotated[
        Path | None,
        typer.Option(
            help="Site file. Default: site.yaml of this folder, else the demo site that ships with formiga.",
            metavar="FILE",
        ),
    ] = None,
    actions: ActionsOption = None,
    answer: Annotated[
        list[str] | None,
        typer.Option(
            help="What a person answers, one after another, for example picker_1=not_yet,loaded.", metavar="WHO=A,B"
        ),
    ] = None,
    field: Annotated[
        list[str] | None,
        typer.Option(
            "--field",
            "-f",
            help="What people fill in a form, by the name of its field; may be repeated.",
            metavar="NAME=VALUE",
        ),
    ] = None,
    profile: ProfileOption = "",
    limit: Annotated[
        float, typer.Option(help="Give up after so many hours of virtual time.", metavar="HOURS", min=0.01)
    ] = 6.0,
    most_steps: MostSteps = MOST_WAKES,
    most_seconds: MostSeconds = MOST_S,
    gantt: Annotated[
        Path | None,
        typer.Option(
            help="Draw its actions over time: .svg, .png, .html or .txt; - is the terminal.",
            metavar="OUT",
            allow_dash=True,
        ),
    ] = None,
    map_: Annotated[
        Path | None, typer.Option("--map", help="Draw where its agents went, likewise.", metavar="OUT", allow_dash=True)
    ] = None,
    at: Annotated[
        str,
        typer.Option(
            help="When it is requested, in the site's time zone: 14:00, or 2026-06-21T14:00.",
            metavar="TIME",
            show_default=False,
        ),
    ] = "",
    why: Annotated[
        bool, typer.Option("--why", help="Explain its end: why these agents, what failed first, what was tried.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")] = False,
) -> None:
    """Run a task against simulated agents in virtual time.

    Exit code 0: it succeeded without a crash. 1: it did not, or the task has errors. 2: the command line cannot be used.
    """
    check_pictures(gantt, map_, as_json=as_json)
    here = Path("site.yaml")
    world = read_world(actions or (), site or (here if here.is_file() else folder("trees") / "demo-site.yaml"))
    task, the_site = _checked(shipped_task(file), world)
    from formiga_bt.lang.request.value_files import given_in

    given, files = read_params(param or []), value_files(params_from or [])
    filled = of_profile(profile, task, [*given, *given_in(files)])
    now = _instant(at, the_site)
    values = _bound(
        task, given | filled, files, the_site, now, f"; {profile} said {', '.join(filled)}" if filled else ""
    )
    from formiga_bt.lang.request.requested import with_requested
    from formiga_bt.lang.scenario.entries import START
    from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of, patience, simulated
    from formiga_bt.show.history.runlog import RunLog

    answers = _answers(pairs(answer or []), the_site, world.catalogue)
    filled = _filled(read_params(field or []), task, the_site, now)
    rules = {who: [{"match": "*", "options": said}] for who, said in answers.items()}
    people = _people(the_site, world.catalogue) if filled else tuple(rules)
    scripts = {who: [*rules.get(who, ()), {"match": "*", "form": filled}] if filled else rules[who] for who in people}
    specs = fleet_of(the_site, world.catalogue, scripts=scripts)
    tasks = with_requested(task, lambda path: _checked(path, world)[0], the_site)
    rehearsal = Rehearsal(simulated(the_site), world.catalogue, tasks, specs, start=now - SECOND if at else START)
    spending = RunSpending(most_steps, most_seconds)
    rehearsal.driver.listeners.append(spending.feed)
    rehearsal.run_for(1.0)
    task_id = rehearsal.submit(task.name, values, wait=patience(task))
    rehearsal.run_until(lambda: spending.is_over or rehearsal.ended(task_id), limit_s=limit * 3600.0)
    in_time = rehearsal.ended(task_id)
    log = RunLog()
    for step in rehearsal.steps:
        log.feed(step)
    report = _report(rehearsal, log, task_id, answers)
    if not in_time:
        reason, lasted_s = spending.reason({one.name: one for one in tasks}), limit * 3600.0
        if reason:
            lasted_s = round((rehearsal.now - rehearsal.task(task_id).times.submitted_at) / 1e6, 1)
        reason = reason or f"given up after {limit:g} h"
        report |= {"status": "UNFINISHED", "reason": reason, "duration_s": lasted_s}
    told = _explained(rehearsal, log, tasks, task_id) if why else ("", [])
    if why and as_json:
        from msgspec import to_builtins

        report["because"] = to_builtins(told[1])
    typer.echo(json.dumps(report, indent=2) if as_json else _text(report))
    if why and not as_json:
        from formiga_bt.show.why.text import in_words

        typer.echo("\n" + in_words(*told))
    rehearsal.close()
    if gantt is not None or map_ is not None:
        draw_steps(rehearsal.steps, the_site, world.catalogue, tasks, gantt, map_)
    if report["status"] != "SUCCEEDED" or any(report[name] for name in ("crashes", *RULES, "never_offered")):
        raise typer.Exit(1)


def _explained(rehearsal: "Rehearsal", log: "RunLog", tasks: "list[Task]", task_id: str) -> "tuple[str, list[Because]]":
    """Return why the task ended as it did, or what it waits for at the end of the time."""
    from formiga_bt.show.why.front import explain

    core = rehearsal.engine.core
    actions = [row.fact() for row in log.rows_of([task_id])]
    models = {task.name: task for task in tasks}
    now = rehearsal.now
    return explain(log.state, models, task_id, now, catalogue=core.catalogue, wall=now, actions=actions)


def pairs(texts: list[str]) -> dict[str, str]:
    """Return `name=value` words as a mapping.

    Raises:
        UnusableFile: a word has no `=`, or a name comes twice.
    """
    found: dict[str, str] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name:
            raise UnusableFile(f"'{text}' is not NAME=VALUE")
        if name.strip() in found:
            raise UnusableFile(f"'{name.strip()}' is given twice")
        found[name.strip()] = value
    return found


def _answers(raw: dict[str, str], site: "Site", catalogue: "Catalogue") -> dict[str, list[str]]:
    """Return each person's answers in order.

    Raises:
        UnusableFile: there is no such person, or nothing is answered.
    """
    people = _people(site, catalogue)
    found = {}
    for who, text in raw.items():
        if who not in people:
            raise UnusableFile(f"--answer: the site has no person '{who}'; people: {', '.join(people) or 'none'}")
        found[who] = [word.strip() for word in text.split(",")]
        if not all(found[who]):
            raise UnusableFile(f"--answer: '{who}={text}' lacks an answer; write for example {who}=not_yet,loaded")
    return found


def _people(site: "Site", catalogue: "Catalogue") -> tuple[str, ...]:
    types = catalogue.types
    return tuple(a.id for a in site.agents.values() if a.type in types and types[a.type].human)


def _filled(given: dict[str, str], task: "Task", site: "Site", now: "Micros") -> dict[str, Any]:
    """Return what people fill in, by field, as wire values; each is of the type that the task's forms give it.

    Raises:
        UnusableFile: no form of the task has such a field, or its value does not fit.
    """
    if not given:
        return {}
    from formiga_bt.base.diagnostics import render
    from formiga_bt.lang.model import Ask
    from formiga_bt.lang.request.binding import bind_fields
    from formiga_bt.lang.walk import all_steps
    from formiga_bt.transport.messages import to_wire

    fields = {one.name: one for step in all_steps(task) if isinstance(step, Ask) for one in step.form}
    types = {name: one.kind for name, one in fields.items() if name in given}
    values, problems, sources = bind_fields(
        "--field", types or {n: one.kind for n, one in fields.items()}, given, site, now
    )
    faults = [fault for name, value in values.items() if (fault := fields[name].fault(value))]
    if problems or faults:
        raise UnusableFile("\n".join([render(one, sources) for one in problems] or faults))
    return {name: to_wire(value) for name, value in values.items()}


def _never_offered(rehearsal: "Rehearsal", answers: dict[str, list[str]]) -> list[str]:
    """Return the answers that were no option of any question put to that person."""
    from formiga_bt.engine.kernel.inputs import SendGoal

    offered: dict[str, set[str]] = {who: set() for who in answers}
    for effect in (effect for step in rehearsal.steps for effect in step.effects):
        if isinstance(effect, SendGoal) and effect.agent in offered:
            offered[effect.agent].update(effect.fields.get("options", ()))
    return [f"{who}={word}" for who, words in answers.items() for word in words if word not in offered[who]]


def _refusals(verdicts: "Sequence[Verdict]") -> list[str]:
    """Return why agents were refused, for the roles that nobody could serve."""
    served = {v.role for v in verdicts if v.code in ("chosen", "fits")}
    open_roles = [v for v in verdicts if v.role not in served]
    telling = [v for v in open_roles if v.code != "wrong_type"]
    return [f"{v.role}: {v.agent} {v.code} {v.detail}".rstrip() for v in telling or open_roles]


def _checked(file: Path, world: CheckWorld) -> "tuple[Task, Site]":
    if world.site is None:
        raise TreeError("the site file has errors", world.diagnostics)
    read = read_task(file, world)
    if read.task is None:
        raise TreeError(f"{file} is not a task that can run; `formiga check {file}` shows why", read.diagnostics)
    return read.task, world.site


def _instant(text: str, site: "Site") -> "Micros":
    """Return the engine time that `--at` names; without it, that at which every rehearsal begins.

    Raises:
        UnusableFile: it is no time.
    """
    from formiga_bt.lang.request.binding import bind_fields
    from formiga_bt.lang.scenario.entries import START
    from formiga_bt.lang.types import TIME

    if not text:
        return START
    values, problems, _ = bind_fields("--at", {"at": TIME}, {"at": text}, site, START)
    if problems:
        raise UnusableFile(f"--at: {problems[0].message}", help="such as: --at 14:00, or --at 2026-06-21T14:00")
    at: Micros = values["at"]
    return at


def _bound(
    task: "Task", raw: dict[str, str], files: "Sequence[ValueFile]", site: "Site", now: "Micros", note: str = ""
) -> dict[str, Any]:
    from formiga_bt.base.diagnostics import render
    from formiga_bt.lang.request.binding import bind_params

    values, problems, sources = bind_params(task, raw, site, now, files)
    if problems:
        texts = [render(problem, sources) for problem in problems]
        raise FormigaError("\n\n".join([*texts, f"{task.name} was not started{note}"]))
    return values


def _report(rehearsal: "Rehearsal", log: "RunLog", task_id: str, answers: dict[str, list[str]]) -> dict[str, Any]:
    task = log.state.tasks[task_id]
    verdict: Findings = rehearsal.referee.verdict(rehearsal.now)
    zero = task.times.submitted_at
    return {
        "task": task_id,
        "status": task.status,
        "code": task.outcome.code,
        "reason": task.outcome.reason,
        "cleanup": list(task.outcome.notes),
        "duration_s": round(((task.times.ended_at or rehearsal.now) - zero) / 1e6, 1),
        "actions": [
            {
                "agent": row.agent,
                "action": row.action,
                "start_s": round((row.start - zero) / 1e6, 1),
                "end_s": None if row.end is None else round((row.end - zero) / 1e6, 1),
                "state": row.outcome,
                "where": row.detail,
            }
            for row in log.actions
        ],
        "log": [{"at_s": round((line.at - zero) / 1e6, 1), "text": line.text} for line in log.lines],
        "least_battery": {
            agent: round(log.least_battery[agent], 1) for agent in task.agents.granted if agent in log.least_battery
        },
        "crashes": len(verdict.crashes),
        "unsafe_starts": len(verdict.unsafe_starts),
        "low_flights": len(verdict.low_flights),
        "closest_pass_m": round(verdict.closest_pass.distance_m, 1) if verdict.closest_pass else None,
        "refused": _refusals(log.state.explanations.get(task_id, ())) if task.outcome.code == "no_agent" else [],
        "never_offered": _never_offered(rehearsal, answers),
    }


def _text(report: dict[str, Any]) -> str:
    notes = [f"{line['at_s']:8.1f} s  {line['text']}" for line in report["log"]]
    battery = ", ".join(f"{agent} {left:g} %" for agent, left in report["least_battery"].items())
    near = report["closest_pass_m"]
    verdict = f"{report['task']} {report['status']} after {report['duration_s']:g} s"
    if report["code"] or report["reason"]:
        verdict += f": {report['code']} {report['reason']}".replace("  ", " ").rstrip()
    flew = [
        f"least battery: {battery}",
        ", ".join(
            [
                *(
                    f"{name.replace('_', ' ')}: {report[name]}"
                    for name in ("crashes", *RULES)
                    if report[name] or name == "crashes"
                ),
                *([f"closest pass {near:g} m"] if near is not None else []),
            ]
        ),
    ]
    closing = [
        verdict,
        *(f"  while it cleaned up: {note}" for note in report["cleanup"]),
        *(flew if battery else []),
        *(f"  not granted: {line}" for line in report["refused"]),
        *(f"not used: no question offered {said}" for said in report["never_offered"]),
    ]
    return "\n".join([*_table(report["actions"]), *notes, "", *closing])


def _table(actions: list[dict[str, Any]]) -> list[str]:
    if not actions:
        return []
    rows = [("start", "end", "agent", "action", "")]
    for action in actions:
        end = "" if action["end_s"] is None else f"{action['end_s']:.1f} s"
        rows.append(
            (
                f"{action['start_s']:.1f} s",
                end,
                action["agent"],
                f"{action['action']} {action['where']}".rstrip(),
                action["state"],
            )
        )
    w = [max(len(row[i]) for row in rows) for i in range(5)]
    lines = (f"{r[0]:>{w[0]}}  {r[1]:>{w[1]}}  {r[2]:<{w[2]}}  {r[3]:<{w[3]}}  {r[4]}".rstrip() for r in rows)
    return [*lines, ""]
