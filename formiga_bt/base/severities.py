"""How loud something is that people are told: one scale for notices, alarms and what leaves the engine."""

from typing import Final, Literal

Severity = Literal["info", "warning", "alarm", "critical"]
SEVERITIES: Final[tuple[Severity, ...]] = ("info", "warning", "alarm", "critical")
"""From the quietest on. A critical one is never held back for the night."""


def at_least(severity: Severity, least: Severity) -> bool:
    """Return whether something is as loud as `least`, or louder."""
    return SEVERITIES.index(severity) >= SEVERITIES.index(least)
