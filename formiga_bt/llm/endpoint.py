"""A chat over HTTP with an endpoint that speaks the protocol of OpenAI: attempts, the ladder, stopping, errors in words.

Called by `client.open_chat`, and by `local` for the server that it starts. `openai` is imported here only, and only when a
model is asked. The question is asked in a thread of its own, so that waiting can be stopped at any time.
"""

import queue
import re
import socket
import threading
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing, suppress
from importlib.util import find_spec
from typing import Any, Final

import msgspec

from formiga_bt.base.extras import install
from formiga_bt.llm import ladder
from formiga_bt.llm.errors import Cancelled, EndpointRefused, EndpointUnreachable, LlmError, NoKey, TooLong
from formiga_bt.llm.presets import OTHER, OWN_KEY, Preset, Price, cost_usd, is_loopback
from formiga_bt.llm.records import Message, ModelReply, Rung, Usage
from formiga_bt.llm.wire import (
    AnswerPiece,
    EndpointFailure,
    NotTheProtocol,
    masked,
    message_of,
    pieces,
    retry_after_s,
    shown,
)

ATTEMPTS: Final = 4
"""How often a question is asked of an endpoint that is busy or breaks off."""
LONGEST_WAIT_S: Final = 60.0
"""For an endpoint that asks to come back later."""
CONNECT_S: Final = 15.0
POLL_S: Final = 0.05
BUSY: Final = frozenset({408, 425, 429, 500, 502, 503, 504, 529})
OPTIONAL: Final = ("temperature", "seed", "stream_options")
"""Parameters without which an endpoint that does not know them is asked again."""
NOT_KNOWN: Final = re.compile(
    r"unsupported|not support|unrecogni[sz]ed|unknown|unexpected|extra|not permitted|invalid", re.IGNORECASE
)


