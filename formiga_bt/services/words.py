"""What helps against a refusal of the engine, by its code. The words of explanations are in `show.why.words`."""

from collections.abc import Mapping
from typing import Final

from formiga_bt.engine.kernel.replies import Accepted, Done

NOT_KEPT: Final = "not kept: the journal cannot be written, and an engine that is killed now will know nothing of it"
"""Follows the answer to an order that was carried out all the same."""
HINTS: Final[Mapping[str, str]] = {
    "unknown_task": "formiga tasks lists them",
    "unknown_rule": "formiga rules lists them",
    "unknown_alarm": "formiga alarms lists them",
    "already_acknowledged": "formiga alarms shows who",
    "alarm_cleared": "formiga alarms --all shows what became of it",
    "not_waiting": "formiga rules lists what waits",
    "not_approver": "name approvers in site.yaml under people: approvers; the engine reads it when it starts",
    "unknown_pilot": "name pilots in site.yaml under pilots; the engine reads it when it starts",
    "unknown_agent": "formiga agents lists them",
    "unknown_target": "formiga agents and formiga tasks list what there is",
    "already_ended": "formiga why {target} shows how",
    "already_ending": "abort --now skips the rest of its cleanup",
    "busy": "try again when some of the waiting tasks have started",
    "not_alive": "is its process running, and connected to this engine?",
    "still_heard": "formiga agents shows how it is; one that you have looked at: formiga agents clear {target}",
    "not_started": "formiga abort {target}",
    "agent_lost": "find the machine; formiga agents shows when it is heard of again",
    "not_in_command": "formiga agents shows who has it; --all and lockdown reach it when it is handed back",
    "still_in_command": "its pilot gives it back first, at the machine's own remote control",
    "double": "formiga why {target} shows how it stands",
    "not_announced": "stop it otherwise: formiga land {target}, or its pilot takes over",
    "human": "speak to them",
    "not_held": "formiga tasks shows what is held",
    "not_taken_over": "formiga agents shows who has it",
    "order_under_way": "let it come to its end, or: formiga hold {target}",
    "lockdown": "formiga lockdown release",
    "too_old": "look how things stand (formiga agents, formiga tasks), then give the order again",
    "no_reply": "formiga tasks and formiga agents show what became of it",
    "not_admitted": "formiga agents add {target}, or list it in site.yaml under agents, with a port as its home",
    "in_site_file": "edit site.yaml under agents; the engine reads it when it starts",
    "not_member": "formiga agents lists the fleet; what the site file lists is taken out there",
    "unknown_type": "formiga catalogue lists the types",
    "unknown_action": "formiga catalogue lists what agents announced",
    "bad_action": "formiga catalogue shows what they announced; write it into a catalogue of your own",
    "unknown_home": "--home NAME, one of the site's ports or stations",
    "home_taken": "--home NAME, another of the site's ports or stations",
    "no_port": "add a port to site.yaml; the engine reads it when it starts",
    "other_type": "formiga agents --unknown shows what it announces",
    "in_use": "formiga agents shows when it rests",
    "journal_gone": "put the journal's files back, or end the engine and start it: formiga down; stops and lockdown work",
    "journal_full": "make room on the journal's disk: formiga journal stats shows where it is; stops, abort and lockdown work",
    "rebooted": "look at the machine, then: formiga agents clear it, and say it again",
    "cut": "look at the machine; nothing takes a cut back",
    "which_role": "formiga assign {target} AGENT --role ROLE",
    "unknown_role": "formiga assign {target} AGENT --role ROLE",
    "needs_nobody": "formiga why {target} tells what it does",
    "unknown_place": "name a region or a place of site.yaml",
    "not_closed": "formiga zone list shows what is closed",
    "not_out": "formiga agents shows how it is",
    "not_assigned": "formiga agents shows who has which task",
    "cannot_begin_anew": "let it end, or end it: formiga abort TASK",
    "already_started": "formiga tasks --status PENDING lists those that wait",
}
"""What helps against a refusal of the engine; `{target}`: what the order was for."""


def with_keeping(text: str, reply: Accepted | Done) -> str:
    """Return the answer to an order, and that it was not kept if the engine's reply says so."""
    return f"{text} ({NOT_KEPT})" if reply == Done(kept=False) else text


def hint_for(code: str, target: str = "") -> str:
    """Return what helps against a refusal, or an empty text."""
    return HINTS.get(code, "").format(target=target or "ID")
