"""One agent of one's own, carried: its goals become calls of its actions, what it says leaves by its `AgentSide`.

`Session` is the body (an `AgentBody`) between the rules of all agents and the agent's class. It is the same on every
wire and in every time; what differs is the `Carrier`: an asyncio loop of a process, or one on a scheduler
(`scheduled.py`).

Threads: everything but plain functions happens in the loop's thread; what these say is handed over by `Carrier.post`.
"""

import asyncio
import logging
from collections.abc import Callable, Coroutine, Mapping, Sequence
from contextvars import ContextVar, copy_context
from typing import Any, Final, Protocol

from formiga_bt.agent.agent import Agent, card_of
from formiga_bt.agent.declared import ActionError, Declared, named_values
from formiga_bt.agent.tokens import CanceledError, CancelToken, void
from formiga_bt.agent.types import UnfitError, read_value, write_values
from formiga_bt.base.clock import Micros
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.attachments import Attachment
from formiga_bt.transport.base import AgentBody, SendsFiles
from formiga_bt.transport.cards import AgentCard
from formiga_bt.transport.messages import Control, GoalRequest, SiteMessage, to_wire

log = logging.getLogger("formiga_bt.agent")

_goal: ContextVar[str] = ContextVar("formiga_goal", default="")
"""The goal that the present task or thread carries out."""

FILE_TRIES: Final = 10
FILE_AGAIN_S: Final = 3.0
"""So often, and after so many seconds, bytes are sent again that no engine took."""

AGENT_ERROR: Final = "agent_error"
"""Code of a goal whose action raised what it did not mean to."""


