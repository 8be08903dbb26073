"""What seeds from `MORE_FROM` on draw beside `plan`: rarer faults, each a small story of a few deeds, and other trees.

From a stream of its own: what seeds below draw stays as it is, and with it the seeds that are pinned.
"""

from collections.abc import Sequence
from random import Random
from typing import TYPE_CHECKING, Final

from msgspec.structs import replace

from tests.simulation.trees import HELD_TREES, MORE_TREES, RELAY_TREES, TREES

if TYPE_CHECKING:
    from tests.simulation.plan import Ask, Deed, Plan

MORE_FROM: Final = 1000
"""The first seed that draws these."""
UNSURE_FROM: Final = 40_000
"""The first seed whose drones do not always know whether they stand."""
HOLDING_FROM: Final = 50_000
"""The first seed whose random trees hold resources of the site."""
YARD_FROM: Final = 60_000
"""The first seed that is played in a yard, with machines on the ground (`yard`)."""
RELAY_FROM: Final = 70_000
"""The first seed whose random trees go on when a drone is lost or low; without the yard."""
STILL_FROM: Final = 30_000
"""The first seed whose engine's process may stand still."""
PILOTS: Final = {"ann": 3, "bo": 2}
APPROVER: Final = "chief"
STORIES: Final = (
    "fail", "fail", "hang", "spoil", "hurry", "hurry", "superseded", "late_word", "stuck", "stuck", "strict", "lockdown",
    "blame", "carry", "port", "port", "port", "no_answer", "no_answer", "cut", "abandon", "given_up",
)  # fmt: skip
RARE: Final = ("rival",)


def more(drawn: "Plan") -> "Plan":
    """Return a plan with more in it."""
    from tests.simulation.plan import DRONES, Deed

    dice = Random(f"simulation/more/{drawn.seed}")
    machines = [name for name, _, _ in DRONES[: drawn.drones]]
    people = [name for name, _, _ in drawn.people]
    lasts = drawn.calm_at
    asks = tuple(
        replace(ask, task=f"Tree{TREES + dice.randrange(MORE_TREES)}")
        if ask.task.startswith("Tree") and dice.random() < 0.4
        else ask
        for ask in drawn.asks
    )
    if drawn.seed >= RELAY_FROM:
        asks = tuple(_relay(Random(f"simulation/relay/{drawn.seed}/{n}"), ask) for n, ask in enumerate(asks))
    elif drawn.seed >= HOLDING_FROM:
        asks = tuple(_holding(Random(f"simulation/holding/{drawn.seed}/{n}"), ask) for n, ask in enumerate(asks))
    deeds: list[Deed] = []
    for _ in range(dice.randint(2, 5)):
        which = dice.choice(RARE) if dice.random() < 0.04 else dice.choice(STORIES)
        deeds += story(dice, which, round(dice.uniform(5.0, lasts - 5.0), 3), machines, people)
    real = dice.random() < 0.12
    if real:
        deeds += _words(dice, [ask.task for ask in asks], lasts)
    ahead = (
        dice.random() < 0.25 and not drawn.on_file
    )  # how a real file is filled here would undo what is written ahead
    if dice.random() < 0.1:
        deeds += story(dice, "blame_in_cleanup", round(dice.uniform(5.0, lasts - 5.0), 3), machines, people)
    if drawn.seed >= STILL_FROM:
        deeds += _standstills(Random(f"simulation/still/{drawn.seed}"), lasts)
    if drawn.seed >= UNSURE_FROM:
        deeds += _unsure(Random(f"simulation/unsure/{drawn.seed}"), lasts, machines)
    deeds = sorted([*drawn.deeds, *deeds], key=lambda deed: deed.at)
    return replace(drawn, asks=asks, deeds=tuple(deeds), real=real, ahead=ahead)


def _holding(dice: Random, ask: "Ask") -> "Ask":
    """Return a request, of a random tree mostly of one that holds resources."""
    held = ask.task.startswith("Tree") and dice.random() < 0.8
    return replace(ask, task=f"Tree{TREES + MORE_TREES + dice.randrange(HELD_TREES)}") if held else ask


def _relay(dice: Random, ask: "Ask") -> "Ask":
    """Return a request, of a random tree mostly of one whose block goes on without its drone."""
    relay = ask.task.startswith("Tree") and dice.random() < 0.8
    first = TREES + MORE_TREES + HELD_TREES
    return replace(ask, task=f"Tree{first + dice.randrange(RELAY_TREES)}") if relay else ask


