"""Events of people at this engine's desk: over HTTP to the task that waits for them, and what is refused."""

import pytest

from formiga_bt.base.geo import Place
from formiga_bt.lang.model import Site
from formiga_bt.lang.request.binding import bind_fields
from formiga_bt.lang.types import BOOL, DISTANCE, INT, PLACE, TEXT
from tests.golden import Wording
from tests.unit.services.conftest import Start

SITE = Site(name="meadow", lat=66.5, lng=25.7, places={"camp": Place(30.0, -5.0)})
TYPES = {"force": INT, "at": PLACE, "far": DISTANCE, "sure": BOOL, "said": TEXT}
FELL = {"force": "3", "at": "camp", "far": "60 m", "sure": "true", "said": "help: me"}


@pytest.mark.network
def test_an_event_over_http_reaches_the_task_that_waits_for_it(start: Start) -> None:
    with start(desk={"picker_1": "picker"}) as service:
        task_id = service.submit("Sos")
        service.wait(lambda: service.task(task_id)["running"])

        told = service.post("/v1/agents/picker_1/events", {"event": "sos"})

        assert told["text"] == "picker_1 reports sos"
        assert service.ends(task_id)["status"] == "SUCCEEDED"


@pytest.mark.network
def test_what_cannot_be_told_here_is_refused(start: Start, wording: Wording) -> None:
    with start(desk={"picker_1": "picker"}) as service:
        service.wire.add("picker_2", "picker", service.host.site.places["camp"], mobility="people")
        service.wait(lambda: len(service.get("/v1/agents")["agents"]) == 3)

        def refusal(agent: str, **body: object) -> tuple[int, str]:
            found = service.refused("POST", f"/v1/agents/{agent}/events", body)
            wording(found["text"], found["help"])
            return found["status"], found["code"]

        assert refusal("eve", event="sos") == (404, "unknown_agent")
        assert refusal("picker_2", event="sos") == (409, "not_here")
        assert refusal("lwd_1", event="sos") == (409, "not_here")
        assert refusal("picker_1", event="soss") == (404, "unknown_event")
        assert refusal("picker_1", event="sos", fields={"loud": True}) == (422, "bad_fields")
        assert refusal("picker_1", what="sos") == (422, "bad_request")


def test_fields_are_read_as_the_language_reads_them() -> None:
    values, problems, _ = bind_fields("fell", TYPES, FELL, SITE)

    assert problems == []
    assert values == {"force": 3, "at": Place(30.0, -5.0), "far": 60.0, "sure": True, "said": "help: me"}


@pytest.mark.parametrize(
    ("change", "code", "message"),
    [
        ({"force": "three"}, "E016", "'three'"),
        ({"far": "60"}, "E017", "60 m"),
        ({"forse": "3"}, "E022", "fell has no field 'forse'; did you mean 'force'?"),
        ({"force": None}, "E022", "fell needs 'force' (int)"),
    ],
)
def test_fields_that_do_not_fit_are_refused(change: dict[str, str | None], code: str, message: str) -> None:
    given = {name: text for name, text in {**FELL, **change}.items() if text is not None}
    _, problems, sources = bind_fields("fell", TYPES, given, SITE)

    assert problems[0].code == code
    assert message in problems[0].message
    assert problems[0].mark.file in sources
