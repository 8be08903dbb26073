"""The effective envelope of a machine for a task: the strictest of its type, its site and the task.

Nobody can loosen: each source only tightens. `keep_in` and `keep_out` hold wherever the site has a fence or no-fly regions.
Asked by the gate and the fleet, for each goal and status; a `RuleBook` keeps the answers.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, Literal

from msgspec import Struct

from formiga_bt.lang.model import AgentType, Site

Reaction = Literal["return", "hold"]

DEFAULTS: Final[Mapping[str, float]] = MappingProxyType(
    {
        "reserve_pct": 25.0,
        "max_height_m": 120.0,
        "terrain_clearance_m": 5.0,
        "people_clearance_m": 15.0,
        "link_silence_s": 10.0,
        "wind_max_m_s": 10.0,
        "daylight_only": 0.0,
        "max_speed_m_s": math.inf,
    }
)
"""What holds when neither type, nor site, nor task says anything."""

MORE_IS_STRICTER: Final = frozenset({"reserve_pct", "terrain_clearance_m", "people_clearance_m", "daylight_only"})
"""Of these the largest number counts, of the others the smallest."""

REACTIONS: Final[Mapping[str, Reaction]] = MappingProxyType(
    {
        "reserve": "return",
        "max_height": "hold",
        "keep_in": "return",
        "keep_out": "hold",
        "terrain_clearance": "hold",
        "wind_max": "return",
        "daylight_only": "return",
        "position": "hold",
        "way": "hold",
    }
)
"""What a machine does at a breach in flight unless its type or site says else. `hold` = stop for 5 s, then return."""


class Rules(Struct, frozen=True, kw_only=True):
    """The limits of one machine for one goal; SI, percent 0..100."""

    reserve_pct: float = DEFAULTS["reserve_pct"]
    max_height_m: float = DEFAULTS["max_height_m"]
    """Over the ground."""
    terrain_clearance_m: float = DEFAULTS["terrain_clearance_m"]
    people_clearance_m: float = DEFAULTS["people_clearance_m"]
    link_silence_s: float = DEFAULTS["link_silence_s"]
    wind_max_m_s: float = DEFAULTS["wind_max_m_s"]
    daylight_only: bool = False
    max_speed_m_s: float = math.inf
    keep_in: bool = False
    """The site has a fence."""
    keep_out: bool = False
    """The site has no-fly regions."""
    on_breach: Mapping[str, Reaction] = REACTIONS

    def reaction(self, name: str) -> Reaction:
        """Return what a machine does at a breach of the limit called `name`."""
        return self.on_breach.get(name, "return")


_NONE: Final[Mapping[str, float]] = MappingProxyType({})


def rules_of(agent_type: AgentType, site: Site, task_envelope: Mapping[str, float] = _NONE) -> Rules:
    """Return the strictest of what a type, a site and a task ask for.

    Args:
        agent_type: its `limits` and `on_breach`.
        site: its `envelope`, `on_breach`, fence and no-fly regions; its reactions rank above the type's.
        task_envelope: `Task.envelope`.
    """
    sources = (agent_type.limits, site.envelope, task_envelope)
    found: dict[str, float] = {}
    for name, default in DEFAULTS.items():
        given = [float(source[name]) for source in sources if name in source]
        found[name] = (max if name in MORE_IS_STRICTER else min)(given) if given else default
    reactions: dict[str, Reaction] = dict(REACTIONS)
    for source in (agent_type.on_breach, site.on_breach):
        reactions.update({name: "hold" if word == "hold" else "return" for name, word in source.items()})
    return Rules(
        reserve_pct=found["reserve_pct"],
        max_height_m=found["max_height_m"],
        terrain_clearance_m=found["terrain_clearance_m"],
        people_clearance_m=found["people_clearance_m"],
        link_silence_s=found["link_silence_s"],
        wind_max_m_s=found["wind_max_m_s"],
        daylight_only=found["daylight_only"] > 0.0,
        max_speed_m_s=found["max_speed_m_s"],
        keep_in=site.fence is not None,
        keep_out=bool(site.no_fly),
        on_breach=MappingProxyType(reactions),
    )


class RuleBook:
    """The rules of a site's machines, each worked out once.

    Args:
        site: as for `rules_of`.
    """

    def __init__(self, site: Site) -> None:
        self._site = site
        self._known: dict[tuple[str, frozenset[tuple[str, float]]], Rules] = {}

    def of(self, agent_type: AgentType, task_envelope: Mapping[str, float] = _NONE) -> Rules:
        """Return the rules of a type for a task; types are told apart by their names."""
        key = agent_type.name, frozenset(task_envelope.items())
        rules = self._known.get(key)
        if rules is None:
            rules = self._known[key] = rules_of(agent_type, self._site, task_envelope)
        return rules