class Endpoint:
    """A chat over HTTP with an endpoint that speaks the protocol of OpenAI."""

    def __init__(
        self,
        preset: Preset,
        base_url: str,
        model: str,
        *,
        key: str = "",
        price: Price | None = None,
        whole_s: float = 300.0,
        first_wait_s: float = 0.5,
        memory: ladder.Memory | None = None,
    ) -> None:
        """Make a chat; nothing is sent yet.

        Args:
            preset: how the endpoint likes to be asked.
            base_url: checked by `presets.checked_url`.
            model: as the endpoint calls it.
            key: "" = none is sent.
            price: of tokens, if it is known.
            whole_s: the longest time for one question, with all attempts.
            first_wait_s: before the second attempt; doubled for each further one.
            memory: of the rungs that worked.
        """
        self.name, self.model, self.base_url = preset.name, model, base_url
        self._preset, self._price = preset, price
        self._key = key
        self._whole_s, self._first_wait_s = whole_s, first_wait_s
        self._memory = memory or ladder.Memory()
        self.more: Mapping[str, Any] = {}
        """Sent with each question, besides what the protocol of OpenAI has."""
        self._limit_word = preset.limit_word
        self._without: set[str] = set()
        self._http: Any = None
        self._sockets: list[socket.socket] = []

    def __repr__(self) -> str:
        return f"Endpoint({self.name}, {self.base_url}, {self.model})"

    def complete(
        self,
        messages: Sequence[Message],
        schema: Mapping[str, Any] | None,
        *,
        max_tokens: int,
        temperature: float = 0.0,
        seed: int | None = None,
        on_progress: Callable[[int], None] | None = None,
        cancel: threading.Event | None = None,
    ) -> ModelReply:
        """Ask; see `Chat`."""
        _check_installed()
        began = time.monotonic()
        question = _Question(messages, schema, max_tokens, temperature, seed)
        patience = _Patience(began + self._whole_s, cancel or threading.Event(), on_progress)
        remembered = self._memory.recall(self.base_url, self.model)
        rung: Rung = "text" if schema is None else remembered or self._preset.rung
        is_once = False
        while True:
            answer = self._asked(self._body(question, rung), patience)
            if not isinstance(answer, EndpointFailure):
                break
            if self._is_adapted(answer):
                continue
            below = ladder.lower(rung)
            if schema is None or below is None or not ladder.is_about_form(answer.status, answer.text):
                raise self._error(answer)
            is_once = is_once or ladder.is_of_one_answer(answer.text)
            rung = below
        if schema is not None and rung != remembered and not is_once:
            self._memory.keep(self.base_url, self.model, rung)
        text = masked(answer.text, self._key)
        data = None if schema is None or answer.finish == "length" else ladder.json_in(text)
        if rung == "strict" and schema is not None:
            data = ladder.plainly(data, schema)
        usage = answer.usage or Usage(completion=answer.tokens)
        if self._price is not None and answer.usage is not None:
            usage = msgspec.structs.replace(usage, cost_usd=cost_usd(self._price, usage))
        return ModelReply(
            text=text,
            data=data,
            finish="length" if answer.finish == "length" else "stop",
            rung=rung,
            usage=usage,
            seconds=time.monotonic() - began,
            model=self.model,
        )

    def models(self) -> list[str]:
        """Return the names of the models that the endpoint serves.

        Raises:
            LlmError: it does not say.
        """
        _check_installed()
        found: list[str] = []

        def ask(put: Callable[[Any], None]) -> None:
            put([masked(str(one.id), self._key) for one in self._client().models.list().data])

        for item in self._heard(ask, _Patience(time.monotonic() + 2 * CONNECT_S, threading.Event(), None)):
            if isinstance(item, EndpointFailure):
                raise self._error(item)
            found = item
        return found

    def close(self) -> None:
        """Let go of connections."""
        sockets, self._sockets = self._sockets, []
        for one in sockets:
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
        http, self._http = self._http, None
        if http is not None:
            http.close()

    def _asked(self, body: Mapping[str, Any], patience: "_Patience") -> "_Answer | EndpointFailure":
        """Return the answer; a busy endpoint is asked again after a while."""
        wait_s = self._first_wait_s
        for attempt in range(1, ATTEMPTS + 1):
            answer = self._once(body, patience)
            if not isinstance(answer, EndpointFailure) or attempt == ATTEMPTS or not _is_passing(answer):
                break
            pause_s = wait_s if answer.retry_after_s is None else answer.retry_after_s
            if pause_s > LONGEST_WAIT_S or time.monotonic() + pause_s > patience.until:
                break
            if patience.cancel.wait(pause_s):
                raise Cancelled("stopped: no answer was waited for")
            wait_s *= 2
        return answer

    def _once(self, body: Mapping[str, Any], patience: "_Patience") -> "_Answer | EndpointFailure":
        text: list[str] = []
        tokens, finish, usage = 0, "", None
        letters, most = 0, 64 * int(body[self._limit_word]) + 65536
        with closing(self._heard(lambda put: self._spoken(body, put), patience)) as heard:
            for item in heard:
                if isinstance(item, EndpointFailure):
                    return item
                piece: AnswerPiece = item
                text.append(piece.text)
                letters += len(piece.text)
                tokens += piece.tokens
                finish = piece.finish or finish or ("stop" if piece.is_last else "")
                usage = piece.usage or usage
                if letters > most:
                    raise EndpointRefused(
                        f"{self._where} answers far more than it was asked for; it was stopped", help="another model"
                    )
                if piece.tokens and patience.on_progress is not None:
                    patience.on_progress(tokens)
        if not finish:
            return EndpointFailure(text="the answer broke off")
        if finish == "content_filter":
            raise EndpointRefused(
                f"{self._where} holds its answer back: a filter of the provider", help="say it in other words"
            )
        return _Answer("".join(text), finish, usage, tokens)

    def _heard(self, ask: Callable[[Callable[[Any], None]], None], patience: "_Patience") -> Generator[Any, None, None]:
        """Yield what `ask` puts, from a thread of its own, until it ends; at a Failure, that is the last one.

        Waiting can so be stopped at any time, also by Ctrl-C, whatever the endpoint does.
        """
        heard: queue.SimpleQueue[Any] = queue.SimpleQueue()

        def work() -> None:
            failure = _mapped(lambda: ask(heard.put))
            heard.put(failure or _END)

        thread = threading.Thread(target=work, name="asks a model", daemon=True)
        thread.start()
        is_over = False
        try:
            while not is_over:
                if patience.cancel.is_set():
                    raise Cancelled("stopped: the answer was not waited for")
                if time.monotonic() > patience.until:
                    yield EndpointFailure(is_timeout=True)
                    return
                try:
                    item = heard.get(timeout=POLL_S)
                except queue.Empty:
                    continue
                is_over = item is _END or isinstance(item, EndpointFailure)
                if item is not _END:
                    yield item
        finally:
            if not is_over:
                self.close()
            thread.join(timeout=1.0)

    def _spoken(self, body: Mapping[str, Any], put: Callable[[Any], None]) -> None:
        with self._client().chat.completions.with_streaming_response.create(**body) as response:
            for piece in pieces(response.headers.get("content-type", ""), response.iter_bytes()):
                put(piece)

    def _body(self, question: "_Question", rung: Rung) -> dict[str, Any]:
        messages = [{"role": one.role, "content": one.text} for one in question.messages]
        more: dict[str, Any] = {}
        if question.schema is not None:
            words = ladder.said_in_prompt(rung, question.schema)
            if words and messages and messages[0]["role"] == "system":
                messages[0]["content"] += f"\n\n{words}"
            elif words:
                messages.insert(0, {"role": "system", "content": words})
            form = ladder.response_format(rung, question.schema)
            more = {"response_format": form} if form else {}
        optional = {
            "temperature": question.temperature,
            "seed": question.seed,
            "stream_options": {"include_usage": True},
        }
        return {
            "model": self.model,
            "messages": messages,
            **({"extra_body": dict(self.more)} if self.more else {}),
            "stream": True,
            self._limit_word: question.max_tokens,
            **{key: value for key, value in optional.items() if value is not None and key not in self._without},
            **more,
        }

    def _is_adapted(self, failure: EndpointFailure) -> bool:
        """Learn of a parameter that the endpoint does not know. Return whether it is to be asked again."""
        if failure.status not in (400, 422) or not NOT_KNOWN.search(failure.text):
            return False
        blamed = failure.param or failure.text
        if self._limit_word in blamed and "limit" not in self._without:
            self._without.add("limit")
            self._limit_word = "max_tokens" if self._limit_word != "max_tokens" else "max_completion_tokens"
            return True
        for word in OPTIONAL:
            if word in blamed and word not in self._without:
                self._without.add(word)
                return True
        return False

    def _client(self) -> Any:
        if self._http is None:
            self._http = self._opened()
        return self._http

    def _opened(self) -> Any:
        import openai

        http = openai.DefaultHttpxClient(
            follow_redirects=False,  # a redirect would carry the question to somebody else
            trust_env=not is_loopback(self.base_url),
            timeout=openai.Timeout(connect=CONNECT_S, read=self._whole_s, write=60.0, pool=CONNECT_S),
            event_hooks={"request": [self._watched]},
        )
        more: dict[str, Any] = {"api_key": self._key or "none", "http_client": http, "max_retries": 0}
        if self._preset.api_version:
            return openai.AzureOpenAI(azure_endpoint=self.base_url, api_version=self._preset.api_version, **more)
        client = openai.OpenAI(base_url=self.base_url, **more)
        if self.name != "openai":
            client.organization = client.project = None  # of the environment, for OpenAI only
        return client

    def _watched(self, request: Any) -> None:
        """Note the sockets of a request, so that waiting can be ended from another thread."""

        def noted(event: str, info: Mapping[str, Any]) -> None:
            stream = info.get("return_value")
            if event.endswith(("connect_tcp.complete", "start_tls.complete")) and stream is not None:
                found = stream.get_extra_info("socket")
                if found is not None:
                    self._sockets = [*self._sockets[-8:], found]

        request.extensions["trace"] = noted

    @property
    def _where(self) -> str:
        return self.base_url if self.name in (OTHER, "local") else f"{self.name} ({self.base_url})"

    def _error(self, failure: EndpointFailure) -> LlmError:
        """Return the error that tells a person of a failure. Never has the key in it."""
        words = shown(failure.text.replace(self._key, "***") if self._key else failure.text)
        where, status = self._where, failure.status
        if failure.is_timeout:
            return EndpointUnreachable(
                f"{where}: no answer within {self._whole_s:g} s", help="FORMIGA_LLM_TIMEOUT=900, or a smaller model"
            )
        if failure.is_lasting:
            return EndpointUnreachable(f"{where}: {words}", help="is the address right? It often ends in /v1")
        if not status:
            return EndpointUnreachable(f"{where} does not answer: {words}", help=f"{self._start_it()}")
        if status in (401, 403):
            variable = " or ".join((OWN_KEY, *self._preset.keys)) if self._key else OWN_KEY
            what = "refuses the key" if self._key else "wants a key"
            return NoKey(f"{where} {what} (HTTP {status})", help=f"put the right one into {variable}")
        if ladder.is_about_length(failure.text) or status == 413:
            return TooLong(
                f"{where}: the question is longer than {self.model} can take: {words}",
                help="a shorter request, or another model",
            )
        if status == 404:
            return EndpointRefused(
                f"{where} has no model '{self.model}' (HTTP 404): {words}",
                help="name another with --model, or another address",
            )
        if status == 429:
            later = f"; it asks to wait {failure.retry_after_s:g} s" if failure.retry_after_s else ""
            return EndpointRefused(
                f"{where}: its limit is reached (HTTP 429){later}: {words}", help="try later, or another provider"
            )
        return EndpointRefused(f"{where} says no (HTTP {status}): {words}")

    def _start_it(self) -> str:
        if not is_loopback(self.base_url):
            return "check the address and the network"
        return "start it: ollama serve" if self.name == "ollama" else "start the server there, or name another address"


