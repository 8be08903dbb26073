"""Routes of the tasks that are served: thin, over `Loading`. `api` builds them into its app."""

import time
from collections.abc import Sequence

from formiga_bt.base.roles import Deed
from formiga_bt.safety.drafted import drafted
from formiga_bt.services.http.bodies import LoadBody
from formiga_bt.services.http.routes import FactRoutes
from formiga_bt.services.http.speaking import require, speaker
from formiga_bt.services.loading import Loading
from formiga_bt.services.not_served import NotServed
from formiga_bt.show.facts import LibraryList, TaskLoaded


def add(routes: FactRoutes, loading: Loading, refused: Sequence[NotServed]) -> None:
    """Add the routes; `refused`: the files that the start passed over."""

    @routes.get("/v1/library", "engine")
    def library() -> LibraryList:
        """List the tasks that can be requested, with their parameters and versions."""
        return loading.library(refused)

    @routes.post("/v1/library", "engine", Deed.LOAD_SIMULATED)
    def load(body: LoadBody) -> TaskLoaded:
        """Check a task and serve it to new requests; running tasks go on with the version they have. Starts nothing."""
        said = body.drafted
        if loading.is_real:
            require(Deed.LOAD)
        told = drafted(said.by, said.model, said.also) if said is not None else None
        return loading.load(body.file, body.texts, speaker(body.by), int(time.time() * 1000), told)
