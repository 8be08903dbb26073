"""Flies a program in the paper's form: the program in its jail, the fleet here."""

from experiments.e2_llm.flown import Flown
from experiments.e2_llm.fly import Scene, World
from experiments.e2_llm.paper_form.child import Child, GoneError, Limits, TooLongError
from experiments.e2_llm.paper_form.flight import PaperFleet, TaskOverError, WrongCallError


def fly_program(code: str, world: World, scene: Scene | None = None, limits: Limits | None = None) -> Flown:
    """Run a program and return what was flown. What its check refuses is `REFUSED`.

    Raises:
        NoSandboxError: this machine cannot lock it up.
    """
    allowed = limits or Limits()
    fleet = PaperFleet(world, scene or Scene())
    try:
        with Child(code, allowed) as child:
            how = _talk(child, fleet, allowed.calls)
        return fleet.flown(*how)
    finally:
        fleet.close()


def _talk(child: Child, fleet: PaperFleet, calls: int) -> tuple[str, str, str]:
    """Answer the program until it ends; return status, code and reason."""
    try:
        for _ in range(calls):
            question = child.hear()
            if question["do"] == "end":
                return _ended(str(question.get("how")), str(question.get("text"))[:300])
            try:
                said = fleet.answer(question)
            except WrongCallError as error:
                said = {"error": str(error)}
            child.say(said)
    except TaskOverError as over:
        return over.status, over.code, str(over)
    except TooLongError as error:
        return "UNFINISHED", "too_long", str(error)
    except GoneError as error:
        return "FAILED", "program_died", str(error)
    return "UNFINISHED", "too_many_calls", f"more than {calls} calls"


def _ended(how: str, text: str) -> tuple[str, str, str]:
    return {"done": ("SUCCEEDED", "", ""), "refused": ("REFUSED", "check", text)}.get(
        how, ("FAILED", "exception", text)
    )
