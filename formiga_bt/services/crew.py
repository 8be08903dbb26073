"""Who approved what, and which pilots are on duty: orders and lists for the API, and what of it outlives a start.

Approvals are kept in the site's runtime folder, one line each time a person gives or takes one back. Duty outlives a short
outage of an engine with a journal; after a longer one (`resume_hold_after`) nobody is on duty until they say so.
"""

from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import TaskError
from formiga_bt.base.site_folder import APPROVALS, append_line, read_lines
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import Approve, Duty, EngineStep
from formiga_bt.engine.kernel.library import Bundles
from formiga_bt.engine.kernel.records import Approval
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.site.keys import APPROVERS
from formiga_bt.safety.approval import RULES, TYPED, approval_digest, lands_away, rules_digest
from formiga_bt.services.order_taker import OrderTaker, PersonalOrders
from formiga_bt.services.refused import Refused
from formiga_bt.services.view import EngineView
from formiga_bt.show.facts import ApprovalFact, ApprovalList, DraftFact, PilotFact, PilotList, ServedFact


def standing(folder: Path) -> list[ApprovalFact]:
    """Return the approvals that stand, as the runtime folder tells: given and not taken back.

    Raises:
        SiteError: the file cannot be read.
    """
    found: dict[str, ApprovalFact] = {}
    for line in read_lines(folder / APPROVALS):
        digest = str(line.get("digest", ""))
        found.pop(digest, None)
        if digest and not line.get("revoke") and isinstance(line.get("at_us"), int):
            found[digest] = ApprovalFact(digest=digest, task=str(line["task"]), by=str(line["by"]), at=line["at_us"])
    return list(found.values())


def taken_back(folder: Path, approvals: Iterable[str]) -> tuple[str, ...]:
    """Return those of the approvals (digests) of a journal that were taken back, as the runtime folder tells.

    They are if the file's last word of them is that. It alone knows of those that were taken back while no engine ran, or right
    before one was killed.

    Raises:
        SiteError: the file cannot be read.
    """
    last = {str(line.get("digest", "")): line for line in read_lines(folder / APPROVALS)}
    return tuple(digest for digest in approvals if last.get(digest, {}).get("revoke"))


def keep(folder: Path, *, digest: str, task: str, by: str, at: Micros, revoke: bool = False) -> None:
    """Add a line about an approval; it is on disk when this returns.

    Raises:
        SiteError: the file cannot be written.
    """
    append_line(folder / APPROVALS, line_of(digest=digest, task=task, by=by, at=at, revoke=revoke))


def line_of(*, digest: str, task: str, by: str, at: Micros, revoke: bool = False) -> dict[str, Any]:
    """Return the line about an approval."""
    line: dict[str, Any] = {"digest": digest, "task": task, "by": by, "at_us": at, "at": utc(at)}
    return {**line, "revoke": True} if revoke else line


def lines_of(step: EngineStep) -> list[dict[str, Any]]:
    """Return the lines about what a step did to approvals; those that were restored have theirs already."""
    given = step.input
    if not isinstance(given, Approve) or given.at:
        return []
    return [
        line_of(digest=given.digest, task=given.task, by=given.by, at=step.at, revoke=given.revoke)
        for change in step.changes
        if isinstance(change, ch.ApprovalPut)
    ]


def restore(folder: Path, driver: OrderTaker) -> None:
    """Tell a new engine what stands. One by a person who is no approver any more is passed over."""
    for one in standing(folder):
        try:
            driver.ask(Approve(one.digest, one.task, one.by, at=one.at))
        except TaskError as error:
            if error.code != "not_approver":
                raise


