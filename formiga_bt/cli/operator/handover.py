"""`formiga handover`: what the next shift must know, on one page."""

import time
from collections.abc import Iterator
from datetime import datetime

import typer
from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.cli.options import JsonOption, SiteOption, TokenFileOption, UrlOption, tell_clock
from formiga_bt.cli.printing import print_json
from formiga_bt.client import Client, connect
from formiga_bt.show.facts import (
    AgentFact,
    AlarmFact,
    LockdownFact,
    OrderFact,
    PilotFact,
    PilotList,
    QuestionFact,
    TaskFact,
)
from formiga_bt.show.listed import where_words
from formiga_bt.show.why.words import span


class MachineOut(Struct, frozen=True):
    """A machine that is not ready at its place, and why."""

    agent: str
    why: str
    where: str


class Handover(Struct, frozen=True, kw_only=True):
    """What the next shift must know."""

    site: str
    mode: str
    wall_unix_millis: int
    at: Micros
    """Engine time; so are all other instants."""
    epoch: int
    status: str
    causes: tuple[str, ...]
    """What is wrong with the engine, as codes."""
    lockdown: LockdownFact
    on_duty: tuple[PilotFact, ...]
    runs: tuple[TaskFact, ...]
    waits: tuple[TaskFact, ...]
    """For agents."""
    held: tuple[TaskFact, ...]
    """For a person, or for the end of a stop."""
    questions: tuple[QuestionFact, ...]
    alarms: tuple[AlarmFact, ...]
    orders: tuple[OrderFact, ...]
    machines_out: tuple[MachineOut, ...]


def command(
    as_json: JsonOption = False,
    site: SiteOption = None,
    url: UrlOption = "",
    token_file: TokenFileOption = None,
) -> None:
    """Print what the next shift must know: what runs, what waits, open questions, alarms, who is on duty, machines out.

    It names people: give it to the next shift only.
    """
    client = connect(site, url, token_file)
    tell_clock(client)
    note = handover(client)
    if as_json:
        print_json(note)
        return
    typer.echo("\n".join(in_words(note)))


def handover(client: Client) -> Handover:
    """Return the note of an engine, as it is now."""
    health, agents, questions = client.health(), client.agents(), client.questions()
    tasks = client.tasks("open", 10_000).tasks
    pilots = client.get(PilotList, "/v1/pilots").pilots
    return Handover(
        site=health.site, mode=health.mode, wall_unix_millis=time.time_ns() // 1_000_000, at=health.at, epoch=health.epoch,
        status=health.status, causes=health.causes, lockdown=agents.lockdown,
        on_duty=tuple(one for one in pilots if one.since is not None),
        runs=tuple(one for one in tasks if not one.held and one.status != "PENDING"),
        waits=tuple(one for one in tasks if not one.held and one.status == "PENDING"),
        held=tuple(one for one in tasks if one.held),
        questions=questions.questions, alarms=client.alarms().alarms, orders=agents.orders,
        machines_out=tuple(MachineOut(one.id, why, where_words(one)) for one in agents.agents if (why := _why_out(one))),
    )  # fmt: skip


def _why_out(agent: AgentFact) -> str:
    """Return why a machine is not ready at its place, in words; empty: it is, or it is a person."""
    if agent.mobility == "people":
        return ""
    told = {
        f"refused: {agent.refused}": agent.refused,
        f"quarantined: {agent.quarantine}": agent.quarantine,
        f"out of service: {agent.out}": agent.out,
        "not heard of": agent.liveness != "ALIVE",
        f"under the control of {agent.control}": agent.control not in ("", "engine"),
        f"breaches {agent.breach}": agent.breach,
        f"was started anew: formiga agents clear {agent.id}": agent.rebooted,
        "parked away from its place": agent.pool == "PARKED_AWAY",
        f"works for {agent.task}": agent.task,
        "in the air": agent.landed == "airborne",
        "away from its place": bool(agent.home) and agent.port != agent.home and agent.landed != "airborne",
    }
    return "; ".join(text for text, stands in told.items() if stands)


def in_words(note: Handover) -> Iterator[str]:
    """Return the note as people read it, line by line."""
    when = datetime.fromtimestamp(note.wall_unix_millis / 1000).astimezone()
    wrong = f": {', '.join(note.causes)}" if note.causes else ""
    yield f"Handover of {note.site} ({note.mode}), {when:%Y-%m-%d %H:%M %Z}; engine {note.status}{wrong}, start {note.epoch}"
    if note.lockdown.on:
        yield note.lockdown.text

    def since(instant: Micros) -> str:
        return span(max(0, note.at - instant))

    def task(one: TaskFact) -> str:
        who = f" by {', '.join(one.agents)}" if one.agents else ""
        doing = f": {one.doing}" if one.doing else ""
        asked = f"requested by {one.by or 'nobody named'} {since(one.submitted_at)} ago"
        return f"{one.id} ({one.priority}) {one.status}{who}{doing}; {asked}"

    def pilot(one: PilotFact) -> str:
        return f"{one.pilot} since {since(one.since or 0)}, has {', '.join(one.machines) or 'no machine'}"

    parts = {
        "ON DUTY": [pilot(one) for one in note.on_duty],
        "RUNS": [task(one) for one in note.runs],
        "WAITS FOR AGENTS": [task(one) for one in note.waits],
        "HELD": [f"{task(one)}; held: {', '.join(one.held)}; formiga why {one.id}" for one in note.held],
        "OPEN QUESTIONS": [
            f"{one.number} {one.text} ({', '.join(one.options)}), asked of {', '.join(one.asked) or 'nobody'} for {one.task} "
            f"since {since(one.asked_at)}"
            for one in note.questions
        ],
        "ALARMS": [
            f"{one.id} {one.severity}, {one.state}{f' by {one.owner}' if one.owner else ''}: {one.text} ({one.code}), "
            f"since {since(one.raised_at)}"
            for one in note.alarms
        ],
        "ORDERS": [f"{one.agent}: {one.note}" for one in note.orders],
        "MACHINES OUT": [
            f"{one.agent}: {one.why}{f'   {one.where}' if one.where else ''}" for one in note.machines_out
        ],
    }
    for title, lines in parts.items():
        yield f"\n{title}" + ("" if lines else "   none")
        yield from (f"  {line}" for line in lines)
