"""The keys of the Zenoh wire, in one table: who writes each, how, and who reads it.

Both ends of the wire take their keys from here, the rules of a router are made of it (`zenoh_rules.py`), and docs/wire.md
has the same rows (`tests/unit/transport/test_wire_doc.py`). All keys lie below the site's name.
"""

from typing import Final, Literal, NamedTuple

Way = Literal["put", "query", "presence"]
"""Told as it happens; answered when somebody asks; a token that stands as long as its session."""
Reader = Literal["engine", "agents", "simulated", "callers"]
"""`simulated`: the agents of a site in mode simulation. `callers`: agents and programs, each under its own name."""


class WireKey(NamedTuple):
    """A key of an agent, below `<type>/<id>/`, or of the engine: below `engine/`, or `svc/<principal>/`.

    `*` is one word of any kind, `**` any number of them.
    """

    owner: Literal["agent", "engine", "svc"]
    rest: str
    ways: tuple[Way, ...]
    reader: Reader

    def of(self, agent_type: str, name: str) -> str:
        """Return an agent's own key, or with `*` that of all agents; an engine's is what it is, but for callers."""
        match self.owner:
            case "agent":
                return f"{agent_type}/{name}/{self.rest}"
            case "engine":
                return f"engine/{self.rest}"
            case "svc":
                return f"svc/{name}/{self.rest}"

    @property
    def of_all(self) -> str:
        """Return the key expression that readers name."""
        return self.of("*", "*")


ALIVE: Final = WireKey("agent", "alive", ("presence",), "engine")
CARD: Final = WireKey("agent", "card", ("query", "put"), "engine")
STATUS: Final = WireKey("agent", "status", ("put",), "engine")
GOALS: Final = WireKey("agent", "goals", ("query",), "engine")
GOAL: Final = WireKey("agent", "action/*/goal", ("query",), "engine")
CANCEL: Final = WireKey("agent", "action/*/cancel", ("query",), "engine")
UPDATE: Final = WireKey("agent", "action/*/update", ("query",), "engine")
EVENT: Final = WireKey("agent", "action/*/event", ("put",), "engine")
TOLD: Final = WireKey("agent", "event/*", ("put",), "engine")
MOTION: Final = WireKey("agent", "motion", ("put",), "simulated")
CLOCK: Final = WireKey("engine", "clock", ("put",), "agents")
SITE: Final = WireKey("engine", "site", ("put", "query"), "agents")
FILES: Final = WireKey("engine", "attachments/*", ("query",), "agents")
ENGINE_ALIVE: Final = WireKey("engine", "alive", ("presence",), "agents")
CALLS: Final = WireKey("svc", "**", ("query",), "callers")

KEYS: Final = (
    ALIVE, CARD, STATUS, GOALS, GOAL, CANCEL, UPDATE, EVENT, TOLD, MOTION, CLOCK, SITE, FILES, ENGINE_ALIVE, CALLS,
)  # fmt: skip
