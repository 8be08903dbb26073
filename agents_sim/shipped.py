"""The types that ship, as plain data: for an agent that is started by hand, and for tests, where no catalogue is read."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from agents_sim.kinds import Kind, SimAction
from agents_sim.limits import DRONE_TYPES, PERSON_TYPES, TRACKED_TYPES, DroneLimits
from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.clock import SECOND

_FLYING: Final[Mapping[str, SimAction]] = MappingProxyType(
    {
        "TakeOff": SimAction(requires="grounded", effect="airborne"),
        "GoTo": SimAction(requires="airborne", moves_to="to"),
        "LandIn": SimAction(requires="airborne", moves_to="at", effect="grounded"),
        "Explore": SimAction(requires="airborne", result={"coverage": 0.0, "cells": 0, "seen": 0, "finds": []}),
        "CutMotors": SimAction(effect="grounded", cuts=True),
    }
)
_ASKED: Final[Mapping[str, SimAction]] = MappingProxyType({CONFIRM: SimAction()})
_TRACKED: Final[Mapping[str, SimAction]] = MappingProxyType({**_ASKED, "MiniFinder": SimAction(typical_us=2 * SECOND)})


def _numbers(limits: DroneLimits) -> dict[str, float]:
    said: dict[str, Any] = {name: getattr(limits, name) for name in limits.__struct_fields__}
    return {name: number for name, number in said.items() if number is not None}


DRONE: Final = Kind(mobility="air", actions=_FLYING)
PERSON: Final = Kind(mobility="people", actions=_ASKED)
KINDS: Final[Mapping[str, Kind]] = MappingProxyType(
    {
        **{
            name: Kind(mobility="air", actions=_FLYING, limits=_numbers(limits)) for name, limits in DRONE_TYPES.items()
        },
        **{
            name: Kind(mobility="people", actions=_TRACKED if name in TRACKED_TYPES else _ASKED)
            for name in PERSON_TYPES
        },
    }
)
