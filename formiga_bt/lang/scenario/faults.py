"""Reads the faults of a scenario. One that lasts for a while becomes two: its begin and its end."""

from collections.abc import Mapping
from dataclasses import replace

from formiga_bt.clock import Micros, micros
from formiga_bt.lang.document import Entry, Mapping_, Node
from formiga_bt.lang.reading import did_you_mean, quoted_list, read_keys, read_name, read_text, read_word
from formiga_bt.lang.scenario.book import Book
from formiga_bt.lang.scenario.entries import FaultKind, ScenarioFault
from formiga_bt.lang.scenario.options import CHECKS, ENDS, FAULT, FAULTS, FOR_DRONES, MOST_DRIFT_M

_KINDS: Mapping[str, FaultKind] = {one: one for one in FAULTS}  # type: ignore[misc]  # its keys are the kinds
_FOR_ALL = ("wind",)
"""Faults that befall every drone if no agent is named."""


def read_faults(book: Book) -> list[ScenarioFault]:
    """Return the faults of a scenario, begins and ends, as they are written."""
    found = []
    for node in book.items("faults"):
        mapping = book.mapping(node, "fault")
        if mapping is not None:
            found += _fault(book, mapping)
    return found


def _fault(book: Book, mapping: Mapping_) -> list[ScenarioFault]:
    entry = mapping.get("kind")
    kind = read_word(entry.value, book.problems, "kind", tuple(FAULTS)) if entry is not None else ""
    every = tuple({o.name: replace(o, required=False) for options in FAULTS.values() for o in options}.values())
    owner = f"the fault '{kind}'" if kind else "a fault"
    general = [replace(o, required=False) if o.name == "agent" and kind in _FOR_ALL else o for o in FAULT]
    keys = read_keys(mapping, (*general, *(FAULTS[kind] if kind else every)), book.problems, owner)
    at, lasts = micros(book.duration(keys, "at", 0.0)), book.duration(keys, "for", 0.0)
    agents = _agents(book, keys, kind)
    if not kind:
        return []
    begin = _begin(book, keys, _KINDS[kind], at)
    if begin.event:
        _check_event(book, keys["event"].value, begin.event, agents)
    ends = [replace(begin, at=at + micros(lasts), kind=ENDS[kind], on=False, delay_s=0.0)] if lasts > 0.0 else []
    return [replace(one, agent=agent) for agent in agents for one in (begin, *ends)]


def _check_event(book: Book, node: Node, event: str, agents: list[str]) -> None:
    """Report E021 for an event that an agent of its type never tells, or that has fields: simulated agents give none."""
    for agent in agents:
        known = book.catalogue.types[book.types[agent]].events
        if event not in known:
            what = f"{book.types[agent]} has no event '{event}'{did_you_mean(event, known)}"
            told = f"events: {quoted_list(known)}" if known else "it tells no events"
            book.problems.add("E021", node.mark, what, told)
        elif known[event]:
            book.problems.add("E021", node.mark, f"event '{event}' has fields, simulated agents tell none")


def _agents(book: Book, keys: Mapping[str, Entry], kind: str) -> list[str]:
    """Return whom a fault befalls; nobody if that was reported."""
    if "agent" not in keys:
        return [agent for agent in book.types if kind in _FOR_ALL and not book.is_human(agent)]
    at = read_name(keys["agent"].value, book.problems, "agent")
    if at is None:
        return []
    if at.text not in book.types:
        book.nobody(at, list(book.types))
        return []
    if kind in FOR_DRONES and book.is_human(at.text):
        book.problems.add("E013", at.mark, f"'{at.text}' is a person: {FOR_DRONES[kind]}", "name a drone")
    return [at.text]


def _begin(book: Book, keys: Mapping[str, Entry], kind: FaultKind, at: Micros) -> ScenarioFault:
    as_id = read_name(keys["as"].value, book.problems, "as") if "as" in keys else None
    code = read_name(keys["code"].value, book.problems, "code") if "code" in keys else None
    text = read_text(keys["text"].value, book.problems, "text") if "text" in keys else None
    percent = book.quantity(keys, "charge", "percent", 100.0)
    if not 0.0 <= percent <= 100.0:
        book.problems.add("E062", keys["charge"].value.mark, "'charge' must lie between 0 % and 100 %")
    east, north = (
        book.quantity(keys, side, "distance" if kind == "drift" else "speed", 0.0) for side in ("east", "north")
    )
    if kind == "drift" and max(abs(east), abs(north)) > MOST_DRIFT_M:
        side = "east" if abs(east) > MOST_DRIFT_M else "north"
        book.problems.add(
            "E062", keys[side].value.mark, f"'{side}' must lie between {-MOST_DRIFT_M:g} m and {MOST_DRIFT_M:g} m"
        )
    event = read_name(keys["event"].value, book.problems, "event") if "event" in keys else None
    return ScenarioFault(
        at,
        "",
        kind,
        event=event.text if event is not None else "",
        count=book.whole(keys, "count", 1, least=1),
        as_id=as_id.text if as_id is not None else "somebody_else",
        code=code.text if code is not None else "not_now",
        delay_s=book.duration(keys, "delay", 0.0),
        vanishes=book.word(keys, "presence", ("gone", "stays"), "gone") == "gone",
        percent=percent,
        east=east,
        north=north,
        check=book.word(keys, "check", CHECKS),
        text=text.text if text is not None else "broken",
    )
