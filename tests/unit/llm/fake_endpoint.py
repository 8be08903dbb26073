"""An endpoint that speaks the protocol of OpenAI on the loopback, and says what a test wrote for it.

    with FakeEndpoint(["hello", Answer(status=429, headers={"retry-after": "0"}), {"kind": "task"}]) as endpoint:
        chat = open_chat(base_url=endpoint.base_url, model="fake")

Each request takes the next answer of the list: a text, a JSON value, an `Answer`, or a function of the request's JSON that
returns one of these. What was asked is in `requests`. With `key`, another key, or none, is refused with 401.
"""

import json
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any


@dataclass(frozen=True, slots=True)
class Answer:
    """One answer, or refusal, of the endpoint."""

    text: str = ""
    status: int = 200
    error: Any = None
    """Body of a refusal; a text becomes `{"error": {"message": text}}`."""
    headers: Mapping[str, str] = field(default_factory=dict)
    finish: str | None = "stop"
    usage: tuple[int, int, int] | None = (100, 0, 0)
    """Tokens of the prompt, of these cached, of the answer (0: one for each piece)."""
    pieces: int = 4
    """In how many the text is streamed."""
    cut_after: int | None = None
    """Pieces after which the connection is closed."""
    hold: threading.Event | None = None
    """Nothing is sent before this is set (or the endpoint closed)."""
    hold_after: int | None = None
    """It is waited for after so many pieces only."""
    stream: bool | None = None
    """None: as it was asked."""
    raw: bytes | None = None
    """Sent as it is, instead of all this."""
    kind: str = ""
    """Content type of `raw`."""


class FakeEndpoint:
    """The server. A context manager; `base_url` is what a chat is opened with."""

    def __init__(self, answers: Sequence[Any] = (), *, key: str = "", models: Sequence[str] = ("fake",)) -> None:
        self.answers = list(answers)
        self.models = list(models)
        self.key = key
        self.requests: list[dict[str, Any]] = []
        """Bodies, in order."""
        self.headers: list[dict[str, str]] = []
        self.paths: list[str] = []
        self.closed = threading.Event()
        self.hung_up = threading.Event()
        """A client went away in the middle of an answer."""
        self._lock = threading.Lock()
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(self))
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)

    @property
    def base_url(self) -> str:
        return f"http://127.0.0.1:{self._server.server_address[1]}/v1"

    def __enter__(self) -> "FakeEndpoint":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.closed.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def next(self, body: dict[str, Any]) -> Answer:
        with self._lock:
            self.requests.append(body)
            said = self.answers.pop(0) if self.answers else Answer(status=418, error="the test has no answer for this")
        if callable(said):
            said = said(body)
        if isinstance(said, Answer):
            return said
        return Answer(said if isinstance(said, str) else json.dumps(said))


def _handler(endpoint: FakeEndpoint) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *_: object) -> None: ...

        def do_GET(self) -> None:
            if self._is_known():
                self._send({"object": "list", "data": [{"id": name, "object": "model"} for name in endpoint.models]})

        def do_POST(self) -> None:
            body = json.loads(self.rfile.read(int(self.headers.get("content-length", 0))))
            if not self._is_known():
                return
            answer = endpoint.next(body)
            try:
                self._answer(answer, body)
            except (BrokenPipeError, ConnectionResetError):
                endpoint.hung_up.set()
                self.close_connection = True

        def _is_known(self) -> bool:
            endpoint.paths.append(self.path)
            endpoint.headers.append({key.lower(): value for key, value in self.headers.items()})
            if endpoint.key and self.headers.get("authorization") != f"Bearer {endpoint.key}":
                said = self.headers.get("authorization", "")
                self._send(
                    {"error": {"message": f"Incorrect API key provided: {said}", "code": "invalid_api_key"}}, 401
                )
                return False
            return True

        def _answer(self, answer: Answer, body: Mapping[str, Any]) -> None:
            if answer.hold is not None and answer.hold_after is None:
                self._wait(answer.hold)
            if answer.status != 200:
                said = answer.error
                self._send(
                    {"error": {"message": said}} if isinstance(said, str) else said, answer.status, answer.headers
                )
            elif answer.raw is not None:
                self._head(answer.kind or "text/event-stream", len(answer.raw))
                self.wfile.write(answer.raw)
            elif answer.stream if answer.stream is not None else body.get("stream"):
                self._stream(answer, bool((body.get("stream_options") or {}).get("include_usage")))
            else:
                message = {"role": "assistant", "content": answer.text}
                choice = {"index": 0, "message": message, "finish_reason": answer.finish}
                self._send({"object": "chat.completion", "choices": [choice], "usage": _usage(answer)})

        def _stream(self, answer: Answer, with_usage: bool) -> None:
            self._head("text/event-stream", None)
            for number, piece in enumerate(_cut(answer.text, answer.pieces)):
                if number == answer.hold_after and answer.hold is not None:
                    self._wait(answer.hold)
                if number == answer.cut_after:
                    self.close_connection = True
                    return
                self._event({"choices": [{"index": 0, "delta": {"content": piece}, "finish_reason": None}]})
            self._event({"choices": [{"index": 0, "delta": {}, "finish_reason": answer.finish}]})
            if with_usage and answer.usage is not None:
                self._event({"choices": [], "usage": _usage(answer)})
            self._chunk(b"data: [DONE]\n\n")
            self._chunk(b"")

        def _wait(self, event: threading.Event) -> None:
            while not event.wait(0.01) and not endpoint.closed.is_set():
                pass

        def _event(self, value: Mapping[str, Any]) -> None:
            self._chunk(b"data: " + json.dumps({"object": "chat.completion.chunk", **value}).encode() + b"\n\n")

        def _chunk(self, data: bytes) -> None:
            self.wfile.write(f"{len(data):x}\r\n".encode() + data + b"\r\n")
            self.wfile.flush()

        def _send(self, value: Any, status: int = 200, headers: Mapping[str, str] | None = None) -> None:
            data = value if isinstance(value, bytes) else json.dumps(value).encode()
            self._head("application/json", len(data), status, headers)
            self.wfile.write(data)

        def _head(
            self, kind: str, length: int | None, status: int = 200, headers: Mapping[str, str] | None = None
        ) -> None:
            self.send_response(status)
            self.send_header("Content-Type", kind)
            if length is None:
                self.send_header("Transfer-Encoding", "chunked")
            else:
                self.send_header("Content-Length", str(length))
            for key, value in (headers or {}).items():
                self.send_header(key, value)
            self.end_headers()

    return Handler


def _cut(text: str, pieces: int) -> list[str]:
    step = max(1, -(-len(text) // max(1, pieces)))
    return [text[at : at + step] for at in range(0, len(text), step)]


def _usage(answer: Answer) -> dict[str, Any] | None:
    if answer.usage is None:
        return None
    prompt, cached, completion = answer.usage
    completion = completion or len(_cut(answer.text, answer.pieces))
    return {
        "prompt_tokens": prompt,
        "completion_tokens": completion,
        "total_tokens": prompt + completion,
        "prompt_tokens_details": {"cached_tokens": cached},
    }


Scripted = str | Answer | dict[str, Any] | list[Any] | Callable[[dict[str, Any]], Any]
"""What the list of answers may have."""
