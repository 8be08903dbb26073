"""A run in virtual time whose steps go into a ledger as they are made, and what a source says of it."""

from formiga_bt.rehearsal.rehearsal import Rehearsal
from formiga_bt.show.facts import StepFact
from formiga_bt.show.history.folded import FoldedSource
from formiga_bt.show.history.ledger import Bounds, Ledger


def source_of(run: Rehearsal, bounds: Bounds | None = None) -> FoldedSource:
    """Return a source over everything that a run has done and will do."""
    ledger, core = Ledger(bounds), run.engine.core
    for step in run.steps:
        ledger.feed(step)
    run.driver.listeners.append(ledger.feed)
    return FoldedSource(ledger, core.site, core.models, core.catalogue, clock=lambda: run.now)


def step_of(source: FoldedSource, task: str, path: str) -> StepFact:
    """Return how a step stands."""
    return next(fact for fact in source.task(task).steps if fact.path == path)


def told(source: FoldedSource, task: str) -> dict[str, str]:
    """Return path -> status and note of every step of a task."""
    return {fact.path: f"{fact.status} {fact.note}".strip() for fact in source.task(task).steps}
