"""`formiga sim`: a simulated fleet of its own, or a scenario: in virtual time here, or as processes beside a running engine.

Without a scenario the agents of the site are started as processes that live on while no engine is there (`sim_fleet`). With
`--virtual` a whole scenario is over in a moment: agents, engine and wire are in this process. Else its agents are processes
that join the engine at `--connect`, whose API takes the scenario's tasks (`sim_live`).
"""

import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.integrator.scenarios import note_of_clock, read_scenario

if TYPE_CHECKING:
    from formiga_bt.lang.scenario import Scenario
    from formiga_bt.rehearsal.simulation import VirtualRun
    from formiga_bt.show.history.runlog import RunLog

EXIT_NO = 1


def command(
    scenario: Annotated[
        str,
        typer.Argument(
            help="A scenario file, or one that ships with formiga, for example demo. Default: the agents of the site.",
            metavar="SCENARIO",
        ),
    ] = "",
    virtual: Annotated[bool, typer.Option("--virtual", help="In this process, on the virtual clock.")] = False,
    connect: Annotated[
        str | None,
        typer.Option(
            help="Where the engine listens. Default: the engine of this folder, or what the site file says.",
            metavar="ENDPOINT",
        ),
    ] = None,
    site: Annotated[
        Path | None,
        typer.Option(
            help="Without a scenario: the site file, or `demo`. Default: site.yaml of this folder.", metavar="FILE"
        ),
    ] = None,
    without: Annotated[
        list[str] | None,
        typer.Option(
            help="Without a scenario: an agent that is not simulated, such as a --desk person; may be repeated.",
            metavar="AGENT",
        ),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            help="With --virtual: engine seconds per wall second, to watch it. Default: as fast as it goes.",
            metavar="X",
            min=0.1,
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Instead of the scenario's own.", min=0)] = None,
    actions: ActionsOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")] = False,
) -> None:
    """Start the site's agents, simulated, each a process of its own; or play a scenario: agents, tasks, and what goes wrong.

    The site's agents live on when the engine ends or is killed, as real ones do, and connect to the next one; Ctrl-C ends them.

    Of a scenario, exit code 0: every task succeeded and nothing crashed. 1: not so, or the scenario has errors. 2: the
    command line cannot be used.
    """
    if not scenario:
        _only_scenarios(virtual=virtual, speed=speed, seed=seed, as_json=as_json)
        from formiga_bt.cli.integrator.sim_fleet import run as run_fleet

        run_fleet(site or Path("site.yaml"), actions or [], connect, without or [])
        return
    if site is not None or without:
        raise UnusableFile("--site and --without are for the agents of a site; a scenario names its own")
    play = read_scenario(scenario, actions or ())
    if not virtual:
        note_of_clock(play)
        from formiga_bt.cli.integrator.sim_live import run

        raise typer.Exit(run(play, connect))
    from formiga_bt.rehearsal.simulation import VirtualRun

    world = VirtualRun(play, seed=seed, pace=_pace(speed) if speed is not None else None)
    in_time = world.run()
    report = _report(play, world, in_time)
    world.close()
    typer.echo(json.dumps(report, indent=2) if as_json else _text(report))
    good = in_time and not report["refused"] and not report["crashes"]
    if not good or any(task["status"] != "SUCCEEDED" for task in report["tasks"]):
        raise typer.Exit(EXIT_NO)


def _only_scenarios(**options: Any) -> None:
    """Refuse options that mean something for scenarios only."""
    for name, value in options.items():
        if value not in (None, False):
            word = name.removeprefix("as_")
            raise UnusableFile(f"--{word} is for scenarios: name one, for example formiga sim demo --{word}")


def _pace(speed: float) -> Any:
    """Return a function that waits, at each instant of engine time, until the wall clock is there too."""
    zero: list[tuple[float, int]] = []

    def wait(now_us: int) -> None:
        if not zero:
            zero.append((time.monotonic(), now_us))
        began, first = zero[0]
        time.sleep(max(0.0, began + (now_us - first) / 1e6 / speed - time.monotonic()))

    return wait


def _report(play: "Scenario", world: "VirtualRun", in_time: bool) -> dict[str, Any]:
    from formiga_bt.rehearsal.simulation import describe
    from formiga_bt.show.history.runlog import RunLog

    log = RunLog()
    for step in world.steps:
        log.feed(step)
    zero = world.began
    verdict = world.verdict()
    near = verdict.closest_pass

    def since(at: int) -> float:
        return round((at - zero) / 1e6, 1)

    return {
        "scenario": play.name,
        "in_time": in_time,
        "tasks": _tasks(log),
        "refused": [{"task": task, "reason": reason} for task, reason in world.played.refused],
        "actions": [
            {
                "start_s": since(row.start),
                "end_s": None if row.end is None else since(row.end),
                "task": row.task,
                "agent": row.agent,
                "action": row.action,
                "state": row.outcome,
            }
            for row in log.actions
        ],
        "faults": [{"at_s": since(at), "fault": describe(fault)} for at, fault in world.played.faults],
        "orders": [
            {"at_s": since(at), "order": describe(order), "refused": why} for at, order, why in world.played.orders
        ],
        "happened": [
            {"at_s": since(row.at), "who": row.who, "what": row.what, "engine": row.did, "ended": row.ended}
            for row in log.happened.rows
        ],
        "log": [{"at_s": since(line.at), "text": line.text} for line in log.lines],
        "least_battery": {agent: round(left, 1) for agent, left in sorted(log.least_battery.items())},
        "crashes": len(verdict.crashes),
        "unsafe_starts": len(verdict.unsafe_starts),
        "low_flights": len(verdict.low_flights),
        "closest_pass_m": None if near is None else round(near.distance_m, 1),
    }


def _tasks(log: "RunLog") -> list[dict[str, Any]]:
    return [
        {
            "task": task.id,
            "status": task.status,
            "code": task.outcome.code,
            "reason": task.outcome.reason,
            "agents": list(task.agents.granted),
            "actions": len([row for row in log.rows_of([task.id]) if row.state in ("succeeded", "answered")]),
            "duration_s": round(((task.times.ended_at or log.state.now) - task.times.submitted_at) / 1e6, 1),
        }
        for task in sorted(log.state.tasks.values(), key=lambda task: task.order)
    ]


def _text(report: dict[str, Any]) -> str:
    actions = [("start", "end", "task", "agent", "action", "")]
    for row in report["actions"]:
        end = "" if row["end_s"] is None else f"{row['end_s']:.1f} s"
        actions.append((f"{row['start_s']:.1f} s", end, row["task"], row["agent"], row["action"], row["state"]))
    events = [(line["at_s"], line["text"]) for line in report["log"]]
    events += [(fault["at_s"], f"fault: {fault['fault']}") for fault in report["faults"]]
    for order in report["orders"]:
        events.append(
            (order["at_s"], f"order: {order['order']}" + (f": refused, {order['refused']}" if order["refused"] else ""))
        )
    tasks = [("task", "agents", "actions", "duration", "outcome")]
    for task in report["tasks"]:
        why = f": {task['code']} {task['reason']}".rstrip() if task["code"] else ""
        agents = ", ".join(task["agents"])
        tasks.append((task["task"], agents, str(task["actions"]), f"{task['duration_s']:g} s", task["status"] + why))
    happened = [("what happened at", "who", "what", "the engine", "how it ended")]
    for row in report["happened"]:
        happened.append((f"{row['at_s']:.1f} s", row["who"], row["what"], row["engine"], row["ended"] or "it lasts"))
    near = report["closest_pass_m"]
    found = f"crashes: {report['crashes']}, starts near people without clearance: {report['unsafe_starts']}"
    found += f", low flights: {report['low_flights']}" + ("" if near is None else f", closest pass: {near:g} m")
    return "\n".join(
        [
            *_columns(actions, right=2),
            "",
            *(f"{at:8.1f} s  {text}" for at, text in sorted(events, key=lambda event: event[0])),
            "",
            *_columns(tasks),
            *(f"{one['task']} was refused: {one['reason']}" for one in report["refused"]),
            "",
            *([*_columns(happened), ""] if report["happened"] else []),
            found + ("" if report["in_time"] else "; not all had ended in time"),
        ]
    )


def _columns(rows: Sequence[tuple[str, ...]], right: int = 0) -> list[str]:
    """Return rows as lines of aligned columns, the first `right` of them to the right."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "  ".join(
            cell.rjust(width) if i < right else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
