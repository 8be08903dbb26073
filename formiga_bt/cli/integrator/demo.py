"""`formiga demo`: the shipped missions on simulated drones and people, each a process of its own, over real Zenoh."""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import FormigaError
from formiga_bt.cli.integrator.keyboard import Keyboard
from formiga_bt.cli.integrator.scenarios import note_of_clock, read_scenario

if TYPE_CHECKING:
    from formiga_bt.lang.model import Task
    from formiga_bt.lang.scenario import Scenario
    from formiga_bt.services.demo import ScenarioDemo
    from formiga_bt.show.live import LivePrinter

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
EXIT_NO, EXIT_INTERRUPTED = 1, 130
LIMIT_S = 1800
"""Engine time that the missions may take; those of the scenario demo need about 300 s."""


def command(
    headless: Annotated[bool, typer.Option("--headless", help="Plain lines instead of the live display.")] = False,
    speed: Annotated[
        float | None,
        typer.Option(
            help="Engine seconds per wall second: 1 is real time, 20 the most (people are asked). Default: the scenario's.",
            metavar="X",
            min=0.1,
            max=20.0,
        ),
    ] = None,
    scenario: Annotated[
        str, typer.Option(help="What to fly: a scenario file, or one that ships with formiga.", metavar="S")
    ] = "demo",
    stay: Annotated[
        bool, typer.Option("--stay", help="Keep engine and fleet running afterwards, as a service, until Ctrl-C.")
    ] = False,
    ask_me: Annotated[
        bool, typer.Option("--ask-me", help="You are the watcher: answer here, or by `formiga answer`.")
    ] = False,
    listen: Annotated[
        str | None,
        typer.Option(
            help="Where agents connect, for example tcp/127.0.0.1:7447. Default: a free port of this machine.",
            metavar="ENDPOINT",
        ),
    ] = None,
) -> None:
    """Fly the missions of a scenario at once, each drone and person a process of its own.

    With --stay or --ask-me the engine is a service meanwhile: `formiga tasks`, `run`, `answer` and the other verbs find it when
    they are called in the same folder. While you are asked something, the clock runs at most in real time.

    The scenario `demo` has 3 light and 3 heavy drones, 2 pickers and a watcher, and takes about a minute. Exit code 0 only if
    every task succeeded and nothing crashed. Ctrl-C aborts the tasks and waits until the drones have landed; a second Ctrl-C
    ends at once.
    """
    play = read_scenario(scenario)
    note_of_clock(play)
    from formiga_bt.services.demo import FREE_PORT, ScenarioDemo
    from formiga_bt.show.live import LiveView, PlainView

    view = PlainView() if headless or not sys.stdout.isatty() else LiveView()
    with ExitStack() as stack:
        stack.enter_context(_signals())
        serve = Path.cwd() if stay or ask_me else None
        also = _shipped(play) if stay else []
        demo = ScenarioDemo(play, speed=speed, listen=listen or FREE_PORT, serve=serve, ask_me=ask_me, also=also)
        desk = Keyboard(demo, view) if demo.me else None
        view.say(f"starting {len(demo.agents)} agents, each a process of its own, at {demo.speed:g}x")
        with _held_back():
            stack.enter_context(demo)
        stack.callback(_deaf)
        stack.enter_context(view)
        interrupted = not _fly(demo, view, desk)
        if stay and not interrupted:
            _stay(demo, view, desk)
        verdict = demo.verdict()
    view.close_with(demo.log, verdict)
    if interrupted:
        view.say("Interrupted: the tasks were aborted and the drones brought home.")
        raise typer.Exit(EXIT_INTERRUPTED)
    if demo.died or not demo.log.all_succeeded() or not verdict.is_clean:
        raise typer.Exit(EXIT_NO)


def _shipped(play: "Scenario") -> "list[Task]":
    """Return the tasks that ship with formiga, for a demo that stays as a service."""
    from formiga_bt.base.packaged import folder
    from formiga_bt.cli.inputs import CheckWorld, read_task, task_files
    from formiga_bt.rehearsal.simulation import site_of

    world = CheckWorld(play.catalogue, site_of(play))
    read = [read_task(path, world).task for path in task_files([folder("trees")])]
    return [task for task in read if task is not None]


