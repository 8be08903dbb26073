"""The monitor would find it: each safeguard that is taken out shows in a run that is clean with it."""

import pytest

from tests.safety.planted import PLANTS, Where, is_caught, violations_at, violations_with

STANDS = "standing away from the port"
WHERE: dict[str, Where] = {
    "gate_ignores_control": ("under its pilot", "abort now"),
    "taken_is_forgotten": ("pilot gave back, nobody handed back", "continue the machine"),
    "lockdown_stops_nothing": ("cruising", "lockdown hold"),
    "lockdown_grants": ("just asked for", "lockdown hold"),
    "lockdown_admits": 8,
    "lockdown_leaves_machines_alone": ("cruising", "lockdown hold"),
    "gate_ignores_clearance": (STANDS, "hold the machine"),
    "clearance_never_expires": (STANDS, "hold the machine"),
    "clearance_counts_everywhere": (STANDS, "hold the machine"),
    "a_new_process_is_not_noticed": ("started anew before it was fetched", "continue all"),
    "recover_is_skipped": ("cruising", "abort"),
    "gate_checks_no_limit": 0,
    "gate_checks_ends_only": 17,
    "breach_only_alarms": ("breached", "continue the machine"),
    "no_separation": 69,
    "no_spots": 69,
    "orders_hold_nothing_back": (STANDS, "hold the machine"),
    "held_tasks_go_on": 96,
    "orders_are_not_carried_out": ("cruising", "land the machine"),
    "orders_are_forgotten": ("cruising", "return the machine"),
    "goals_are_sent_again_blindly": 19,
    "returned_machines_are_left": ("quarantined in the air", "clear the machine"),
    "strays_are_not_seen": ("joined in the air", "removed the machine"),
    "strays_that_are_unsure_are_not_seen": ("joined in the air, unsure", "removed the machine"),
    "machines_are_granted_twice": 0,
    "state_changes_behind_the_journal": ("cruising", "abort"),
    "drained_goals_wake_nobody": ("cruising", "abort"),
}
"""A seed, or a state and an order, for each. Seeds are found by `python -m tests.safety.planted`."""


@pytest.mark.parametrize("bug", PLANTS)
def test_a_planted_bug_is_caught(bug: str) -> None:
    found = violations_with(bug, WHERE[bug])

    assert is_caught(bug, found), [str(violation) for violation in found]


@pytest.mark.parametrize("where", dict.fromkeys(WHERE.values()), ids=str)
def test_without_the_bug_it_is_clean(where: Where) -> None:
    assert violations_at(where) == ()
