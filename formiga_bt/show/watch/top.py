"""The top line: what a person must see first, in words and colours, never scrolled away.

    AIRBORNE 7 | NEEDS YOU 2 (0:41) | ALARM 1 | HELD 1 | PILOT has lwd_3

What is wrong with the whole (no answer of the engine, lockdown, an engine that ends) stands before it. If it is longer than the
screen is wide, it goes on in a second line, broken between its parts.
"""

from datetime import UTC, datetime

from msgspec import Struct

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.show.facts import Now, ResourceFact, Top
from formiga_bt.show.offset import offset_words
from formiga_bt.show.watch.text import Line, TonedText, clean, line, span, width_of


class Link(Struct, frozen=True):
    """Whether the engine answers."""

    lost_s: float | None = None
    """It has not answered for so long; None: it answers."""
    why: str = ""

    @property
    def words(self) -> str:
        """Return how old what is shown is."""
        return "" if self.lost_s is None else span(int(self.lost_s * 1e6))


def parts(now: Now | None, link: Link) -> list[TonedText]:
    """Return the parts of the top line, most urgent first where something is wrong."""
    found = []
    if link.lost_s is not None:
        seen = f"what you see is {link.words} old" if now is not None else f"tried for {link.words}"
        found.append(TonedText(f"NO ENGINE: {seen}", "alarm_bar"))
    if now is None:
        return found or [TonedText("asking the engine ...", "calm_bar")]
    top = now.top
    if top.lockdown:
        found.append(TonedText(_lockdown(top), "alarm_bar"))
    if now.engine == "past":
        found.append(TonedText(f"PAST {clock(now.at)}", "warn_bar"))
    elif now.engine != "ok":
        found.append(TonedText(f"ENGINE {clean(now.engine).upper()}", "warn_bar"))
    found.append(TonedText(f"AIRBORNE {top.airborne}", "calm_bar"))
    waits = f" ({span(top.longest_wait_us)})" if top.needs_you else ""
    found.append(TonedText(f"NEEDS YOU {top.needs_you}{waits}", "alarm_bar" if top.needs_you else "calm_bar"))
    found.append(TonedText(f"ALARM {top.alarms}", "alarm_bar" if top.alarms else "calm_bar"))
    found.append(TonedText(f"HELD {top.held}", "warn_bar" if top.held else "calm_bar"))
    holders: dict[str, list[str]] = {}
    for who, machine in top.taken:
        holders.setdefault(who, []).append(machine)
    found += [TonedText(f"{who} has {', '.join(has)}", "warn_bar") for who, has in holders.items()]
    return found


def clock(at: Micros) -> str:
    """Return an instant of engine time as the date and time of this machine's zone."""
    return f"{datetime.fromtimestamp(at // SECOND, UTC).astimezone():%Y-%m-%d %H:%M:%S}"


def about(now: Now) -> str:
    """Return the site's name, how fast its clock goes where that is not real time, and how far it is from the wall clock."""
    speed = "" if now.speed == 1.0 else f"x{now.speed:g}"
    words = " ".join(part for part in (speed, offset_words(now.ahead_us)) if part)
    return f"{clean(now.site)}, clock {words}" if words else clean(now.site)


def _lockdown(top: Top) -> str:
    words = clean(top.lockdown)
    return words if words.upper().startswith("LOCKDOWN") else f"LOCKDOWN {words}"


def top_lines(now: Now | None, link: Link, width: int, about: str = "", most: int = 2) -> list[Line]:
    """Return the top line, in as many lines as it takes.

    Args:
        now: what is known.
        link: whether the engine answers.
        width: columns of the screen.
        about: what stands at the right edge if there is room.
        most: so many lines at most; what is too much is cut.
    """
    lines: list[list[TonedText]] = [[]]
    used = 0
    for part in parts(now, link):
        room = width_of(part.text) + (3 if used else 0)
        if used and used + room > width and len(lines) < most:
            lines.append([])
            used, room = 0, width_of(part.text)
        if used:
            lines[-1].append(TonedText(" | ", "calm_bar"))
        lines[-1].append(part)
        used += room
    done = [line(*pieces) for pieces in lines]
    if about and len(done) == 1 and used + 2 + width_of(about) <= width:
        done[0] = (*done[0], TonedText(" " * (width - used - width_of(about)) + about, "calm_bar"))
    return done


def resource_line(now: Now | None, width: int) -> Line | None:
    """Return the row of the resources that somebody holds, is in or waits for; None if there is none, or nobody does.

    RESOURCES lift_1 1/1 Tote-3, 2 wait | bridge 0/1 rover_2 inside
    """
    used = [one for one in now.resources if one.held or one.inside or one.waiting] if now is not None else []
    if not used:
        return None
    pieces = [TonedText("RESOURCES ", "bold")]
    for number, one in enumerate(used):
        pieces.append(TonedText(f"{' | ' if number else ''}{clean(_said_of(one))}", "warn" if one.waiting else "plain"))
    kept: list[TonedText] = []
    room = width
    for piece in pieces:
        if width_of(piece.text) > room:
            break
        kept.append(piece)
        room -= width_of(piece.text)
    return line(*kept)


def _said_of(one: ResourceFact) -> str:
    taken = sum(held.units for held in one.held)
    words = [f"{one.name} {taken}/{one.capacity}"]
    words += [held.task for held in one.held]
    words += [f"{agent} inside" for agent in one.inside]
    text = " ".join(words)
    return f"{text}, {len(one.waiting)} wait{'s' if len(one.waiting) == 1 else ''}" if one.waiting else text
