"""Makes the picture of `formiga watch` in `docs/pictures`: a site as it may be, drawn by the dashboard itself.

Run from the root of a checkout: `python docs/pictures/make_watch.py [FOLDER]`. The file is the same each time.
"""

import asyncio
import re
import sys
from pathlib import Path

from formiga_bt.show.facts import AgentFact, LineFact, Now, QuestionFact, TaskFact, Top
from formiga_bt.show.source import Source
from formiga_bt.show.watch.app import Dashboard
from formiga_bt.show.watch.background import here
from formiga_bt.show.watch.orders import Actor

S = 1_000_000
AT = 10_000 * S


def machine(name: str, task: str, battery: float, **more: str) -> AgentFact:
    """Return a machine that flies, if nothing else is said."""
    facts = {"landed": "airborne", "action": "GoTo", "pool": "ASSIGNED", **more}
    return AgentFact(
        id=name, type=name[:3], liveness="ALIVE", control="engine", task=task, battery=battery, **facts
    )  # fmt: skip


QUESTION = QuestionFact(
    number="Q7", task="PickUp-12", kind="clearance", options=("clear", "wait", "refuse"),
    text="hwd_1 stands at camp and wants to take off. Do people stand 15 m clear of it?",
    asked=("picker_1", "watcher_1"), here=("watcher_1",), asked_at=AT - 41 * S, lapses_at=AT + 259 * S,
    if_no_answer="it stays there, PARKED_AWAY", clears="hwd_1", clears_on=("clear",),
)  # fmt: skip
TASKS = (
    TaskFact(
        id="PickUp-12", name="PickUp", status="ACTIVE", held=("clearance",), agents=("hwd_1", "picker_1"), needs="Q7",
        urgent_at=AT + 259 * S, urgent="Q7 lapses", doing="Q7 asks picker_1, watcher_1",
    ),
    TaskFact(
        id="Circle-9", name="Circle", status="ACTIVE", held=("operator",), agents=("lwd_2",), needs="continue or end it",
        urgent_at=AT + 540 * S, urgent="lwd_2 returns by itself", doing="lwd_2 GoTo was interrupted",
    ),
    TaskFact(
        id="Circle-7", name="Circle", status="ACTIVE", agents=("lwd_1",), urgent_at=AT + 1260 * S, urgent="timeout",
        doing="lwd_1 GoTo 62 %",
    ),
    TaskFact(
        id="PickUp-13", name="PickUp", status="ACTIVE", agents=("hwd_2",), urgent_at=AT + 1900 * S, urgent="timeout",
        doing="hwd_2 GoTo 40 %",
    ),
    TaskFact(id="MoveTask-3", name="MoveTask", status="PENDING", doing="waits for lwd_1, which Circle-7 has"),
)  # fmt: skip
AGENTS = (
    machine("hwd_1", "PickUp-12", 68.0, landed="grounded", action=""),
    machine("hwd_2", "PickUp-13", 83.0),
    machine("lwd_1", "Circle-7", 54.0),
    machine(
        "lwd_2", "Circle-9", 61.0, action="", order="HOLD by eve since 6 min: hovers; it returns by itself in 9 min"
    ),
    AgentFact(id="lwd_3", type="lwd", pool="STANDBY", liveness="ALIVE", taken=True, control="pilot", battery=77.0),
    AgentFact(id="watcher_1", type="watcher", human=True, pool="STANDBY", liveness="ALIVE", action="Confirm"),
)
NOW = Now(
    site="meadow", at=AT, counts={}, tasks=TASKS, total=len(TASKS), agents=AGENTS, questions=(QUESTION,),
    top=Top(airborne=4, needs_you=1, longest_wait_us=41 * S, alarms=1, held=2, taken=(("PILOT", "lwd_3"),)),
    lines=(
        LineFact(at=AT - 130 * S, text="lwd_2: the wind of 9 m/s is above its limit, 8 m/s", severity="alarm"),
        LineFact(at=AT - 41 * S, text="Q7 asks picker_1, watcher_1"),
    ),
)  # fmt: skip


class Still(Source, Actor):
    """A site in which time stands still, and nothing else can be asked."""

    def now(self, *, first: int = 0, count: int = 100, find: str = "", over: bool = False) -> Now:  # noqa: ARG002
        """Return the site."""
        return NOW


async def draw() -> str:
    """Return the screen as SVG that needs no other file."""
    still = Still()
    app = Dashboard(still, still, clock=lambda: 0.0, away=here, every_s=None)
    async with app.run_test(size=(118, 30)) as pilot:
        for _ in range(2):
            await app.poll()
            await pilot.pause()
        svg = app.export_screenshot(title="formiga watch", simplify=True)
    svg = re.sub(r"@font-face \{.*?\}\s*", "", svg, flags=re.DOTALL).replace("Fira Code, monospace", "monospace")
    return re.sub(r"terminal-\d+-", "watch-", svg)


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "watch.svg").write_text(asyncio.run(draw()), encoding="utf-8")
