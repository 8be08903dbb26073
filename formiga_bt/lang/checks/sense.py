"""The checks that ask whether a task makes sense: it can run, but hardly as it is meant. All of them warn.

Called by `checks` for a task without an error.
"""

from formiga_bt.lang.checks.chosen import check_chosen
from formiga_bt.lang.checks.constant_results import check_foregone
from formiga_bt.lang.checks.endings import check_endings
from formiga_bt.lang.checks.flight.layers import check_layers
from formiga_bt.lang.checks.flight.needless_landings import check_system_tasks
from formiga_bt.lang.checks.nesting import check_nesting
from formiga_bt.lang.checks.no_effect import check_no_effect
from formiga_bt.lang.checks.questions import check_questions
from formiga_bt.lang.checks.repeats import check_repeats
from formiga_bt.lang.checks.role_names import check_role_names
from formiga_bt.lang.checks.unheard import check_unheard
from formiga_bt.lang.model import Catalogue, Site, Step, Task
from formiga_bt.lang.text.reading import Problems


def check_sense(task: Task, catalogue: Catalogue, site: Site | None, problems: Problems) -> None:
    """Report what a careful reader would ask about."""
    sections = (
        ("steps", task.steps),
        ("on_failure", task.on_failure),
        ("on_abort", task.on_abort),
        ("finally", task.finally_),
    )
    for name, steps in sections:
        with problems.within(name):
            _check_body(steps, catalogue, problems)
    for subtree in task.subtrees.values():
        with problems.outermost(subtree.name, "steps"):
            _check_body(subtree.steps, catalogue, problems)
    check_chosen(task, catalogue, problems)
    check_layers(task, catalogue, problems)
    check_endings(task, catalogue, problems)
    check_no_effect(task, problems)
    check_foregone(task, catalogue, site, problems)
    with problems.within("agents"):
        check_role_names(task, catalogue, problems)


def _check_body(steps: tuple[Step, ...], catalogue: Catalogue, problems: Problems) -> None:
    check_repeats(steps, catalogue, problems)
    check_nesting(steps, catalogue, problems)
    check_questions(steps, catalogue, problems)
    check_system_tasks(steps, catalogue, problems)
    check_unheard(steps, problems)