class Carrier(Protocol):
    """Where coroutines, threads and time come from."""

    def spawn(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        """Run a coroutine."""
        ...

    def in_thread(self, call: Callable[[], Any], token: CancelToken) -> asyncio.Future[Any]:
        """Run a plain function in a thread; its token waits in engine time."""
        ...

    def post(self, call: Callable[[], None]) -> None:
        """Run a call in the loop's thread: at once if this is it."""
        ...

    async def sleep(self, seconds: float) -> None:
        """Wait in engine time."""
        ...


class _Work:
    """A goal that is carried out."""

    __slots__ = ("declared", "files", "task", "token", "values")

    def __init__(self, declared: Declared, token: CancelToken, values: Mapping[str, Any]) -> None:
        self.declared, self.token = declared, token
        self.values = dict(values)
        """Its fields as they are now."""
        self.files: list[Attachment] = []
        """What its result names."""
        self.task: asyncio.Task[None] | None = None

    def stop(self) -> None:
        """Cancel it."""
        self.token.cancel()
        if self.task is not None:
            self.task.cancel()


class Session:
    """An agent and its side.

    Args:
        agent: of one's own, with its id set.
        boot_id: differs at every start.
        carrier: loops and time.
        make_side: makes the side of a card and a body (this).
        link: sends the bytes of attachments, if it can (`SendsFiles`).
    """

    def __init__(
        self,
        agent: Agent,
        boot_id: str,
        carrier: Carrier,
        make_side: Callable[[AgentCard, AgentBody], AgentSide],
        link: object = None,
    ) -> None:
        self.agent = agent
        self._link = link
        self.side = make_side(card_of(agent, boot_id), self)
        self._carrier = carrier
        self._works: dict[str, _Work] = {}
        self._own: dict[str, Any] = {}
        self._is_dirty = False
        self._alone: asyncio.Task[None] | None = None
        self.main: asyncio.Task[None] | None = None
        if agent.mobility != "air":
            self.side.set_status(landed="grounded")
        agent._running = self

    def begin(self) -> None:
        """Begin what runs beside the actions: once, when the wire serves."""
        self.main = self._carrier.spawn(self.agent.main())

    def end(self) -> None:
        """End everything, without a word to anyone."""
        for work in self._works.values():
            work.stop()
        for task in (self.main, self._alone):
            if task is not None:
                task.cancel()

    def report(self) -> None:
        """Publish the status."""
        self._is_dirty = False
        self.side.publish_status()

    def watch_link(self) -> None:
        """Let the agent act by itself if the engine is silent for too long; called now and then."""
        if type(self.agent).link_lost is Agent.link_lost:
            return
        side = self.side
        if self._alone is not None:
            if self._alone.done() and not side.is_cut_off:
                self._alone = None
                if side.control == "failsafe":
                    self.note_control("engine")
        elif side.is_cut_off and side.control == "engine" and side.status.landed != "grounded":
            self.note_control("failsafe")
            self._alone = self._carrier.spawn(self.agent.link_lost())

    # A body: called by the side.

    def start(self, request: GoalRequest) -> str:
        """Begin a goal, or return why not."""
        declared = self.agent.actions[request.action]
        try:
            arguments = {
                name: read_value(field, request.fields[name])
                for name, field in declared.params.items()
                if name in request.fields
            }
            missing = [name for name, field in declared.params.items() if field.is_needed and name not in arguments]
            if missing:
                raise UnfitError(f"{missing[0]!r} is not given")
        except UnfitError as error:
            log.warning("%s: %s is refused: %s", self.agent.id, request.action, error)
            return "bad_field"
        for name, field in declared.params.items():
            if name not in arguments and field.optional and field.default is None:
                arguments[name] = None
        code = self.agent.accepts(request)
        if code:
            return code
        work = self._works[request.goal_id] = _Work(declared, CancelToken(), arguments)
        before = [] if self.side.runs_beside(request.action) else self._stop_rivals(request.goal_id)
        work.task = self._carrier.spawn(self._carry_out(request.goal_id, work, arguments, before))
        return ""

    def cancel(self, goal_id: str) -> bool:
        """Cancel a goal, unless its action refuses that."""
        work = self._works.get(goal_id)
        if work is None:
            return True
        if work.declared.cancelable:
            work.stop()
        return work.declared.cancelable

    def update(self, goal_id: str, fields: Mapping[str, Any]) -> str:
        """Change fields of a goal that runs, or return why not."""
        work = self._works.get(goal_id)
        if work is None:
            return "goal_ended"
        declared = work.declared
        if not declared.live:
            return "no_update"
        if any(name not in declared.live for name in fields):
            return "bad_field"
        try:
            work.values.update({name: read_value(declared.params[name], value) for name, value in fields.items()})
        except UnfitError as error:
            log.warning("%s: an update of %s is refused: %s", self.agent.id, declared.card.name, error)
            return "bad_field"
        return ""

    # Running: called by the agent, from any thread.

    def live(self, name: str) -> Any:
        """Return a field of the goal that the present action carries out, as it is now.

        Raises:
            KeyError: it has no such field.
            RuntimeError: it is not asked by an action.
        """
        work = self._works.get(_goal.get())
        if work is None:
            raise RuntimeError(
                "live(name) is asked within an action: it is a field of the goal that the action carries out"
            )
        return work.values[name]

    def note_status(self, fields: Mapping[str, Any]) -> None:
        """Take fields of the status; they leave together at the next turn of the loop."""
        given = dict(fields)

        def take() -> None:
            if "fields" in given:
                self._own.update(given["fields"])
                given["fields"] = dict(self._own)
            self.side.set_status(**given)
            if not self._is_dirty:
                self._is_dirty = True
                self._carrier.spawn(self._report_soon())

        self._carrier.post(take)

    def note_feedback(self, progress: float | None, eta_s: float | None, phase: str) -> None:
        """Take news of the goal that runs.

        Raises:
            RuntimeError: it is not said by an action.
        """
        goal = _goal.get()
        if not goal:
            raise RuntimeError("feedback is said within an action: it is of the goal that the action carries out")
        self._carrier.post(lambda: self.side.feedback(goal, progress=progress, eta_s=eta_s, phase=phase))

    def note_event(self, name: str, fields: Mapping[str, Any], files: Sequence[Attachment] = ()) -> None:
        """Take an event."""
        self._carrier.post(lambda: self.side.report_event(name, files, **fields))

    def note_file(self, file: Attachment, data: bytes) -> None:
        """Take a file: its bytes are sent, and the result of the present action names it."""
        work = self._works.get(_goal.get())

        def take() -> None:
            if work is not None:
                work.files.append(file)
            self._send_file(file, data, FILE_TRIES)

        self._carrier.post(take)

    def note_control(self, control: Control) -> None:
        """Take who is in command."""

        def take() -> None:
            self.side.take_control(control)
            if control != "engine":
                for work in self._works.values():
                    work.stop()

        self._carrier.post(take)

    @property
    def site(self) -> SiteMessage | None:
        """Return what the engine told of the site."""
        return self.side.site

    def engine_now(self) -> Micros:
        """Return engine time."""
        return self.side.engine_now()

    async def sleep(self, seconds: float) -> None:
        """Wait in engine time."""
        await self._carrier.sleep(seconds)

    # Inside.

    def _send_file(self, file: Attachment, data: bytes, tries: int) -> None:
        def done(why: str) -> None:  # in a thread of the wire
            if not why:
                return
            log.warning("%s: the bytes of %s were not taken: %s", self.agent.id, file.name, why)
            if tries > 1 and why.partition(":")[0] in ("busy", "unreachable"):
                self._carrier.post(lambda: void(self._carrier.spawn(self._send_later(file, data, tries - 1))))

        if isinstance(self._link, SendsFiles):
            self._link.send_file(file.sha256, data, done)
        else:
            done("not_kept: this wire carries no files")

    async def _send_later(self, file: Attachment, data: bytes, tries: int) -> None:
        await self._carrier.sleep(FILE_AGAIN_S)
        self._send_file(file, data, tries)

    async def _report_soon(self) -> None:
        if self._is_dirty:
            self.report()

    def _stop_rivals(self, but: str) -> list[asyncio.Task[None]]:
        """Stop what a new goal replaces; return what has yet to come to rest."""
        rivals = [work for goal, work in self._works.items() if goal != but and not self._is_beside(work)]
        for work in rivals:
            work.stop()
        return [work.task for work in rivals if work.task is not None and not work.task.done()]

    def _is_beside(self, work: _Work) -> bool:
        return self.side.runs_beside(work.declared.card.name)

    async def _carry_out(
        self, goal: str, work: _Work, arguments: dict[str, Any], before: list[asyncio.Task[None]]
    ) -> None:
        _goal.set(goal)
        side, name = self.side, work.declared.card.name
        try:
            if before:
                await asyncio.wait(before)
            result = named_values(await self._call(work, arguments))
            fields = work.declared.result
            made = write_values(fields, result, f"the result of {name}") if fields is not None else to_wire(result)
            side.finish(goal, "succeeded", result=made, attachments=work.files)
        except (asyncio.CancelledError, CanceledError):
            side.finish(goal, "canceled")
        except ActionError as error:
            side.finish(goal, "failed", code=error.code, text=error.text, attachments=work.files)
        except (UnfitError, TypeError) as error:
            log.exception("%s: %s", self.agent.id, name)
            side.finish(goal, "failed", code="bad_result", text=str(error))
        except Exception as error:
            log.exception("%s: %s", self.agent.id, name)
            side.finish(goal, "failed", code=AGENT_ERROR, text=f"{type(error).__name__}: {error}")
        finally:
            self._works.pop(goal, None)

    async def _call(self, work: _Work, arguments: dict[str, Any]) -> Any:
        declared = work.declared
        if declared.is_async:
            return await declared.call(self.agent, **arguments)
        if declared.token:
            arguments[declared.token] = work.token
        context = copy_context()
        future = self._carrier.in_thread(lambda: context.run(declared.call, self.agent, **arguments), work.token)
        while True:
            try:
                result = await asyncio.shield(future)
                break
            except asyncio.CancelledError:
                if future.cancelled():
                    raise  # the process ends
                # A thread cannot be stopped from outside: its token says it, and it is waited for.
        if work.token and result is None:
            raise CanceledError
        return result
