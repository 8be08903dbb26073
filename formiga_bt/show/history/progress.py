"""How far a task has come: for each step of its file which instances run, how often it ended how, and how last.

Folded from what the engine's trees remember (`NodeMem`: an instance runs while it, or a modifier around it, has memory) and
tell (`NodesEnded`). Kept by static path, so it is bounded by the tree however many rounds, items and attempts there are.
"""

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.lang.places import static_path
from formiga_bt.nodes.run import Failure
from formiga_bt.show.facts import StepFact, StepStatus
from formiga_bt.show.history.rows import SECTIONS

STATUS: dict[str, StepStatus] = {"S": "success", "F": "failure", "K": "skipped", "H": "stopped"}


class InstanceEnds(Struct):
    """How the instances of one step ended."""

    how: dict[str, int]
    """Letter of `NodesEnded` -> how often."""
    last: str = ""
    """The letter of the newest end, and the instance that it was of."""
    instance: str = ""
    began_at: Micros | None = None
    ended_at: Micros = 0
    code: str = ""
    reason: str = ""


class Running(Struct):
    """An instance that runs: since when, and how many of its keys (its own, its modifiers') have memory."""

    path: str
    """Static path."""
    began_at: Micros
    keys: int = 1


class Progress:
    """The steps of one task in its present run. Steps that only bring machines home are not in it."""

    def __init__(self, run: int = 1) -> None:
        self.run = run
        self.running: dict[str, Running] = {}
        """Instance -> since when."""
        self.ends: dict[str, InstanceEnds] = {}
        """Static path -> how it ended."""

    # -- folding -----------------------------------------------------------------------------------------------------
    def began(self, key: str, at: Micros) -> None:
        """A node's key has memory now, and had none before."""
        instance = instance_of(key)
        known = self.running.get(instance)
        if known is not None:
            known.keys += 1
        elif instance:
            self.running[instance] = Running(static_path(instance), at)

    def left(self, key: str) -> None:
        """A node's key has no memory any more."""
        instance = instance_of(key)
        known = self.running.get(instance)
        if known is not None:
            known.keys -= 1
            if not known.keys:
                del self.running[instance]

    def ended(self, path: str, letter: str, code: str, at: Micros) -> None:
        """An instance ended."""
        instance = instance_of(path)
        if not instance:
            return
        runs = self.running.get(instance)
        static = runs.path if runs is not None else static_path(instance)
        ends = self.ends.get(static)
        if ends is None:
            ends = self.ends[static] = InstanceEnds({})
        if letter != "H" and ends.last == "H" and ends.instance == instance and ends.ended_at >= _since(runs):
            ends.how["H"] -= 1  # its timeout stopped it, and now tells how it ended
        ends.how[letter] = ends.how.get(letter, 0) + 1
        ends.last, ends.instance, ends.ended_at = letter, instance, at
        ends.began_at = runs.began_at if runs is not None else None
        if letter == "F":
            ends.code, ends.reason = code, ""

    def explain(self, failure: Failure) -> None:
        """Give the words of a failure to the step that it is of; one that raised was stopped by that."""
        ends = self.ends.get(static_path(instance_of(failure.step))) if failure.step else None
        if ends is None:
            return
        if ends.last == "H" and failure.code in ("cannot_compute", "exception", "runaway"):
            ends.how["H"] -= 1
            ends.how["F"] = ends.how.get("F", 0) + 1
            ends.last, ends.code = "F", failure.code
        if ends.last == "F" and ends.code == failure.code:
            ends.reason = failure.reason

    def cut(self, at: Micros) -> None:
        """The task ended or begins anew: whatever still ran was stopped."""
        for instance in list(self.running):
            self.ended(instance, "H", "", at)
        self.running.clear()

    # -- reading -----------------------------------------------------------------------------------------------------
    def facts(self) -> list[StepFact]:
        """Return every step that was begun or skipped, without notes, in no order."""
        counts: dict[str, int] = {}
        newest: dict[str, Micros] = {}
        for one in self.running.values():
            counts[one.path] = counts.get(one.path, 0) + 1
            newest[one.path] = max(one.began_at, newest.get(one.path, 0))
        found = [self._fact(path, ends, counts.pop(path, 0), newest.get(path)) for path, ends in self.ends.items()]
        fresh = [
            StepFact(path=path, status="running", running=count, began_at=newest[path])
            for path, count in counts.items()
        ]
        return [fact for fact in (*found, *fresh) if fact.path.partition("/")[0] in SECTIONS]

    def _fact(self, path: str, ends: InstanceEnds, running: int, began_at: Micros | None) -> StepFact:
        how = ends.how.get
        return StepFact(
            path=path,
            status="running" if running else STATUS[ends.last],
            running=running,
            succeeded=how("S", 0),
            failed=how("F", 0),
            skipped=how("K", 0),
            stopped=how("H", 0),
            began_at=began_at if running else ends.began_at,
            ended_at=None if running else ends.ended_at,
            code=ends.code,
            reason=ends.reason,
        )


def _since(runs: Running | None) -> Micros:
    return runs.began_at if runs is not None else 0


def instance_of(key: str) -> str:
    """Return the instance path of the step that a node's key belongs to; "" for an item of a parallel `for`, which is no step.

    Its own key and those of its modifiers (`:timeout`) and attempts (`@2`) are one instance; a section is its own name.
    """
    cut = key.rfind("]") + 1
    if cut == len(key) or not cut:
        return key
    return "" if "." in key[cut:] else key[:cut]
