"""Judges a program in the paper's form by the oracles of the experiment."""

from experiments.e2_llm.authors import Written
from experiments.e2_llm.flown import Flown
from experiments.e2_llm.fly import Scene, World
from experiments.e2_llm.judging import judge
from experiments.e2_llm.paper_form.child import Limits
from experiments.e2_llm.paper_form.fly import fly_program
from experiments.e2_llm.records import Judged, Run, Whose
from experiments.e2_llm.requests import Request


def judged_program(request: Request, code: str, world: World, limits: Limits | None = None) -> Judged:
    """Return a program as judged. Whatever its check does not refuse would have been flown.

    Raises:
        NoSandboxError: this machine cannot lock it up.
    """
    if not code:
        return Judged(valid=False, passed=False, success=False, faults=("no_task",), said="the answer holds no program")
    refusals: list[str] = []

    def flyer(scene: Scene) -> Flown:
        flown = fly_program(code, world, scene, limits)
        if flown.status == "REFUSED":
            refusals.append(flown.reason)
        return flown

    of = "T10" if request.task == "T10+" else request.task
    verdict = judge(of, request.goal, flyer, request.scenes)
    if refusals:
        return Judged(valid=False, passed=False, success=False, faults=("check",), said=refusals[0][:600])
    return Judged(valid=True, passed=True, success=verdict.ok, faults=verdict.codes, said=str(verdict)[:600])


def run_of_program(request: Request, written: Written, world: World, column: str, whose: Whose) -> Run:
    """Return the run of a request, judged: there is one answer, so the first is the last."""
    found = judged_program(request, written.yaml, world)
    return Run(
        provider=whose.provider,
        model=whose.model,
        trained_on=whose.trained_on,
        column=column,
        task=request.task,
        run=request.run,
        words=request.words,
        paper_words=request.paper_words,
        kind=written.kind,
        rounds=len(written.attempts),
        prompt_tokens=sum(one.prompt_tokens for one in written.attempts),
        tokens=sum(one.tokens for one in written.attempts),
        seconds_first=written.seconds,
        seconds=written.seconds,
        first=found,
        last=found,
        yaml_first=written.yaml,
        yaml=written.yaml,
        say=written.say,
    )
