"""Routes about who may let a task fly: approvals and pilots. Thin, over `Crew`; `api` builds them into its app."""

from typing import Annotated
from urllib.parse import unquote

from fastapi import Header

from formiga_bt.base.roles import Deed
from formiga_bt.services.crew import Crew
from formiga_bt.services.http.bodies import ApprovalBody, DutyBody
from formiga_bt.services.http.routes import FactRoutes
from formiga_bt.services.http.speaking import SPEAKER, speaker
from formiga_bt.show.facts import ApprovalList, OrderDone, PilotList

Secret = Annotated[
    str,
    Header(
        alias="Formiga-Secret",
        max_length=2400,
        description="In mode real: the secret of the person who says this (`formiga access secret`), as UTF-8 percent-encoded.",
    ),
]


def add(routes: FactRoutes, crew: Crew) -> None:
    """Add the routes."""

    @routes.get("/v1/approvals", "safety")
    def approvals() -> ApprovalList:
        """List the tasks that are served with their digests and who approved them."""
        return crew.approvals()

    @routes.post("/v1/approvals", "safety", Deed.APPROVE)
    def approve(body: ApprovalBody, formiga_secret: Secret = "") -> OrderDone:
        """Approve a task for flights in mode real, as a person who has read it. No program approves."""
        secret = unquote(formiga_secret)
        by = speaker(body.by)
        return OrderDone(crew.approve(body.task, body.digest, body.typed, by, secret=secret, revoke=body.revoke))

    @routes.get("/v1/pilots", "safety")
    def pilots() -> PilotList:
        """List the site's pilots, who is on duty, and the machines under their names."""
        return crew.duties()

    @routes.post("/v1/pilots/{pilot}/duty", "safety", Deed.DUTY)
    def duty(pilot: str, body: DutyBody, formiga_secret: Secret = "") -> OrderDone:
        """Put a pilot on duty, or take them off; in mode real they say so themselves."""
        return OrderDone(crew.duty(pilot, _pilot(pilot, body.by), on=body.on, secret=unquote(formiga_secret)))


def _pilot(pilot: str, said: str) -> str:
    """Return in whose name a pilot goes on duty: an account goes itself."""
    return speaker(said if SPEAKER.get().is_local else pilot)
