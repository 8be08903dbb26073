"""`formiga sim` without a scenario: the site's agents, simulated, each a process of its own, until Ctrl-C.

They need no engine: they fly on while none is there, as real ones do, and connect to the next one at their endpoint.
"""

import signal
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

import msgspec

from formiga_bt.base.certificates import read_keys
from formiga_bt.base.endpoints import reached_at
from formiga_bt.base.errors import FormigaError, TransportError
from formiga_bt.base.site_folder import SiteFolder, read_address
from formiga_bt.base.visible import visible
from formiga_bt.cli.inputs import CheckWorld, UnusableFile, is_demo
from formiga_bt.cli.integrator.absent import check_absent
from formiga_bt.cli.operator.up import site_world
from formiga_bt.client import Client
from formiga_bt.services.listening import keys_of, listen_of
from formiga_bt.services.simulated import Simulated, check_unsimulated
from formiga_bt.transport.messages import ClockBeat
from formiga_bt.transport.zenoh_agent import ZenohObserver
from formiga_bt.transport.zenoh_keys import CLOCK

SILENT_S: Final = 3.0
"""An engine that beats each second and is not heard for so long is gone."""
LOOK_EVERY_S: Final = 0.2
TRY_EVERY_S: Final = 1.0


class Heard:
    """What is told of engines by their beats. Times are seconds of a clock that never goes back."""

    def __init__(self) -> None:
        self._epoch: int | None = None
        self._at = 0.0
        self._is_there = False

    def beat(self, beat: ClockBeat, now: float) -> str:
        """Take a beat; return what to tell, or an empty text."""
        is_news = not self._is_there or beat.epoch != self._epoch
        self._epoch, self._at, self._is_there = beat.epoch, now, True
        return f"an engine is there (start {beat.epoch}), its clock runs at {beat.speed:g}x" if is_news else ""

    def look(self, now: float) -> str:
        """Return what to tell if no engine is heard any more, or an empty text."""
        if not self._is_there or now - self._at < SILENT_S:
            return ""
        self._is_there = False
        return "no engine is heard: the agents go on with what they do, and look for the next one"


def run(site_file: Path, actions: list[Path], connect: str | None, without: Sequence[str]) -> None:
    """Run the fleet of a site until Ctrl-C or SIGTERM.

    Raises:
        UnusableFile: the site cannot be used, has no such agents, or it is not known where to look for its engine.
        FormigaError: the site is a real one, has nobody to simulate, or its engine hears one of them already.
        SiteError: its agents are simulated already.
    """
    world = site_world(actions, site_file)
    assert world.site is not None
    if world.site.mode != "simulation":
        raise FormigaError(
            f"formiga sim is for sites in mode simulation; {world.site.name} is in mode {world.site.mode}"
        )
    _check_names(world, without)
    beside = Path() if is_demo(site_file) else site_file.parent
    folder = SiteFolder(beside, world.site.name).path
    where = connect or reached_at(_endpoint(folder, listen_of(world.site)))
    keys = keys_of(world.site)
    fleet = Simulated(
        world.site, world.catalogue, connect=where, folder=folder, without=without, keys=keys,
        anew="end this command (Ctrl-C) and start it again: formiga sim",
    )  # fmt: skip
    if not fleet.agents:
        raise FormigaError(
            f"nobody is left to simulate on the site {world.site.name}", help="list agents in site.yaml, under agents"
        )
    own = None if keys is None else read_keys(keys / fleet.agents[0], time.time())  # any of them hears the clock
    observer = ZenohObserver(world.site.name, connect=where, keys=own)
    check_unsimulated(folder)
    there = read_address(folder)
    if there is not None:
        check_absent(Client(there), fleet.agents, can_leave_out=True)
    asked: list[int] = []
    before = {
        number: signal.signal(number, lambda got, _: asked.append(got))
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    }
    try:
        with fleet:
            _say(
                f"simulated, each a process of its own: {', '.join(fleet.agents)}\n"
                f"they look for the engine of {world.site.name} at {where}, and live on when it ends; Ctrl-C ends them\n"
                "next, in another terminal in this folder: formiga up"
            )
            _watch(fleet, observer, asked)
        _say("the agents are gone")
    finally:
        observer.close()
        for number, handler in before.items():
            signal.signal(number, handler)


def _watch(fleet: Simulated, observer: ZenohObserver, asked: list[int]) -> None:
    heard, is_open, next_try = Heard(), False, 0.0
    while not asked:
        if not is_open and time.monotonic() >= next_try:
            next_try = time.monotonic() + TRY_EVERY_S
            with suppress(TransportError):  # no engine yet
                observer.open(CLOCK.of_all)
                is_open = True
        for _, raw in observer.poll():
            with suppress(msgspec.DecodeError):
                _tell(heard.beat(msgspec.json.decode(raw, type=ClockBeat), time.monotonic()))
        _tell(heard.look(time.monotonic()))
        for text in fleet.look():
            _tell(text)
        time.sleep(LOOK_EVERY_S)


def _check_names(world: CheckWorld, without: Sequence[str]) -> None:
    assert world.site is not None
    for agent in without:
        if agent not in world.site.agents:
            raise UnusableFile(f"--without {agent}: the site lists {', '.join(world.site.agents) or 'no agents'}")


def _endpoint(folder: Path, listed: str) -> str:
    """Return where the engine of a runtime folder listens now, else where the site file says."""
    there = read_address(folder)
    if there is not None:
        return there.endpoint
    if listed.endswith(":0"):
        raise UnusableFile(
            f"the site lets each engine take a free port ({listed}), so nobody knows where to look for it",
            help="name a port in site.yaml under transports; or say one to both: formiga sim --connect ENDPOINT,"
            " formiga up --listen ENDPOINT",
        )
    return listed


def _tell(text: str) -> None:
    if text:
        _say(f"{time.strftime('%H:%M:%S')}  {text}")


def _say(text: str) -> None:
    """Print a line; a fleet does not end because nobody reads what it prints."""
    with suppress(OSError):
        print(visible(text), flush=True)
