"""Routes of the tasks that are served: thin, over `Loading`. `api` builds them into its app."""

import time
from collections.abc import Sequence

from fastapi import FastAPI

from formiga_bt.safety.drafted import drafted
from formiga_bt.services.loading import Loading
from formiga_bt.services.not_served import NotServed
from formiga_bt.services.replies import library_models as m


def add(app: FastAPI, loading: Loading, refused: Sequence[NotServed]) -> None:
    """Add the routes to an app; `refused`: the files that the start passed over."""

    @app.get("/v1/library", tags=["engine"])
    def library() -> m.LibraryOut:
        """List the tasks that can be requested, with their parameters and versions."""
        return loading.library(refused)

    @app.post("/v1/library", tags=["engine"])
    def load(body: m.LoadBody) -> m.LoadOut:
        """Check a task and serve it to new requests; running tasks go on with the version they have. Starts nothing."""
        said = body.drafted
        told = drafted(said.by, said.model, said.also) if said is not None else None
        return loading.load(body.file, body.texts, body.by or "http", int(time.time() * 1000), told)