def _words(dice: Random, tasks: Sequence[str], lasts: float) -> list["Deed"]:
    """On a site in mode real: pilots come and go, approvals are taken back and given again."""
    from tests.simulation.plan import Deed

    found = []
    for _ in range(dice.randint(2, 5)):
        at = round(dice.uniform(2.0, lasts - 5.0), 3)
        until = round(at + dice.choice((5.0, 15.0, 40.0)), 3)
        if dice.random() < 0.5:
            pilot = dice.choice(sorted(PILOTS))
            found += [Deed(at, "duty", pilot, "off"), Deed(until, "duty", pilot, "on")]
        else:
            task = dice.choice(tasks)
            found += [Deed(at, "revoke", task), Deed(until, "approve", task)]
    return [*found, *(Deed(at, "duty", pilot, "on") for at in (lasts / 3, lasts / 2) for pilot in PILOTS)]


def _standstills(dice: Random, lasts: float) -> list["Deed"]:
    """The engine's process is stopped, sleeps, or waits for a disk."""
    from tests.simulation.plan import Deed

    return [
        Deed(
            round(dice.uniform(2.0, lasts - 5.0), 3), "standstill", much=dice.choice((1.0, 4.0, 8.0, 15.0, 29.0, 35.0))
        )
        for _ in range(dice.randint(1, 4))
    ]


def _unsure(dice: Random, lasts: float, machines: Sequence[str]) -> list["Deed"]:
    """Drones say for a while that they do not know whether they stand, some of them as they take off or land."""
    from tests.simulation.plan import Deed

    found = []
    for _ in range(dice.randint(2, 8)):
        at, drone = round(dice.uniform(2.0, lasts - 5.0), 3), dice.choice(machines)
        until = round(at + dice.choice((0.5, 2.0, 4.0, 9.0, 30.0)), 3)
        found += [Deed(at, "unsure", drone), Deed(until, "sure", drone)]
    return found


