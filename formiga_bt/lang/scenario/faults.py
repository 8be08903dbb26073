"""Reads the faults of a scenario. One that lasts for a while becomes two: its begin and its end."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from msgspec import structs

from formiga_bt.base.clock import micros
from formiga_bt.lang.keyed import Keys, read_keys
from formiga_bt.lang.scenario.book import Book
from formiga_bt.lang.scenario.entries import FaultKind, ScenarioFault
from formiga_bt.lang.scenario.options import ENDS, FAULT, FAULTS, FOR_DRONES
from formiga_bt.lang.text.document import Mapping_
from formiga_bt.lang.text.reading import did_you_mean, quoted_list, read_word

_KINDS: Mapping[str, FaultKind] = {one: one for one in FAULTS}  # type: ignore[misc]  # its keys are the kinds
_FIELDS: Mapping[str, str] = {
    "count": "count", "as": "as_id", "code": "code", "delay": "delay_s", "presence": "vanishes", "charge": "percent",
    "east": "east", "north": "north", "event": "event", "check": "check", "text": "text",
}  # fmt: skip
"""Options of faults -> fields of a fault."""
_FOR_ALL = ("wind",)
"""Faults that befall every drone if no agent is named."""


def read_faults(book: Book, mappings: Iterable[Mapping_] | None = None) -> list[ScenarioFault]:
    """Return faults, begins and ends, as they are written: these, or all of a scenario."""
    found = []
    for mapping in book.keys.mappings("faults", "fault") if mappings is None else mappings:
        found += _fault(book, mapping)
    return found


def _fault(book: Book, mapping: Mapping_) -> list[ScenarioFault]:
    entry = mapping.get("kind")
    kind = read_word(entry.value, book.problems, "kind", tuple(FAULTS)) if entry is not None else ""
    every = tuple({o.name: structs.replace(o, required=False) for options in FAULTS.values() for o in options}.values())
    owner = f"the fault '{kind}'" if kind else "a fault"
    general = [structs.replace(o, required=False) if o.name == "agent" and kind in _FOR_ALL else o for o in FAULT]
    keys = read_keys(mapping, (*general, *(FAULTS[kind] if kind else every)), book.problems, owner)
    lasts = keys.number("for") if "for" in keys else 0.0
    agents = _agents(book, keys, kind)
    at = micros(keys.number("at"))
    if not kind:
        return []
    given: dict[str, Any] = {_FIELDS[key]: keys.value(key) for key in keys if key in _FIELDS}
    if "vanishes" in given:
        given["vanishes"] = given["vanishes"] == "gone"
    begin = ScenarioFault(at, "", _KINDS[kind], **given)
    if begin.event:
        begin = replace(begin, fields=_event_fields(book, keys, begin.event, agents))
    ends = [replace(begin, at=begin.at + micros(lasts), kind=ENDS[kind], on=False, delay_s=0.0)] if lasts > 0.0 else []
    return [replace(one, agent=agent) for agent in agents for one in (begin, *ends)]


def _event_fields(book: Book, keys: Keys, event: str, agents: list[str]) -> dict[str, Any]:
    """Return the fields of an event; E021: an agent of its type never reports it, E022: the fields are not its own."""
    node, found = keys["event"].value, dict[str, Any]()
    for agent in agents:
        known = book.catalogue.types[book.types[agent]].events
        if event not in known:
            what = f"{book.types[agent]} has no event '{event}'{did_you_mean(event, known)}"
            told = f"events: {quoted_list(known)}" if known else "it reports no events"
            book.problems.add("E021", node.mark, what, told)
            continue
        before = len(book.problems.found)
        found = book.fields(keys["fields"], known[event], event, "reports") if "fields" in keys else {}
        missing = [name for name in known[event] if name not in found]
        if missing and not book.problems.has_errors(before):
            mark = keys["fields"].value.mark if "fields" in keys else node.mark
            book.problems.add("E022", mark, f"event '{event}' lacks {quoted_list(missing)}", "add fields:")
    return found


def _agents(book: Book, keys: Keys, kind: str) -> list[str]:
    """Return whom a fault befalls; nobody if that was reported."""
    if "agent" not in keys:
        return [agent for agent in book.types if kind in _FOR_ALL and not book.is_human(agent)]
    at = keys.name("agent")
    if at is None:
        return []
    if at.text not in book.types:
        book.nobody(at, list(book.types))
        return []
    if kind in FOR_DRONES and book.is_human(at.text):
        book.problems.add("E013", at.mark, f"'{at.text}' is a person: {FOR_DRONES[kind]}", "name a drone")
    return [at.text]
