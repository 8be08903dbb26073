"""`formiga sim` without `--virtual`: the scenario's agents join a running engine, whose API takes the tasks."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import typer

from formiga_bt.cli.client import Client, connect, print_table, segment, show_next
from formiga_bt.errors import FormigaError
from formiga_bt.site_folder import find_engines

if TYPE_CHECKING:
    from agents_sim.referee import Verdict
    from formiga_bt.lang.scenario import Scenario, ScenarioOrder, ScenarioTask

OVER: Final = frozenset({"SUCCEEDED", "FAILED", "CANCELED"})
ASK_EVERY_S: Final = 0.5
EXIT_NO, EXIT_INTERRUPTED = 1, 130


def run(play: "Scenario", endpoint: str | None) -> int:
    """Play a scenario beside a running engine; return the exit code."""
    client = _client(endpoint)
    if client is not None and client.address.site != play.site.name:
        raise FormigaError(
            f"the engine here runs the site '{client.address.site}', the scenario is of '{play.site.name}'\n"
            "  help: start an engine of that site, or play it here with --virtual"
        )
    where = endpoint or (client.address.endpoint if client is not None else "")
    from formiga_bt.simulation import describe
    from formiga_bt.stage import Stage

    ids: list[str] = []

    def ask(entry: "ScenarioTask | ScenarioOrder") -> None:
        from formiga_bt.lang.scenario import ScenarioOrder

        if isinstance(entry, ScenarioOrder):
            typer.echo(f"order: {describe(entry)}{give(client, entry)}")
            return
        if client is None:
            typer.echo(f"{entry.task} is due: no API of this engine is known here, request it yourself")
            return
        body = {"task": entry.task, "params": dict(entry.texts), "priority": entry.priority, "requester": "scenario"}
        ids.append(client.post("/v1/tasks", body)["id"])
        typer.echo(f"{ids[-1]} requested")

    typer.echo(f"starting {len(play.agents)} agents, each a process of its own, beside the engine at {where}")
    try:
        with Stage(play, where, ask) as stage:
            stage.wait_ready(lambda agent: typer.echo(f"agent {agent} is there"))
            typer.echo(f"all are there; the engine's clock runs at {stage.speed:g}x")
            tasks: dict[str, dict[str, Any]] = {}
            next_look = 0.0
            while client is None or not stage.all_played or set(tasks) < set(ids) or not _are_over(tasks):
                for fault in stage.step():
                    typer.echo(f"fault: {describe(fault)}")
                if client is not None and time.monotonic() >= next_look:
                    next_look = time.monotonic() + ASK_EVERY_S
                    for task_id in ids:
                        tasks[task_id] = _looked_up(client, task_id, tasks.get(task_id))
            verdict = stage.verdict()
    except KeyboardInterrupt:
        typer.echo("Interrupted: the agents are gone; the engine goes on")
        return EXIT_INTERRUPTED
    return _close(tasks, verdict)


def give(client: Client | None, order: "ScenarioOrder") -> str:
    """Give an order to the engine; return what to add to it for people: why it was refused, or nothing."""
    if client is None:
        return " is due: no API of this engine is known here, give it yourself"
    try:
        target = _newest(client, order.target) if order.of == "task" else order.target
        where, body = _call(order, target)
        client.post(where, {**body, "by": order.by})
    except FormigaError as error:
        return f": refused, {' '.join(str(error).split())}"
    return ""


def _call(order: "ScenarioOrder", target: str) -> tuple[str, dict[str, Any]]:
    """Return the path and the body of an order."""
    match order.order:
        case "lockdown":
            return "/v1/lockdown", {"how": order.how}
        case "abort":
            return f"/v1/tasks/{segment(target)}/abort", {"how": order.how, "confirmed": order.how == "abandon"}
        case "handback":
            return f"/v1/agents/{segment(target)}/handback", {"how": order.how}
        case "clear":
            return f"/v1/agents/{segment(target)}/clear", {}
        case word:
            where = {"agent": f"/v1/agents/{segment(target)}/orders", "task": f"/v1/tasks/{segment(target)}/orders"}
            confirmed = {"confirmed": target} if word == "cut" else {}
            return where.get(order.of, "/v1/orders"), {"order": word, **confirmed}


def _newest(client: Client, name: str) -> str:
    newest_first = [task for task in client.get("/v1/tasks", status="open")["tasks"] if task["task"] == name]
    if not newest_first:
        raise FormigaError(f"no task '{name}' is open")
    return str(newest_first[0]["id"])


def _client(endpoint: str | None) -> Client | None:
    if endpoint is None:
        return connect()
    found = [address for address in find_engines(Path.cwd()) if address.endpoint == endpoint]
    return Client(found[0]) if found else None


def _looked_up(client: Client, task_id: str, before: dict[str, Any] | None) -> dict[str, Any]:
    """Return the task as it is now, telling a change of its status."""
    task: dict[str, Any] = client.get(f"/v1/tasks/{segment(task_id)}")
    if before is None or before["status"] != task["status"]:
        typer.echo(f"{task_id} {_outcome(task)}")
    return task


def _outcome(task: dict[str, Any]) -> str:
    return f"{task['status']}: {task['code']} {task['reason']}".strip() if task["code"] else str(task["status"])


def _are_over(tasks: dict[str, dict[str, Any]]) -> bool:
    return all(task["status"] in OVER for task in tasks.values())


def _close(tasks: dict[str, dict[str, Any]], verdict: "Verdict") -> int:
    rows: list[tuple[str, ...]] = [("task", "agents", "actions", "duration", "outcome")]
    for task_id, task in tasks.items():
        done = len([action for action in task["actions"] if action["state"] == "succeeded"])
        rows.append((task_id, ", ".join(task["agents"]), str(done), f"{task['duration_s']:.0f} s", _outcome(task)))
    print_table(rows)
    near = verdict.closest_pass
    found = f"crashes: {len(verdict.crashes)}, starts near people without clearance: {len(verdict.unsafe_starts)}"
    found += f", low flights: {len(verdict.low_flights)}"
    typer.echo(found + ("" if near is None else f", closest pass: {near.distance_m:.0f} m ({near.a}, {near.b})"))
    show_next("formiga tasks", *(f"formiga why {task}" for task, one in tasks.items() if one["status"] == "FAILED"))
    good = verdict.is_clean and all(task["status"] == "SUCCEEDED" for task in tasks.values())
    return 0 if good else EXIT_NO
