"""What a running engine tells an assistant: the site now, a task, and why something stands as it does.

Blocks while it asks: called in threads. Everything that comes from an engine goes through `outside`.
"""

from collections.abc import Callable

from formiga_bt.base.errors import FormigaError
from formiga_bt.llm.mcp.outside import NOTICE, all_cleaned, cleaned
from formiga_bt.llm.mcp.records import ExplainOut, NowOut, TreeOut
from formiga_bt.show.facts import AgentFact
from formiga_bt.show.source import Source

Connect = Callable[[], Source]
"""Finds the engine of the site, or raises NoEngine."""

ENDED = ("SUCCEEDED", "FAILED", "CANCELED")
MOST_TASKS = 50
MOST_QUESTIONS = 50
MOST_CAUSES = 100
WIDTH = 120


def agents_now(connect: Connect) -> tuple[str, dict[str, AgentFact]]:
    """Return `running` and the agents by id, or why there is no engine to ask, and none."""
    try:
        found = connect().now(count=1)
    except FormigaError as error:
        return cleaned(error.text), {}
    return "running", {agent.id: agent for agent in found.agents}


def running(connect: Connect) -> set[str]:
    """Return the names of the tasks that have not ended; none, if no engine runs."""
    try:
        found = connect().now(count=1000)
    except FormigaError:
        return set()
    return {task.name for task in found.tasks if task.status not in ENDED}


def now(connect: Connect, site: str, mode: str) -> NowOut:
    """Return the site at this moment, the most urgent tasks first.

    Raises:
        FormigaError: no engine runs; the text says how to start one.
    """
    found = connect().now(count=MOST_TASKS)
    return all_cleaned(
        NowOut(
            site=found.site or site,
            mode=found.mode or mode,
            engine=found.engine,
            airborne=found.top.airborne,
            needs_a_person=found.top.needs_you,
            lockdown=found.top.lockdown,
            counts=found.counts,
            at=found.at,
            tasks=list(found.tasks),
            more_tasks=max(0, found.total - len(found.tasks)),
            questions=list(found.questions[:MOST_QUESTIONS]),
            log=[line.text for line in found.lines[-20:]],
            notice=NOTICE,
        )
    )


def explained(connect: Connect, of: str) -> ExplainOut:
    """Return why a task or an agent stands as it does.

    Raises:
        FormigaError: no engine runs, or it does not know the id.
    """
    headline, lines = connect().why(of)
    return all_cleaned(ExplainOut(headline, lines[:MOST_CAUSES], NOTICE))


def shown(connect: Connect, task_id: str) -> TreeOut:
    """Return the tree of a task that an engine knows, with how each step stands.

    Raises:
        FormigaError: no engine runs, or it does not know the id.
    """
    from formiga_bt.show.tree import terminal

    picture = connect().task(task_id)
    facts = {fact.path: fact for fact in picture.steps}
    lines = [cleaned(line.plain()) for line in terminal.draw(picture.drawing, facts, width=WIDTH)]
    task = all_cleaned(picture.task)
    held = "HELD" if task.held else ""
    status = " ".join(part for part in (task.id, task.status, held, task.code, task.reason) if part)
    return TreeOut(task.name, status, "\n".join(lines), NOTICE)
