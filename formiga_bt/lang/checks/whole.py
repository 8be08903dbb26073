"""All checks of a whole task, in their order. A new one is called here, or in `sense` if all it says is a warning."""

from formiga_bt.lang.checks.deadlock import check_blocks
from formiga_bt.lang.checks.each_step import StepChecks
from formiga_bt.lang.checks.effort import check_effort
from formiga_bt.lang.checks.fleet import check_fleet
from formiga_bt.lang.checks.flight.contention import check_contention
from formiga_bt.lang.checks.flight.landing import check_landings
from formiga_bt.lang.checks.flight.same_machine import check_same_machine
from formiga_bt.lang.checks.flight.spacing import check_spacing
from formiga_bt.lang.checks.flight.whole import check_flight
from formiga_bt.lang.checks.held_back import check_requests
from formiga_bt.lang.checks.resources import check_order, check_waits
from formiga_bt.lang.checks.sampled import Samples
from formiga_bt.lang.checks.sense import check_sense
from formiga_bt.lang.model import MIN_SPACING_M, Catalogue, Site, Task
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.types import agent_type
from formiga_bt.lang.walk import all_roles


def check_task(task: Task, catalogue: Catalogue, problems: Problems, site: Site | None = None) -> None:
    """Report what only the whole task shows, in its own steps and in the subtrees that it sees."""
    min_spacing_m = site.min_spacing_m if site is not None else MIN_SPACING_M
    checks = StepChecks(catalogue, problems)
    types = {role.name: role.types for role in task.roles.values()}
    types |= {param.name: agent_type(param.type).of for param in task.params.values()}
    types |= {role.name: role.types for role in all_roles(task)}
    sections = (
        ("steps", task.steps),
        ("on_failure", task.on_failure),
        ("on_abort", task.on_abort),
        ("finally", task.finally_),
    )
    samples = Samples(task, site, sound=not problems.has_errors())
    contended: frozenset[str] = frozenset()
    for name, steps in sections:
        with problems.within(name):
            checks.check(steps, bounded=False, cleanup=name != "steps")
            contended |= check_contention(steps, types, catalogue, problems)
            contended |= check_same_machine(steps, all_roles(task), (), catalogue, problems)
            check_spacing(steps, catalogue, samples, min_spacing_m, problems)
            check_blocks(steps, catalogue, problems)
            check_waits(steps, site, problems)
    for subtree in task.subtrees.values():
        checks.check_subtree(subtree)
    with problems.within("agents"):
        check_fleet(task, catalogue, site, problems)
    check_order(task, problems)
    check_flight(task, catalogue, problems, contended)
    with problems.within("steps"):
        check_requests(task, catalogue, site, problems)
        check_landings(task, catalogue, problems)
    if not problems.has_errors():  # what was refused has no value
        check_effort(task, catalogue, site, problems)
        check_sense(task, catalogue, site, problems)
