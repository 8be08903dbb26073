"""Questions over real HTTP on the loopback: answers, refusals, waiting, stopping, and what becomes of the key."""

import json
import logging
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.llm.client import open_chat
from formiga_bt.llm.endpoint import Endpoint
from formiga_bt.llm.errors import Cancelled, EndpointRefused, EndpointUnreachable, LlmError, NoKey, TooLong
from formiga_bt.llm.presets import PRESETS, Preset, Price
from formiga_bt.llm.records import Message
from tests.golden import Wording
from tests.unit.llm.fake_endpoint import Answer, FakeEndpoint

pytestmark = pytest.mark.network

ASKED = [Message("system", "You are terse."), Message("user", "Where?")]
SCHEMA = {"type": "object", "properties": {"a": {"type": "string"}}, "required": ["a"], "additionalProperties": False}
CANARY = "sk-canary-0123456789abcdefghijklmnop"


@pytest.fixture(autouse=True)
def connections_are_closed(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    made: list[Endpoint] = []
    init = Endpoint.__init__

    def noted(self: Endpoint, *args: Any, **options: Any) -> None:
        init(self, *args, **options)
        made.append(self)

    monkeypatch.setattr(Endpoint, "__init__", noted)
    yield
    for one in made:
        one.close()


def chat(endpoint: FakeEndpoint, **options: Any) -> Endpoint:
    preset = options.pop("preset", Preset(name="endpoint"))
    return Endpoint(preset, endpoint.base_url, "fake", **{"first_wait_s": 0.0, "whole_s": 30.0, **options})


def test_an_answer_streams_and_is_counted() -> None:
    seen: list[int] = []
    with FakeEndpoint([Answer("north field", usage=(120, 80, 7))]) as endpoint:
        one = chat(endpoint, price=Price(1.0, 2.0, 0.5))
        reply = one.complete(ASKED, None, max_tokens=50, seed=7, on_progress=seen.append)
    assert (reply.text, reply.data, reply.finish, reply.rung) == ("north field", None, "stop", "text")
    assert (reply.usage.prompt, reply.usage.cached, reply.usage.completion) == (120, 80, 7)
    assert reply.usage.cost_usd == pytest.approx((40 * 1.0 + 80 * 0.5 + 7 * 2.0) / 1e6)
    assert seen == [1, 2, 3, 4]
    body = endpoint.requests[0]
    assert body["messages"] == [
        {"role": "system", "content": "You are terse."},
        {"role": "user", "content": "Where?"},
    ]
    assert (body["model"], body["max_tokens"], body["temperature"], body["seed"]) == ("fake", 50, 0.0, 7)
    assert "response_format" not in body


def test_an_answer_that_does_not_stream_is_taken_too() -> None:
    with FakeEndpoint([Answer('{"a": "b"}', stream=False)]) as endpoint:
        reply = chat(endpoint).complete(ASKED, SCHEMA, max_tokens=50)
    assert (reply.data, reply.rung, reply.usage.prompt) == ({"a": "b"}, "schema", 100)


def test_an_answer_that_is_cut_at_its_limit_is_told_and_has_no_data() -> None:
    with FakeEndpoint([Answer('{"a": "b"}', finish="length")]) as endpoint:
        reply = chat(endpoint).complete(ASKED, SCHEMA, max_tokens=5)
    assert (reply.finish, reply.data) == ("length", None)


def test_the_ladder_goes_down_on_refusals_of_the_form_and_remembers() -> None:
    refusals = [
        Answer(status=400, error={"error": {"message": "Invalid schema for response_format", "code": "invalid"}}),
        Answer(status=422, error={"detail": "json_schema is not known"}),
        Answer(status=500, error="should be 'text' or 'json_object'"),
    ]
    with FakeEndpoint([*refusals, '```json\n{"a": "x"}\n```', '```json\n{"a": "y"}\n```']) as endpoint:
        one = chat(endpoint, preset=Preset(name="endpoint", rung="strict"))
        replies = [one.complete(ASKED, SCHEMA, max_tokens=50) for _ in range(2)]
    assert [(reply.rung, reply.data) for reply in replies] == [("text", {"a": "x"}), ("text", {"a": "y"})]
    forms = [(body.get("response_format") or {}).get("type") for body in endpoint.requests]
    assert forms == ["json_schema", "json_schema", "json_object", None, None]
    assert [body["messages"][0]["content"].count("JSON Schema") for body in endpoint.requests] == [0, 0, 1, 1, 1]


def test_one_answer_that_missed_the_form_is_not_remembered() -> None:
    missed = Answer(status=400, error={"error": {"message": "Failed to generate JSON", "code": "json_validate_failed"}})
    with FakeEndpoint([missed, '{"a": "x"}', '{"a": "y"}']) as endpoint:
        one = chat(endpoint)
        assert one.complete(ASKED, SCHEMA, max_tokens=50).rung == "json"
        assert one.complete(ASKED, SCHEMA, max_tokens=50).rung == "schema"


def test_parameters_that_are_not_known_are_left_out() -> None:
    refusals = [
        Answer(status=400, error={"error": {"message": "Unsupported parameter: use the other", "param": "max_tokens"}}),
        Answer(status=400, error="'temperature' does not support 0 with this model; unsupported value"),
        Answer(status=422, error="stream_options: extra inputs are not permitted"),
    ]
    with FakeEndpoint([*refusals, "yes", "again"]) as endpoint:
        one = chat(endpoint)
        assert [one.complete(ASKED, None, max_tokens=50).text for _ in range(2)] == ["yes", "again"]
    last = endpoint.requests[-1]
    assert last["max_completion_tokens"] == 50
    assert not {"max_tokens", "temperature", "stream_options"} & set(last)
    assert len(endpoint.requests) == 5


@pytest.mark.parametrize(
    ("answer", "kind", "words"),
    [
        (Answer(status=400, error="bad things"), EndpointRefused, "{} says no (HTTP 400): bad things"),
        (
            Answer(status=404, error="no such model"),
            EndpointRefused,
            "{} has no model 'fake' (HTTP 404): no such model\n  help: name another with --model, or another address",
        ),
        (
            Answer(status=400, error="request (9031 tokens) exceeds the available context size"),
            TooLong,
            "{}: the question is longer than fake can take: request (9031 tokens) exceeds the available context size\n"
            "  help: a shorter request, or another model",
        ),
        (
            Answer(status=429, error="no", headers={"retry-after": "3600"}),
            EndpointRefused,
            "{}: its limit is reached (HTTP 429); it asks to wait 3600 s: no\n  help: try later, or another provider",
        ),
        (
            Answer(status=429, error={"error": {"message": "no credit", "code": "insufficient_quota"}}),
            EndpointRefused,
            "{}: its limit is reached (HTTP 429): no credit insufficient_quota\n  help: try later, or another provider",
        ),
        (
            Answer(status=301, error="moved", headers={"location": "http://127.0.0.1:9/"}),
            EndpointRefused,
            "{} says no (HTTP 301): moved",
        ),
        (
            Answer(raw=b"<html>a page</html>", kind="text/html"),
            EndpointUnreachable,
            "{}: it sends something else than the protocol of OpenAI (no JSON: <html>a page</html>)\n"
            "  help: is the address right? It often ends in /v1",
        ),
        (
            Answer(raw=b'data: {"error": {"message": "GPU\x1b[2J on fire"}}\n\n'),
            EndpointUnreachable,
            '{}: it sends something else than the protocol of OpenAI (no JSON: {{"error": {{"message": "GPU [2J on fire"}}}})\n'
            "  help: is the address right? It often ends in /v1",
        ),
        (
            Answer("no", finish="content_filter"),
            EndpointRefused,
            "{} holds its answer back: a filter of the provider\n  help: say it in other words",
        ),
        (
            Answer("x" * 200_000, pieces=2000),
            EndpointRefused,
            "{} answers far more than it was asked for; it was stopped\n  help: another model",
        ),
    ],
    ids=["bad", "model", "length", "later", "credit", "redirect", "page", "garbage", "filter", "huge"],
)
def test_refusals_in_words(answer: Answer, kind: type[LlmError], words: str) -> None:
    with FakeEndpoint([answer]) as endpoint:
        with pytest.raises(LlmError) as caught:
            chat(endpoint).complete(ASKED, None, max_tokens=50)
        assert str(caught.value) == words.format(endpoint.base_url)
        assert type(caught.value) is kind
        assert len(endpoint.requests) == 1


@pytest.mark.parametrize(
    "passing",
    [
        Answer(status=429, error="slow down", headers={"retry-after": "0"}),
        Answer(status=503, error="busy", headers={"retry-after-ms": "1"}),
        Answer(status=500, error={"error": "oops"}),
        Answer("half an answer", cut_after=2),
    ],
    ids=["429", "503", "500", "cut off"],
)
def test_what_passes_is_asked_again(passing: Answer) -> None:
    with FakeEndpoint([passing, passing, "now"]) as endpoint:
        assert chat(endpoint).complete(ASKED, None, max_tokens=50).text == "now"
        assert len(endpoint.requests) == 3


def test_it_is_asked_four_times_at_most(wording: Wording) -> None:
    with FakeEndpoint([Answer(status=503, error="busy")] * 9) as endpoint:
        with pytest.raises(EndpointRefused) as refused:
            chat(endpoint).complete(ASKED, None, max_tokens=50)
        wording(refused.value)
        assert len(endpoint.requests) == 4


def test_nobody_there(wording: Wording) -> None:
    with FakeEndpoint() as endpoint:
        base_url = endpoint.base_url
    one = Endpoint(PRESETS["ollama"], base_url, "fake", first_wait_s=0.0)
    with pytest.raises(EndpointUnreachable) as caught:
        one.complete(ASKED, None, max_tokens=50)
    wording(str(caught.value))


def test_an_answer_that_takes_too_long_is_given_up() -> None:
    late = r"no answer within 0\.2 s\n  help: FORMIGA_LLM_TIMEOUT=900"
    with (
        FakeEndpoint([Answer("late", hold=threading.Event())]) as endpoint,
        pytest.raises(EndpointUnreachable, match=late),
    ):
        chat(endpoint, whole_s=0.2).complete(ASKED, None, max_tokens=50)


@pytest.mark.parametrize("after", [None, 2], ids=["before the first word", "in the middle"])
def test_waiting_is_stopped_from_another_thread_and_the_endpoint_is_told(after: int | None) -> None:
    cancel, hold = threading.Event(), threading.Event()
    answer = Answer("one two three " * 50_000, pieces=4, hold=hold, hold_after=after)

    def arrived(body: dict[str, Any]) -> Answer:
        if after is None:
            cancel.set()
        return answer

    def progress(tokens: int) -> None:
        if tokens == after:
            cancel.set()

    with FakeEndpoint([arrived, "there"]) as endpoint:
        one = chat(endpoint)
        began = time.monotonic()
        with pytest.raises(Cancelled):
            one.complete(ASKED, None, max_tokens=100_000, cancel=cancel, on_progress=progress)
        assert time.monotonic() - began < 20
        hold.set()
        assert endpoint.hung_up.wait(10)
        assert one.complete(ASKED, None, max_tokens=50).text == "there"


def test_an_interrupt_while_it_answers_closes_the_connection() -> None:
    hold = threading.Event()

    def interrupt(tokens: int) -> None:
        raise KeyboardInterrupt

    with FakeEndpoint([Answer("word " * 100_000, hold=hold, hold_after=1)]) as endpoint:
        with pytest.raises(KeyboardInterrupt):
            chat(endpoint).complete(ASKED, None, max_tokens=100_000, on_progress=interrupt)
        hold.set()
        assert endpoint.hung_up.wait(10)


def everything_said(work: Callable[[], Any], caplog: pytest.LogCaptureFixture, folder: Path) -> str:
    """Return all texts that a failure leaves behind: the error with its causes, log records, files."""
    with caplog.at_level(logging.DEBUG), pytest.raises(LlmError) as caught:
        work()
    said = "".join(traceback.format_exception(caught.value))
    causes: list[BaseException | None] = [caught.value, caught.value.__cause__, caught.value.__context__]
    files = [path.read_text(encoding="utf-8", errors="replace") for path in folder.rglob("*") if path.is_file()]
    return "\n".join([said, *map(repr, causes), caplog.text, *(r.getMessage() for r in caplog.records), *files])


@pytest.mark.parametrize(
    "answer",
    [
        Answer(status=401, error=f"Incorrect API key provided: {CANARY}"),
        Answer(status=400, error=f"cannot use {CANARY}"),
        Answer(status=429, error=f"{CANARY} has no credit", headers={"retry-after": "999"}),
        Answer(raw=f"<html>{CANARY}</html>".encode(), kind="text/html"),
        Answer(raw=f'data: {{"error": "{CANARY}"}}\n\n'.encode()),
    ],
    ids=["401", "400", "429", "page", "event"],
)
def test_the_key_is_sent_and_told_to_nobody_else(
    answer: Answer,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    no_models_of_this_machine: Path,
) -> None:
    monkeypatch.setenv("FORMIGA_LLM_KEY", CANARY)
    form = Answer(status=400, error=f"{CANARY}: response_format json_schema is not supported")
    with FakeEndpoint([form, '{"a": "b"}', answer], key=CANARY) as endpoint:
        one = open_chat(base_url=endpoint.base_url)
        one.complete(ASKED, SCHEMA, max_tokens=50)
        said = everything_said(lambda: one.complete(ASKED, SCHEMA, max_tokens=50), caplog, no_models_of_this_machine)
        assert endpoint.headers[-1]["authorization"] == f"Bearer {CANARY}"
    assert "rungs" in said
    assert CANARY not in said + repr(one)


def test_a_key_in_an_answer_is_taken_out_of_it() -> None:
    key = "sk-a/b-0123456789"
    said = {"plan": f"I know {key}", "answer": {"question": "Where?"}}
    with FakeEndpoint([json.dumps(said), json.dumps(said).replace("/", "\\/")], key=key, models=[key]) as endpoint:
        one = chat(endpoint, key=key)
        for _ in range(2):
            reply = one.complete(ASKED, SCHEMA, max_tokens=50)
            assert reply.data == {**said, "plan": "I know ***"}
            assert "0123456789" not in reply.text
        assert one.models() == ["***"]


def test_a_key_that_is_only_a_word_is_none_to_be_hidden() -> None:
    with FakeEndpoint(["nobody has none"], key="none") as endpoint:
        assert chat(endpoint, key="none").complete(ASKED, None, max_tokens=50).text == "nobody has none"


def test_a_wrong_key_and_no_key(wording: Wording) -> None:
    with FakeEndpoint(["hi"], key="right") as endpoint:
        with pytest.raises(NoKey) as wrong:
            chat(endpoint, key="wrong").complete(ASKED, None, max_tokens=5)
        with pytest.raises(NoKey) as none:
            chat(endpoint).complete(ASKED, None, max_tokens=5)
    wording(str(wrong.value), str(none.value))


def test_azure_is_asked_for_a_deployment_with_its_version(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AZURE_OPENAI_API_KEY", CANARY)
    monkeypatch.setenv("AZURE_OPENAI_DEPLOYMENT", "drafts")
    monkeypatch.setenv("OPENAI_API_VERSION", "2025-01-01")
    with FakeEndpoint(['{"a": "b"}']) as endpoint:
        monkeypatch.setenv("AZURE_OPENAI_ENDPOINT", endpoint.base_url.removesuffix("/v1"))
        reply = open_chat("azure").complete(ASKED, SCHEMA, max_tokens=50)
    assert (reply.data, reply.rung) == ({"a": "b"}, "strict")
    assert endpoint.paths == ["/openai/deployments/drafts/chat/completions?api-version=2025-01-01"]
    assert endpoint.headers[0]["api-key"] == CANARY
    assert endpoint.requests[0]["max_completion_tokens"] == 50


def test_what_the_environment_says_of_openai_goes_to_openai_only(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", CANARY)
    monkeypatch.setenv("OPENAI_ORG_ID", "org-canary")
    monkeypatch.setenv("HTTP_PROXY", "http://127.0.0.1:9")
    with FakeEndpoint(["hi"]) as endpoint:
        assert open_chat(base_url=endpoint.base_url).complete(ASKED, None, max_tokens=5).text == "hi"
    assert "canary" not in repr(endpoint.headers)


def test_the_only_model_that_is_served_is_taken_and_of_several_one_is_to_be_named(wording: Wording) -> None:
    with FakeEndpoint(models=["only/one"]) as endpoint:
        assert open_chat(base_url=endpoint.base_url).model == "only/one"
    with FakeEndpoint(models=["a", "b"]) as endpoint:
        with pytest.raises(LlmError) as refused:
            open_chat(base_url=endpoint.base_url)
        wording(refused.value)
        assert open_chat(base_url=endpoint.base_url, model="b").model == "b"
