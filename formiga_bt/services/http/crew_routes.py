"""Routes about who may let a task fly: approvals and pilots. Thin, over `Crew`; `api` builds them into its app."""

from typing import Annotated, Any
from urllib.parse import unquote

from fastapi import FastAPI, Header
from pydantic import Field

from formiga_bt.services.crew import Crew
from formiga_bt.services.replies.models import ByBody, Id, Name, Reply, RequestBody

Secret = Annotated[
    str,
    Header(
        alias="Formiga-Secret",
        max_length=2400,
        description="In mode real: the secret of the person who says this (`formiga access secret`), as UTF-8 percent-encoded.",
    ),
]


class ApprovalBody(RequestBody):
    """Approve a task as it is served. `typed`: the first 8 characters of the digest, typed by the person `by`.

    With `revoke` an approval is taken back; then `typed` is not needed.
    """

    task: Id
    by: Id
    digest: Annotated[str, Field(max_length=64)] = ""
    typed: Name = ""
    revoke: bool = False


class DutyBody(ByBody):
    """A pilot goes on duty, or off."""

    on: bool


def add(app: FastAPI, crew: Crew) -> None:
    """Add the routes to an app."""

    @app.get("/v1/approvals", tags=["safety"])
    def approvals() -> dict[str, Any]:
        """List the tasks that are served with their digests and who approved them."""
        return crew.approvals()

    @app.post("/v1/approvals", tags=["safety"])
    def approve(body: ApprovalBody, formiga_secret: Secret = "") -> Reply:
        """Approve a task for flights in mode real, as a person who has read it. No program approves."""
        secret = unquote(formiga_secret)
        return Reply(text=crew.approve(body.task, body.digest, body.typed, body.by, secret=secret, revoke=body.revoke))

    @app.get("/v1/pilots", tags=["safety"])
    def pilots() -> dict[str, Any]:
        """List the site's pilots, who is on duty, and the machines under their names."""
        return crew.duties()

    @app.post("/v1/pilots/{pilot}/duty", tags=["safety"])
    def duty(pilot: str, body: DutyBody, formiga_secret: Secret = "") -> Reply:
        """Put a pilot on duty, or take them off; in mode real they say so themselves."""
        return Reply(text=crew.duty(pilot, body.by or "http", on=body.on, secret=unquote(formiga_secret)))
