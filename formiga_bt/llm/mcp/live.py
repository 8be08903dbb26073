"""What a running engine tells an assistant: the site now, a task, and why something stands as it does.

Blocks while it asks: called in threads. Everything that comes from an engine goes through `outside`.
"""

from collections.abc import Callable

from formiga_bt.base.errors import FormigaError
from formiga_bt.llm.mcp.outside import NOTICE, all_cleaned, cleaned
from formiga_bt.llm.mcp.records import CauseOut, ExplainOut, LineOut, NowOut, QuestionOut, TreeOut
from formiga_bt.show.facts import AgentFact, Now, TaskFact
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
        return cleaned(str(error).partition("\n")[0]), {}
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
            tasks=[_line(task) for task in found.tasks],
            more_tasks=max(0, found.total - len(found.tasks)),
            questions=_questions(found),
            log=[line.text for line in found.lines[-20:]],
            notice=NOTICE,
        )
    )


def _line(task: TaskFact) -> LineOut:
    status = f"{task.status}{' HELD' if task.held else ''}"
    return LineOut(
        task.id, task.name, status, list(task.agents), task.doing, task.needs, task.code, task.reason
    )  # fmt: skip


def _questions(found: Now) -> list[QuestionOut]:
    return [
        QuestionOut(
            one.number,
            one.task,
            one.text,
            list(one.options),
            list(one.asked),
            None if one.lapses_at is None else round((one.lapses_at - found.at) / 1e6, 1),
        )
        for one in found.questions[:MOST_QUESTIONS]
    ]


def explained(connect: Connect, of: str) -> ExplainOut:
    """Return why a task or an agent stands as it does.

    Raises:
        FormigaError: no engine runs, or it does not know the id.
    """
    headline, lines = connect().why(of)
    causes = [CauseOut(one.code, one.text, one.hint, one.depth) for one in lines[:MOST_CAUSES]]
    return all_cleaned(ExplainOut(headline, causes, NOTICE))


def shown(connect: Connect, task_id: str) -> TreeOut:
    """Return the tree of a task that an engine knows, with how each step stands.

    Raises:
        FormigaError: no engine runs, or it does not know the id.
    """
    from formiga_bt.show.tree import terminal

    picture = connect().task(task_id)
    facts = {fact.path: fact for fact in picture.steps}
    lines = [cleaned(line.plain()) for line in terminal.draw(picture.drawing, facts, width=WIDTH)]
    task = all_cleaned(_line(picture.task))
    status = " ".join(part for part in (task.id, task.status, task.code, task.reason) if part)
    return TreeOut(task.task, status, "\n".join(lines), NOTICE)