def utc(at: Micros) -> str:
    """Return an instant of engine time as ISO text in UTC, whole seconds."""
    return datetime.fromtimestamp(at // 1_000_000, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


class Crew:
    """The orders and lists behind the API.

    Args:
        orders: gives them to the running engine.
        view: the engine's read-only copy.
        site, tasks, catalogue: what the engine was made of.
    """

    def __init__(
        self, orders: PersonalOrders, view: EngineView, site: Site, tasks: Bundles, catalogue: Catalogue
    ) -> None:
        self._orders = orders
        self._view = view
        self._site = site
        self._tasks = tasks
        self._catalogue = catalogue

    def approvals(self) -> ApprovalList:
        """Return every task that is served, whether it is approved, and the approvals of other versions that stand."""
        with self._view.reading() as state:
            given, drafted = dict(state.approvals), dict(state.drafted)
        tasks = []
        for name in sorted(self._tasks):
            digest = approval_digest(self._tasks[name], self._site)
            found = given.pop(digest, None)
            wrote = drafted.get(self._tasks[name].bundle)
            tasks.append(
                ServedFact(
                    task=name, digest=digest, lands_away=tuple(lands_away(self._tasks[name], self._catalogue)),
                    drafted=DraftFact(by=wrote.by, model=wrote.model, also=wrote.also) if wrote else None,
                    approval=_approval(digest, found) if found else None,
                )
            )  # fmt: skip
        if self._site.rules:
            digest = rules_digest(self._site)
            found = given.pop(digest, None)
            tasks.append(
                ServedFact(
                    task=RULES,
                    digest=digest,
                    lands_away=(),
                    drafted=None,
                    approval=_approval(digest, found) if found else None,
                )
            )
        others = tuple(_approval(digest, one) for digest, one in given.items())
        return ApprovalList(mode=self._site.mode, tasks=tuple(tasks), others=others)

    def approve(self, task: str, digest: str, typed: str, by: str, *, secret: str = "", revoke: bool = False) -> str:
        """Approve a task that is served, or take that back; return what happened.

        Raises:
            Refused: not by an approver, or without their secret (`Proofs.check`); unknown task, a digest that is not the one
                served, or not typed.
        """
        self._orders.prove(by, secret, self._site.people.get(APPROVERS, ()))
        if task == RULES and self._site.rules:
            return self._approve_rules(digest, typed, by, revoke=revoke)
        model = self._tasks.get(task)
        digests = [approval_digest(one, self._site) for one in self._tasks.versions(task)]
        served = approval_digest(model, self._site) if model is not None else ""
        served = digest if digest in digests else served  # an older version is approved as well, if it is meant
        if revoke:
            self._orders.give(Approve(digest or served, task, by, revoke=True))
            return f"the approval of {task} ({(digest or served)[:TYPED]}) is taken back"
        if model is None:
            raise Refused(
                "unknown_task", f"the engine serves no task '{task}'", "have it read the file: formiga load FILE"
            )
        if digest != served:
            raise Refused(
                "not_served",
                f"the engine serves another version of {task}: {served[:TYPED]}",
                f"its file changed since the engine read it; let it read it anew: formiga load {model.mark.file}",
            )
        if typed != served[:TYPED]:
            raise Refused(
                "not_confirmed",
                "no program approves: `typed` must be the first 8 characters of the digest, as a person typed them",
                f"formiga approve {task} --by {by or 'NAME'} shows what there is to read, and asks",
            )
        self._orders.give(Approve(served, task, by))
        return f"{task} ({served[:TYPED]}) is approved by {by}"

    def _approve_rules(self, digest: str, typed: str, by: str, *, revoke: bool) -> str:
        """Approve the standing rules of the site, or take that back (`approve`)."""
        served = rules_digest(self._site)
        if revoke:
            self._orders.give(Approve(digest or served, RULES, by, revoke=True))
            return f"the approval of the rules ({(digest or served)[:TYPED]}) is taken back"
        if digest != served:
            raise Refused(
                "not_served",
                f"the engine has other rules: {served[:TYPED]}",
                "their files changed since the engine read them; it reads them when it starts: formiga down, then formiga up",
            )
        if typed != served[:TYPED]:
            raise Refused(
                "not_confirmed",
                "no program approves: `typed` must be the first 8 characters of the digest, as a person typed them",
                f"formiga approve {RULES} --by {by or 'NAME'} shows what there is to read, and asks",
            )
        self._orders.give(Approve(served, RULES, by))
        return f"the rules ({served[:TYPED]}) are approved by {by}"

    def duties(self) -> PilotList:
        """Return the site's pilots: how many machines each may have, has, and since when each is on duty."""
        with self._view.reading() as state:
            pilots = []
            for pilot, most in self._site.pilots.items():
                mine = {t.id for t in state.tasks.values() if t.agents.pilot == pilot and t.section != "done"}
                machines = tuple(a.id for a in state.agents.values() if a.task in mine and not a.human)
                since = state.duty.get(pilot)
                pilots.append(PilotFact(pilot=pilot, since=since, max_airborne=most, machines=machines))
        return PilotList(mode=self._site.mode, pilots=tuple(pilots))

    def duty(self, pilot: str, by: str, *, on: bool, secret: str = "") -> str:
        """Put a pilot on duty, or take them off; return what happened.

        Raises:
            Refused: no pilot of this site, or without their secret (`Proofs.check`).
        """
        self._orders.prove(pilot, secret, self._site.pilots)
        self._orders.give(Duty(pilot, on, pilot if self._orders.needs_proof else by))
        still = next((one.machines for one in self.duties().pilots if one.pilot == pilot), ())
        left = f"; still under that name: {', '.join(still)}" if still and not on else ""
        return f"{pilot} is {'on' if on else 'off'} duty{left}"


def _approval(digest: str, given: Approval) -> ApprovalFact:
    return ApprovalFact(task=given.task, digest=digest, by=given.by, at=given.at)
