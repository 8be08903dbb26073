"""What a simulated drone looks at before it flies, and says in its status while it stands on the ground."""

from collections.abc import Mapping
from typing import Final

from formiga_bt.base.geo import Place
from formiga_bt.transport.messages import Control, PreflightCheck

CHECKS: Final = ("armable", "home", "gnss", "control", "storage", "battery")
"""The names of the checks, in the order in which they are told."""


def preflight(
    control: Control, home: Place | None, battery: float, broken: Mapping[str, str]
) -> tuple[PreflightCheck, ...]:
    """Return all checks: those in `broken` (name -> what the drone says) fail, and `control` if it is not the engine's."""
    says = {
        "home": f"{home.east_m:.0f} E {home.north_m:.0f} N" if home is not None else "none set",
        "battery": f"{battery:.0f} %",
    }
    fails = {**({} if control == "engine" else {"control": f"{control} is in command"}), **broken}
    return tuple(PreflightCheck(name, name not in fails, fails.get(name, says.get(name, ""))) for name in CHECKS)