def story(dice: Random, which: str, at: float, machines: Sequence[str], people: Sequence[str]) -> list["Deed"]:
    """Return the deeds of a small story."""
    from tests.simulation.plan import Deed

    agent, soon = dice.choice(machines), round(at + dice.choice((0.2, 0.6, 1.5, 3.0, 6.0)), 3)
    until = round(at + dice.choice((8.0, 15.0, 30.0, 50.0)), 3)
    stops = ("hold", "return", "land", "cut")
    match which:
        case "fail":  # what it does fails, in one case in two on a wire that loses much
            deeds = [Deed(soon, "fail", agent)]
            return (
                [Deed(at, "wire", agent, "drop", 0.5), *deeds, Deed(until, "wire_off", agent)]
                if dice.random() < 0.5
                else deeds
            )
        case "hang":  # its next goals are taken, do not begin, and fail; it may be lost or taken over meanwhile
            # hwd_1 announces an action that cuts its motors
            agent = "hwd_1" if "hwd_1" in machines and dice.random() < 0.3 else agent
            deeds = [Deed(at, "hang", agent, much=dice.choice((0.0, 2.0, 20.0, 60.0)), count=dice.randint(1, 3))]
            match dice.choice(("", "cut_off", "freeze", "pilot", "cut")):
                case "cut_off":
                    return [*deeds, Deed(soon + 4.0, "cut_off", agent), Deed(until + 20.0, "join", agent)]
                case "freeze":
                    return [*deeds, Deed(soon + 4.0, "freeze", agent), Deed(until + 20.0, "thaw", agent)]
                case "pilot":
                    return [*deeds, *_pilot(soon + 4.0, until + 5.0, agent)]
                case "cut":
                    return [*deeds, Deed(soon, "order", agent, "cut"), *_pilot(soon + 2.0, until + 5.0, agent)]
            return deeds
        case "spoil":  # what it is told to stop fails instead
            word = (
                Deed(soon, "order", agent, dice.choice(stops))
                if dice.random() < 0.4
                else Deed(soon, "abort", f"@{agent}")
            )
            return [Deed(at, "spoil", agent, count=dice.randint(1, 3)), word]
        case "hurry":  # aborted, and then at once
            whom = dice.choice((f"@{agent}", f"#{dice.randrange(20)}"))
            slow = [Deed(at, "slow", agent, much=1.0), Deed(until, "slow_off", agent)] if dice.random() < 0.4 else []
            first = [Deed(at, "abort", whom)] if dice.random() < 0.6 else []
            then = whom if dice.random() < 0.6 else f"~{dice.randrange(8)}"
            later = round(soon + dice.choice((0.0, 3.0, 8.0)), 3)
            return [*slow, *first, Deed(later, "abort", then, "now")]
        case "superseded":  # the word to stop gets lost, and another goal takes its place
            wire = [Deed(at, "wire", agent, "drop", 0.6), Deed(until, "wire_off", agent)]
            return [
                *wire,
                Deed(at + 0.1, "abort", f"@{agent}"),
                Deed(soon + 0.2, "order", agent, dice.choice(("cut", "cut", "land", "return"))),
            ]
        case "late_word":  # a pilot has it, and an order is on its way
            slow = [Deed(at, "slow", agent, much=2.5), Deed(at + 9.0, "slow_off", agent)]
            return [*slow, *_pilot(at + 0.5, until + 9.0, agent), Deed(at + 0.7, "order", agent, dice.choice(stops))]
        case "stuck":  # it refuses its way home, and is ordered something else meanwhile
            first, second = dice.choice(stops[1:3]), dice.choice(stops[:3])
            deeds = [Deed(at, "refuse", agent, much=float(dice.randint(2, 6))), Deed(at + 0.1, "order", agent, first)]
            again = [Deed(soon + 1.0, "order", agent, second)]
            last = [Deed(until, "refuse", agent, much=6.0), Deed(until + 0.1, "order", agent, dice.choice(stops[1:3]))]
            return [*deeds, *(again if dice.random() < 0.6 else ()), *(last if dice.random() < 0.6 else ())]
        case "strict":  # it refuses all for a while: its task gives up
            crash = [Deed(soon + 3.0, "crash", agent), Deed(until, "rejoin", agent)] if dice.random() < 0.4 else []
            return [Deed(at, "refuse", agent, much=8.0), Deed(at + 0.5, "abort", f"@{agent}"), *crash]
        case "lockdown":  # pressed, changed into another, released
            hows = dice.sample(("hold", "return", "land"), 3)
            gap = dice.choice((2.0, 6.0, 15.0))
            deeds = [
                Deed(round(at + gap * n, 3), "lockdown", "", how) for n, how in enumerate(hows[: dice.randint(2, 3)])
            ]
            return [*deeds, Deed(round(at + gap * 3 + dice.choice((2.0, 20.0)), 3), "lockdown", "", "release")]
        case "blame":  # a task is blamed for the end of the engine, and given up when the next one begins
            how, away = dice.choice(("kept", "lost")), dice.choice((0.5, 5.0, 20.0))
            return [
                Deed(at, "engine", how=how, much=float(dice.randint(1, 60)), away_s=away, blames=dice.randrange(1, 20))
            ]
        case "blame_in_cleanup":  # while what its stopped steps tidy up is itself being stopped
            slow = [Deed(at, "slow", name, much=2.0) for name in machines]
            off = [Deed(round(at + 8.0, 3), "slow_off", name) for name in machines]
            aborts = [Deed(round(at + 0.5, 3), "abort", f"@{name}", "now") for name in machines]
            end = Deed(round(at + 0.6, 3), "engine", how="kept", much=1.0, away_s=1.0, blames=1)
            return [*slow, *off, *aborts, end]
        case "carry":  # who stands somewhere is carried home
            return [Deed(until, "carry", one) for one in machines]
        case "port":  # a machine is put down on another's port, and carried home later
            other = dice.choice([one for one in machines if one != agent])
            tries = [Deed(round(at + 2.0 * n, 3), "carry", "?", dice.choice((other, "?"))) for n in range(8)]
            return [*tries, *(Deed(until + 60.0, "carry", one) for one in machines)]
        case "no_answer":  # the app of a person refuses, or breaks down
            who = dice.choice(people)
            return [
                Deed(at, "refuse", who, much=2.0),
                *(Deed(round(at + n * 3.0, 3), "fail", "?") for n in range(1, 8)),
            ]
        case "cut":
            return [Deed(at, "order", agent, "cut"), Deed(until, "clear", agent)]
        case "abandon":
            return [
                Deed(at, "order", agent, dice.choice(stops[:3])),
                Deed(soon, "abort", f"~{dice.randrange(8)}", "abandon"),
                Deed(until, "clear", agent),
            ]
        case "given_up":  # its cleanup is stopped by the time limit of it
            return [Deed(at, "mute", agent), Deed(at + 0.1, "abort", f"@{agent}"), Deed(until, "unmute", agent)]
        case "rival":  # another engine, of a later epoch, commands the site until this one is started again
            return [Deed(at, "rival"), Deed(until, "rival_off")]
    raise AssertionError(which)


def _pilot(at: float, until: float, agent: str) -> list["Deed"]:
    from tests.simulation.plan import Deed

    return [
        Deed(round(at, 3), "pilot", agent), Deed(round(until, 3), "pilot_off", agent),
        Deed(round(until + 1.0, 3), "handback", agent, "end"),
    ]  # fmt: skip