class _Question(msgspec.Struct, frozen=True):
    messages: Sequence[Message]
    schema: Mapping[str, Any] | None
    max_tokens: int
    temperature: float
    seed: int | None


class _Patience(msgspec.Struct, frozen=True):
    until: float
    cancel: threading.Event
    on_progress: Callable[[int], None] | None


class _Answer(msgspec.Struct, frozen=True):
    text: str
    finish: str
    usage: Usage | None
    tokens: int


_END: Final = object()


def _is_passing(failure: EndpointFailure) -> bool:
    """Return whether the same question may do better in a while."""
    if failure.is_timeout or failure.is_lasting or ladder.is_about_form(failure.status, failure.text):
        return False
    return failure.status in BUSY | {0} and "insufficient_quota" not in failure.text


def _check_installed() -> None:
    if find_spec("openai") is None:
        raise LlmError("asking a language model needs a package more", help=f"{install('llm')}")


def _mapped(work: Callable[[], None]) -> EndpointFailure | None:
    """Do it, and return what went wrong, without what a library's errors carry: they know the key."""
    import openai

    try:
        work()
    except openai.APIStatusError as error:
        words, param = message_of(error.body if error.body is not None else error.message)
        after = retry_after_s(error.response.headers)
        return EndpointFailure(status=error.status_code, text=words, param=param, retry_after_s=after)
    except openai.APITimeoutError as error:
        if "Connect" in type(error.__cause__).__name__:
            return EndpointFailure(text=f"no connection within {CONNECT_S:g} s")
        return EndpointFailure(is_timeout=True)
    except NotTheProtocol as error:
        return EndpointFailure(text=f"it sends something else than the protocol of OpenAI ({error})", is_lasting=True)
    except Exception as error:  # noqa: BLE001 - of the libraries below: a connection that was refused, or broke off
        return EndpointFailure(text=_root(error))
    return None


def _root(error: BaseException) -> str:
    while error.__cause__ is not None:
        error = error.__cause__
    return str(error) or type(error).__name__
