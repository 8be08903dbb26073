"""Run one simulated agent as a process: `python -m agents_sim --id hwd_1 --type hwd --site farm --at 0,20`.

Ends on SIGTERM and SIGINT. SIGUSR1 plays the pilot who takes a drone over, SIGUSR2 the one who hands it back. With
`--orders` it reads faults to play from its standard input, a JSON `faults.Order` a line.
"""

import argparse
import json
import os
import signal
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from agents_sim.faults import Order
from agents_sim.kinds import Kind, Outcome
from agents_sim.lines import say
from agents_sim.shipped import KINDS
from agents_sim.spec import AgentSpec
from formiga_bt.base.certificates import read_keys
from formiga_bt.base.errors import FormigaError
from formiga_bt.base.geo import Place, Position


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Read the command line; exits with a message if it is wrong."""
    parser = argparse.ArgumentParser(prog="python -m agents_sim", description="One simulated agent over Zenoh.")
    parser.add_argument("--id", required=True, help="the agent's id, for example hwd_1")
    parser.add_argument("--type", required=True, help=f"{', '.join(KINDS)}; others with --does or --kind")
    parser.add_argument("--kind", choices=["drone", "person"], default="", help="what an unknown type is")
    parser.add_argument("--site", required=True, help="the site's name")
    parser.add_argument("--connect", default="tcp/127.0.0.1:7447", help="the engine's endpoint (%(default)s)")
    parser.add_argument("--keys", type=Path, help="its folder of keys, at a secured site")
    parser.add_argument("--at", default="0,0", help="metres east,north[,up] of the base (%(default)s)")
    parser.add_argument("--home", help="metres east,north of its port (where it begins)")
    parser.add_argument("--battery", type=float, default=100.0, help="percent (%(default)s)")
    parser.add_argument("--limits", default="", help="overrides, for example speed_m_s=10,climb_m_s=3")
    parser.add_argument(
        "--script", default="[]", help='a person\'s answers, JSON: [{"match": "*", "options": ["yes"]}]'
    )
    parser.add_argument("--does", default="", help="what the catalogue says of its type, JSON of kinds.Kind")
    parser.add_argument("--outcomes", default="[]", help="what is to become of its goals, JSON of kinds.Outcome")
    parser.add_argument("--seed", type=int, default=0, help="of how long things last (%(default)s)")
    parser.add_argument(
        "--chargers", default="", help="where it charges besides its home: places east,north joined by ;"
    )
    parser.add_argument("--walk", default="", help="a person's way: places east,north joined by ;")
    parser.add_argument("--base", default="", help="latitude,longitude of the base, to report both")
    parser.add_argument("--wind", default="0,0", help="m/s east,north, where it blows to (%(default)s)")
    parser.add_argument("--payload", type=float, default=0.0, help="kg that a drone carries (%(default)s)")
    parser.add_argument("--cut", action="store_true", help="a drone that announces CutMotors")
    parser.add_argument(
        "--on-link-loss",
        choices=["return", "land", "hold"],
        default="return",
        help="what a drone does by itself without a link (%(default)s)",
    )
    parser.add_argument("--orders", action="store_true", help="read faults to play from standard input")
    parser.add_argument("--state-dir", type=Path, help="where its files are kept; without, it is new at each start")
    parser.add_argument(
        "--exit-with-parent",
        type=int,
        nargs="?",
        const=os.getppid(),
        metavar="PID",
        help="end when the process that started it (PID) is gone",
    )
    return parser.parse_args(arguments)


def read_spec(options: argparse.Namespace) -> AgentSpec:
    """Return the agent the command line describes.

    Raises:
        ValueError: a value cannot be read.
    """
    at = read_point(options.at)
    home = read_point(options.home) if options.home else None if options.does else at
    wind = read_place(options.wind)
    limits = dict(pair.split("=", 1) for pair in options.limits.split(",") if pair)
    return AgentSpec(
        id=options.id,
        type=options.type,
        at=at,
        battery=options.battery,
        home=home.ground if isinstance(home, Position) else home,
        limits={name: float(number) for name, number in limits.items()},
        script=tuple(json.loads(options.script)),
        kind=options.kind,
        does=_decoded(options.does, Kind, "--does") if options.does else None,
        outcomes=_decoded(options.outcomes, tuple[Outcome, ...], "--outcomes"),
        seed=options.seed,
        chargers=tuple(read_place(point) for point in options.chargers.split(";") if point),
        walk=tuple(read_place(point) for point in options.walk.split(";") if point),
        base=read_degrees(options.base) if options.base else None,
        wind=(wind.east_m, wind.north_m),
        payload_kg=options.payload,
        cut=options.cut,
        on_link_loss=options.on_link_loss,
    )


def _decoded(text: str, kind: Any, option: str) -> Any:
    try:
        return msgspec.json.decode(text, type=kind)
    except msgspec.DecodeError as error:
        raise ValueError(f"{option} cannot be read: {error}") from error


def read_point(text: str) -> Place | Position:
    """Read `east,north` or `east,north,up`.

    Raises:
        ValueError: it is neither.
    """
    numbers = [float(part) for part in text.split(",")]
    if len(numbers) == 2:
        return Place(*numbers)
    if len(numbers) == 3:
        return Position(*numbers)
    raise ValueError(f"a point is east,north or east,north,up in metres, got {text!r}")


def read_place(text: str) -> Place:
    """Read `east,north`.

    Raises:
        ValueError: it is not.
    """
    point = read_point(text)
    if not isinstance(point, Place):
        raise ValueError(f"a place is east,north in metres, got {text!r}")
    return point


def read_degrees(text: str) -> tuple[float, float]:
    """Read `latitude,longitude`.

    Raises:
        ValueError: it is not.
    """
    place = read_place(text)
    return place.east_m, place.north_m


class Wishes:
    """What signals and the standard input asked for; the handlers only take notes."""

    def __init__(self, parent: int | None, *, reads_orders: bool) -> None:
        self._parent = parent
        self._stop = False
        self._orders: list[Order] = []
        self._half_line = b""
        self._reads = reads_orders
        if reads_orders:
            os.set_blocking(sys.stdin.fileno(), False)
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._on_stop)
        signal.signal(signal.SIGUSR1, lambda *_: self._orders.append(Order(kind="take_over")))
        signal.signal(signal.SIGUSR2, lambda *_: self._orders.append(Order(kind="hand_back")))

    def is_stopping(self) -> bool:
        """Return whether to end: a signal came, or the parent is gone."""
        return self._stop or (self._parent is not None and os.getppid() != self._parent)

    def orders(self) -> list[Order]:
        """Return the faults ordered since the last call.

        Raises:
            ValueError: a line is no order.
        """
        if self._reads:
            self._read()
        orders, self._orders = self._orders, []
        return orders

    def _read(self) -> None:
        try:
            raw = os.read(sys.stdin.fileno(), 65536)
        except BlockingIOError:
            return
        self._reads = bool(raw)
        *lines, self._half_line = (self._half_line + raw).split(b"\n")
        for line in lines:
            try:
                self._orders.append(msgspec.json.decode(line, type=Order))
            except msgspec.DecodeError as error:
                raise ValueError(f"no order: {line!r}: {error}") from error

    def _on_stop(self, *_: Any) -> None:
        self._stop = True


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one agent until it is told to end. Return the exit status."""
    options = parse(sys.argv[1:] if arguments is None else arguments)
    wishes = Wishes(options.exit_with_parent, reads_orders=options.orders)
    from agents_sim.process import AgentProcess  # loads the wire: only once the command line is known to be good

    try:
        keys = None if options.keys is None else read_keys(options.keys, time.time(), options.id)
        agent = AgentProcess(
            read_spec(options), site=options.site, connect=options.connect, state_dir=options.state_dir, keys=keys
        )
        agent.run(wishes.is_stopping, wishes.orders)
    except (ValueError, OSError, FormigaError) as error:
        say(f"agents_sim: {options.id}: {error}")
        return 1
    return 0


if __name__ == "__main__":
    status = main()
    with suppress(OSError):  # what it printed may be a file on a full disk
        sys.stdout.flush()
        sys.stderr.flush()
    # Not sys.exit: a session that hangs while it closes must not keep the process alive.
    os._exit(status)
