"""Every task and machine can be explained at every moment of a day on which much goes wrong."""

from formiga_bt.base.packaged import files, folder
from formiga_bt.lang.loader import load_catalogue
from formiga_bt.lang.scenario import load_scenario
from formiga_bt.rehearsal.simulation import VirtualRun
from formiga_bt.show.history.ledger import Ledger
from formiga_bt.show.why.front import explain
from formiga_bt.show.why.text import in_words

ALL = {
    "busy", "battery", "cannot_continue", "chosen", "cleanup", "control", "envelope.reserve", "gate.clearance",
    "gate.leg_busy", "goal.running", "held.clearance", "held.lockdown", "held.take-over", "interrupted", "lockdown",
    "no_clearance", "order.return", "question", "recover", "suspect", "task", "taken_over", "where",
}  # fmt: skip
"""Codes that a bad day has."""


def test_all_of_a_bad_day_can_be_explained() -> None:
    catalogue, _, _ = load_catalogue(files("actions"))
    scenario = load_scenario(folder("trees") / "scenarios" / "bad-day.yaml", catalogue=catalogue).scenario
    assert scenario is not None
    run = VirtualRun(scenario)
    assert run.run()
    ledger, codes, texts = Ledger(), set(), []
    models = {task.name: task for task in scenario.tasks.values()}
    for number, step in enumerate(run.steps):
        ledger.feed(step)
        if number % 20:
            continue
        for of in [*ledger.state.tasks, *ledger.state.agents]:
            actions = [row.fact() for row in ledger.stories[of].rows] if of in ledger.stories else ()
            headline, lines = explain(
                ledger.state, models, of, step.at, catalogue=catalogue, wall=step.at, actions=actions
            )
            assert lines
            assert [line.depth for line in lines if line.depth > 8] == []
            codes |= {line.code for line in lines}
            texts.append(in_words(headline, lines))
    run.close()

    assert codes >= ALL
    assert [text for text in texts if "None" in text or "{" in text or "-1 s" in text] == []