def _leave(number: int, _: object) -> None:
    """Leave by way of all `finally`, so that no process is left."""
    _deaf()
    sys.exit(128 + number)


def _deaf() -> None:
    """Let no further signal interrupt the ending of the processes."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def _signals() -> Iterator[None]:
    """Let signals that end a process end the demo in order; give them back to who had them."""
    old = {number: signal.getsignal(number) for number in SIGNALS}
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _leave)
    try:
        yield
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)


@contextmanager
def _held_back() -> Iterator[None]:
    """Hold signals back until the processes are started: one cut off between its start and its being noted would stay."""
    noted: list[int] = []
    old = {number: signal.signal(number, lambda signum, _: noted.append(signum)) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)
    for signum in noted[:1]:
        signal.raise_signal(signum)


def _stay(demo: "ScenarioDemo", view: "LivePrinter", desk: Keyboard | None) -> None:
    """Keep everything running until Ctrl-C; then bring the drones home."""
    view.say(
        "The missions are over, engine and fleet stay. In this folder: formiga run PickUp --param ..., formiga tasks"
    )
    view.say("Ctrl-C ends the demo")
    try:
        while True:
            _turn(demo, view, desk, 0.2)
    except KeyboardInterrupt:
        _land(demo, view, lambda: view.show(demo.log, demo.driver.now()))


def _turn(demo: "ScenarioDemo", view: "LivePrinter", desk: Keyboard | None, seconds: float) -> None:
    if desk is not None:
        desk.look()
    demo.keep_pace()
    _pump(demo, view, seconds)
    view.show(demo.log, demo.driver.now())


def _pump(demo: "ScenarioDemo", view: "LivePrinter", seconds: float) -> None:
    """Go on, and tell of agents whose processes ended by themselves."""
    before = len(demo.died)
    demo.pump(seconds)
    for text in list(demo.died.values())[before:]:
        view.say(f"{text}; the demo goes on without it")


def _fly(demo: "ScenarioDemo", view: "LivePrinter", desk: Keyboard | None) -> bool:
    """Run the missions; return False if they were interrupted (the drones have landed then)."""
    from formiga_bt.lang.scenario import ScenarioOrder
    from formiga_bt.rehearsal.simulation import describe

    def show() -> None:
        view.show(demo.log, demo.driver.now())

    def show_missing(agents: list[str]) -> None:
        view.waiting(agents)
        show()

    try:
        demo.wait_ready(show_missing)
        demo.begin()
        until = demo.driver.now() + LIMIT_S * SECOND
        while not demo.is_over:
            if demo.driver.now() > until and demo.died:
                view.say(f"the missions did not end within {LIMIT_S} s of engine time")
                break
            if demo.driver.now() > until:
                raise FormigaError(f"the missions did not end within {LIMIT_S} s of engine time")
            if left := demo.left_waiting():
                names = ", ".join(f"{task.id} ({', '.join(task.hold.words)})" for task in left)
                view.say(f"the scenario is over; what is left waits for a person's word that it does not have: {names}")
                break
            for entry in demo.play_due():
                view.say(f"{'order' if isinstance(entry, ScenarioOrder) else 'fault'}: {describe(entry)}")
            _turn(demo, view, desk, demo.wait_s(0.2))
    except KeyboardInterrupt:
        _land(demo, view, show)
        return False
    return True


def _land(demo: "ScenarioDemo", view: "LivePrinter", show: Callable[[], None]) -> None:
    """Abort all tasks and wait until the drones have landed."""
    view.say("Ctrl-C: aborting the tasks and bringing the drones home; once more to end at once")
    try:
        while True:
            demo.abort_all()
            _pump(demo, view, 0.2)
            show()
            if demo.all_ended():
                return
    except KeyboardInterrupt:
        _deaf()
        raise
