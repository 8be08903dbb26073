"""Before agents are simulated beside an engine: whether it hears one of them already, from another process or at its desk."""

import time
from collections.abc import Collection
from typing import Final

from formiga_bt.base.errors import FormigaError
from formiga_bt.client import Client, NoEngine

WAIT_S: Final = 4.0
"""The processes of a fleet that has just been ended may be heard for so long."""
LOOK_EVERY_S: Final = 0.5


def check_absent(client: Client, agents: Collection[str], *, can_leave_out: bool, wait_s: float = WAIT_S) -> None:
    """Refuse to simulate who is there already; if no engine answers nobody is.

    Args:
        client: of the engine.
        agents: ids of those that are to be simulated.
        can_leave_out: the command has --without.
        wait_s: how long they may take to go.

    Raises:
        FormigaError: an engine would hear some of them twice.
    """
    until = time.monotonic() + wait_s
    while True:
        try:
            found = client.agents().agents
        except NoEngine:
            return
        desk = [one.id for one in found if one.id in agents and one.at_desk]
        others = [one.id for one in found if one.id in agents and not one.at_desk and one.liveness == "ALIVE"]
        if not desk and not others:
            return
        if desk or time.monotonic() >= until:
            raise FormigaError(_text(desk, others, can_leave_out=can_leave_out))
        time.sleep(LOOK_EVERY_S)


def _text(desk: list[str], others: list[str], *, can_leave_out: bool) -> str:
    said = []
    if desk:
        said.append(f"{', '.join(desk)} {_verb(desk, 'answers', 'answer')} at the engine's desk")
    if others:
        said.append(f"the engine hears {', '.join(others)} already, from {_verb(others, 'another process', 'others')}")
    without = "".join(f" --without {agent}" for agent in (*desk, *others))
    ways = [f"leave {_verb([*desk, *others], 'it', 'them')} out: formiga sim{without}"] if can_leave_out else []
    if desk:
        ways.append(f"start the engine without {' '.join(f'--desk {agent}' for agent in desk)}")
    if others:
        ways.append("end what simulates them first: formiga sim, formiga up --sim")
    return f"{'; '.join(said)}: nobody is simulated twice\n  help: {'; or '.join(ways)}"


def _verb(who: list[str], one: str, many: str) -> str:
    return one if len(who) == 1 else many
