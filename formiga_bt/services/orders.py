"""What callers may order and ask: answered from the view, or handed to the driver's inbox.

The engine itself is never touched, and its thread never waits for a caller.

Stops, lockdown and hand-back are `stops`. Every refusal is a `Refused` with a code, a text and what helps; `api` makes a
problem document of it.
"""

import json
from collections.abc import Collection, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol, get_args

from msgspec.structs import replace

from formiga_bt.base.clock import Micros
from formiga_bt.base.diagnostics import render
from formiga_bt.base.geo import Frame
from formiga_bt.engine.kernel.inputs import Abort, Input, Operator, Submit
from formiga_bt.engine.kernel.library import Bundles
from formiga_bt.engine.kernel.records import Priority, Question, TaskRecord, TaskStatus, TaskWhen
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.model import Catalogue, EvalError, Site
from formiga_bt.lang.model.rules import RULE_PREFIX
from formiga_bt.lang.request.aliases import find_task
from formiga_bt.lang.request.binding import bind_params
from formiga_bt.lang.request.value_files import ValueFile
from formiga_bt.services.alarms import AlarmDesk
from formiga_bt.services.answering import Answering
from formiga_bt.services.asked_when import AskedWhen, when_of
from formiga_bt.services.by_hand import HandDesk
from formiga_bt.services.not_served import NotServed, of_name, unread_in
from formiga_bt.services.once import Once, digest_of
from formiga_bt.services.order_taker import OrderTaker, ask
from formiga_bt.services.pace import Turns
from formiga_bt.services.refused import Refused
from formiga_bt.services.replies import shown
from formiga_bt.services.rules import RuleDesk
from formiga_bt.services.standing import lockdown_fact, order_fact, wall_us
from formiga_bt.services.stops import Stops
from formiga_bt.services.telling import Telling
from formiga_bt.services.view import EngineView
from formiga_bt.services.words import hint_for, with_keeping
from formiga_bt.services.zones import ZoneDesk
from formiga_bt.show.facts import AgentList, Because, Explanation, OrderFact, QuestionList, TaskDetail, TaskList
from formiga_bt.show.history.records import agent_fact, agents_of, question_fact, task_fact
from formiga_bt.show.history.urgency import UrgencyIndex
from formiga_bt.show.listed import listing, port_of
from formiga_bt.show.why.causes import causes_of
from formiga_bt.show.why.front import explain
from formiga_bt.show.why.near import nearest, shortened
from formiga_bt.show.why.places import StepPlaces
from formiga_bt.transport.desk import DeskTransport


class Waits(NamedTuple):
    """What a request says itself of its time: how long it may be PENDING, microseconds, None: as its task says; and when."""

    wait: Micros | None = None
    expires: Micros | None = None
    when: AskedWhen = AskedWhen()


UNDER_WAY: Final = frozenset({"ASSIGNED", "ACTIVE", "ENDING"})
"""Statuses of tasks that have their agents."""

UNSAID: Final = Waits()


class Driver(OrderTaker, Protocol):
    """What is needed of the realtime driver."""

    def now(self) -> Micros:
        """Return the engine time."""
        ...


class ServiceOrders:
    """Everything behind the API but the HTTP.

    Args:
        driver: of the running engine.
        view: its read-only copy.
        desk: the people of this process.
        site, tasks, catalogue: what the engine was made of.
        answering: takes answers of these people.
        refused: task files that are not served.
    """

    def __init__(
        self,
        driver: Driver,
        view: EngineView,
        desk: DeskTransport,
        site: Site,
        tasks: Bundles,
        catalogue: Catalogue,
        answering: Answering,
        refused: Sequence[NotServed] = (),
        trees: Path | None = None,
    ) -> None:
        self._refused = refused
        self._trees = trees
        self._catalogue = catalogue
        self._driver = driver
        self._view = view
        self._desk = desk
        self._answering = answering
        self._site = site
        self._tasks = tasks
        self._frame = Frame(site.lat, site.lng, site.ground_msl_m)
        self._places: dict[tuple[str, str], StepPlaces] = {}
        self._once = Once[str]()
        self._turns = Turns()
        with view.reading() as state:
            for one in state.tasks.values():
                if one.request.key:
                    self._once.know(one.request.key, one.request.asked, one.id)
        self.stops = Stops(self.ask, view, site, driver.now, catalogue)
        self.by_hand = HandDesk(self.ask, view)
        self.zones = ZoneDesk(self.ask, view)
        self.alarms = AlarmDesk(self.ask, view, driver.now)
        self.rules = RuleDesk(self.ask, view, site, driver.now)
        self.desk_people: set[str] = set()
        self.telling = Telling(desk, self.desk_people, view, site, catalogue, driver.now)
        self.closed_for = ""
        """Why no task is admitted any more, or empty."""

    # -- tasks -----------------------------------------------------------------------------------------------------
    def submit(
        self,
        name: str,
        params: Mapping[str, Any],
        priority: Priority | None = None,
        by: str = "",
        key: str = "",
        bundle: str = "",
        waits: Waits = UNSAID,
        files: tuple[ValueFile, ...] = (),
        most_open: int | None = None,
    ) -> str:
        """Request a task; return its id. The same `key` (`once.key_of`) again returns the same id, and starts nothing.

        `bundle`: of the version that is meant; empty: the newest. `waits`: how long it may be PENDING. `files`: in which
        further parameters stand. `most_open`: so many tasks that `by` requested may be under way; None: any number.

        Raises:
            Refused: unknown task, too many are under way, its file is not served, bad parameters, busy, draining, or the key
                came with another request.
        """
        digest = digest_of(name, params, priority, by, bundle, waits, files) if key else ""

        def act() -> str:
            with self._turns.of(by) if most_open is not None else nullcontext():
                if most_open is not None:
                    self._check_open(by, most_open)
                return self._submit(name, params, priority, by, bundle, waits, files, key, digest)

        return self._once.do(key, digest, act)

    def _check_open(self, by: str, most: int) -> None:
        with self._view.reading() as state:
            count = sum(task.request.by == by and task.section != "done" for task in state.tasks.values())
        if count >= most:
            text = f"{by} has {count} of the {most} tasks under way that it may have"
            raise Refused("too_many_open", text, "wait for the end of one, or abort one")

    def _submit(
        self,
        name: str,
        params: Mapping[str, Any],
        priority: Priority | None,
        by: str,
        bundle: str,
        waits: Waits,
        files: tuple[ValueFile, ...],
        key: str,
        digest: str,
    ) -> str:
        if self.closed_for:
            raise Refused(
                "closed", f"no task is admitted: the engine is {self.closed_for}", "formiga up starts it again"
            )
        task = find_task(self._tasks, name)
        if task is None:
            raise self._unknown(name)
        if bundle:
            task = self._tasks.version(task.name, bundle)
            if task is None:
                text = f"{name} is not served as {bundle[:8]}"
                raise Refused("not_served", text, "formiga tasks --library --json lists what is")
        raw = {key: text_of(value) for key, value in params.items() if value is not None}
        values, problems, sources = bind_params(task, raw, self._site, self._driver.now(), files)
        if problems:
            first = problems[0]
            raise Refused(
                "bad_params",
                f"{task.name}: {first.message}",
                first.help or "",
                [render(problem, sources) for problem in problems],
            )
        when = self._when(waits.when)
        reply = self.ask(
            Submit(
                task.name,
                values,
                priority,
                by,
                task.bundle,
                waits.wait,
                waits.expires,
                key=key,
                asked=digest,
                when=when,
            )
        )
        assert isinstance(reply, Accepted)
        self._view.catch_up()
        return reply.task

    def _when(self, asked: AskedWhen) -> TaskWhen:
        try:
            return when_of(asked, self._site, self._driver.now())
        except EvalError as error:
            raise Refused(
                "bad_time", error.reason, "for example 14:00, or 2026-08-20T14:00, in the site's time zone"
            ) from None

    def _unknown(self, name: str) -> Refused:
        """Return why nothing can be requested under a name."""
        from difflib import get_close_matches

        passed_over = of_name(self._refused, name)
        if passed_over is not None:
            since = "this site has not what it needs" if passed_over.shipped else "its file was refused at the start"
            text = f"{name} is not served: {since}: {passed_over.why}"
            return Refused("not_served", text, passed_over.hint)
        load = unread_in(self._trees, name) if self._trees is not None else ""
        if load:
            return Refused("unknown_task", f"there is no task '{name}': its file was not read at the start", load)
        close = get_close_matches(name, self._tasks, n=1, cutoff=0.5)
        known = ", ".join(sorted(self._tasks)) or "none"
        return Refused("unknown_task", f"there is no task '{name}'", f"tasks: {known}", near=close)

    def ask(self, given: Input) -> Accepted | Done:
        """Hand an input to the engine and wait for its reply.

        Raises:
            Refused: the engine refuses it, or does not run.
        """
        return ask(self._driver, given, str(getattr(given, "target", "") or getattr(given, "task", "")))

    def abort(self, task_id: str, how: str = "", by: str = "", *, confirmed: bool = False) -> str:
        """End a task; return what happens now.

        Raises:
            Refused: unknown, ended, already ending, or `abandon` without a confirmation.
        """
        if how == "abandon" and not confirmed:
            raise Refused(
                "not_confirmed",
                "abandon leaves the task's machines where they are, also in the air, until a person clears them",
                'confirm it: {"how": "abandon", "confirmed": true}; formiga abort --abandon asks',
            )
        reply = self.ask(Abort(task_id, how, by))  # type: ignore[arg-type]
        self._view.catch_up()
        if how == "abandon":
            return with_keeping(f"{task_id} is abandoned; its machines are quarantined: formiga agents", reply)
        first = "what flies comes home" if how == "now" else "it tidies up, what flies comes home"
        return with_keeping(f"{task_id} ends: {first}; what stands away from its port stays there", reply)

    def tasks(self, status: str = "", limit: int = 100) -> TaskList:
        """Return tasks: those under way, then all others, each newest first.

        `status`: one of them, `open` for all that have not ended, or `held`.

        Raises:
            Refused: `bad_status`: no task is ever so.
        """
        if status and status.lower() not in ("open", "held") and status.upper() not in get_args(TaskStatus):
            known = ", ".join(("open", "held", *get_args(TaskStatus)))
            raise Refused("bad_status", f"no task is ever '{shortened(status)}'", f"one of {known}")
        now = self._driver.now()
        with self._view.reading() as state:
            fit = [t for t in state.tasks.values() if _fits(t, status)]
            fit.sort(key=lambda t: (t.status not in UNDER_WAY, -t.order))
            page, index = fit[:limit], UrgencyIndex(self._view.ledger, now)
            mine = {agent for task in page if task.section != "done" for agent in agents_of(task)}
            return TaskList(
                at=now,
                tasks=tuple(task_fact(index, task) for task in page),
                total=len(fit),
                orders=self._orders(state, mine, now),
                lockdown=lockdown_fact(state, now),
            )

    def _orders(self, state: EngineState, agents: Collection[str], now: Micros) -> tuple[OrderFact, ...]:
        return tuple(
            order_fact(state, order, now, self._catalogue) for order in state.orders.values() if order.agent in agents
        )

    def task(self, task_id: str) -> TaskDetail:
        """Return everything about a task.

        Raises:
            Refused: unknown.
        """
        self._view.recall([task_id])
        now = self._driver.now()
        with self._view.reading() as state:
            task = self._known(state, task_id)
            rows, lines = self._view.rows(task_id), self._view.notices(task_id)
            index = UrgencyIndex(self._view.ledger, max(now, state.now))
            return shown.task_detail(index, task, rows, lines, self._places_of(task))

    def why(self, task_id: str) -> Explanation:
        """Explain a task.

        Raises:
            Refused: unknown.
        """
        self._view.recall([task_id])
        now = self._driver.now()
        with self._view.reading() as state:
            task = self._known(state, task_id)
            because = self._because(state, task_id, now)
            waits = tuple(dict.fromkeys(cause.code for cause in causes_of(state, task) if cause.code))
        return Explanation(of=task.id, status=task.status, held=task.hold.words, because=because, waits=waits)

    def why_agent(self, agent: str) -> Explanation:
        """Explain a machine or person: who has it, which order stands on it, what its goals wait for, its task.

        Raises:
            Refused: unknown.
        """
        now = self._driver.now()
        with self._view.reading() as state:
            record = state.agents.get(agent)
            if record is None:
                raise Refused("unknown_agent", f"there is no agent '{agent}'", hint_for("unknown_agent"))
            because = tuple(replace(line, agent=agent) for line in self._because(state, agent, now))
        return Explanation(of=agent, status=record.pool, because=because)

    def why_rule(self, name: str) -> Explanation:
        """Explain a standing rule: what waits, what it watches, and what became of what happened.

        Raises:
            Refused: unknown.
        """
        now = self._driver.now()
        with self._view.reading() as state:
            if name not in state.rules:
                near = nearest(name, list(state.rules))
                raise Refused(
                    "unknown_rule", f"there is no rule '{shortened(name)}'", hint_for("unknown_rule"), near=near
                )
            of = f"{RULE_PREFIX}{name}"
            said, lines = explain(state, self._tasks, of, now, catalogue=self._catalogue)
        return Explanation(of=of, status=said.removeprefix(of).strip(), because=tuple(lines))

    def _because(self, state: EngineState, of: str, now: Micros) -> tuple[Because, ...]:
        _, lines = explain(
            state, self._tasks, of, now, catalogue=self._catalogue, wall=wall_us(), desk=self.desk_people,
            actions=[row.fact() for row in self._view.rows(of)],
        )  # fmt: skip
        return tuple(lines)

    def _known(self, state: EngineState, task_id: str) -> TaskRecord:
        task = state.tasks.get(task_id)
        if task is None:
            near = nearest(task_id, [*state.tasks, *state.agents])
            text = f"there is no task '{shortened(task_id)}' (any more)"
            raise Refused("unknown_task", text, "formiga tasks lists them", near=near)
        return task

    def _places_of(self, task: TaskRecord) -> StepPlaces | None:
        key = task.name, task.request.bundle
        model = self._tasks.version(*key)
        if key not in self._places and model is not None:
            self._places[key] = StepPlaces(model)
        return self._places.get(key)

    # -- agents ----------------------------------------------------------------------------------------------------
    def agents(self) -> AgentList:
        """Return all agents."""
        now = self._driver.now()
        with self._view.reading() as state:
            records = sorted(state.agents.values(), key=listing)
            agents = tuple(
                agent_fact(state, a, now, wall_us(), port_of(self._site, a), self.desk_people, self._frame)
                for a in records
            )
            orders = self._orders(state, state.agents, now)
            return AgentList(at=now, agents=agents, orders=orders, lockdown=lockdown_fact(state, now))

    def clear(self, agent: str, by: str = "") -> str:
        """Take a quarantined agent back, or one whose process was started anew.

        Raises:
            Refused: unknown, neither quarantined nor started anew, or not alive.
        """
        reply = self.ask(Operator("clear", agent, by))
        self._view.catch_up()
        with self._view.reading() as state:
            asked = state.agents[agent].quarantine == "asked"
        does = "is asked what it still does, and comes home if it may be airborne" if asked else "gets orders again"
        return with_keeping(f"{agent} {does}", reply)

    def removed(self, agent: str, by: str = "", confirmed: str = "") -> str:
        """Free the way and the place of a machine that counts as lost: a person took it away.

        Raises:
            Refused: unknown, a person, heard of, or not confirmed by its id.
        """
        if confirmed != agent:
            raise Refused(
                "not_confirmed",
                f"others may then fly where {agent} was last: say so only if you have seen that it does not fly",
                f'confirm it with the machine\'s id: {{"confirmed": "{agent}"}}; formiga agents removed {agent} asks for it',
            )
        reply = self.ask(Operator("removed", agent, by))
        self._view.catch_up()
        then = f"when it is back and fit: formiga agents clear {agent}"
        return with_keeping(f"{agent} counts as removed: its way and its place are free; {then}", reply)

    def report_event(self, agent: str, event: str, fields: Mapping[str, Any]) -> str:
        """Tell an event for a person who works at this desk; `fields` are texts, or JSON.

        Raises:
            Refused: see `Telling.tell`.
        """
        return self.telling.tell(agent, event, {name: text_of(value) for name, value in fields.items()})

    # -- people ----------------------------------------------------------------------------------------------------
    def inbox(self, person: str = "") -> QuestionList:
        """Return the open questions, oldest first; of one person if given."""
        now = self._driver.now()
        with self._view.reading() as state:
            questions = [q for q in state.questions.values() if q.reply is None and (not person or person in q.asked)]
            questions.sort(key=lambda q: q.order)
            return QuestionList(now, tuple(question_fact(state, q, self.desk_people) for q in questions))

    def answer(self, number: str, option: str, by: str = "", fields: Mapping[str, Any] | None = None) -> str:
        """Answer a question for a person who works at this desk; once the engine has it, return a text that says so.

        Args:
            number: of the question, for example `Q7`.
            option: one of its options.
            by: who answers.
            fields: of its form, by name, as texts or JSON.

        Raises:
            Refused: closed or unknown, no such option, fields that do not fit its form, somebody else answers it, several
                people here could, or the engine did not take it in time.
        """
        question = self._question(number)
        here = [person for person in question.asked if person in self.desk_people]
        if by and by not in question.asked:
            raise Refused("not_asked", f"{question.number} does not ask {by}", f"it asks {_names(question.asked)}")
        if not here or (by and by not in here):
            who = by or _names(question.asked) or "nobody"
            raise Refused(
                "not_here",
                f"{question.number} is answered by {who}, with their own app and not here",
                "let people answer at this engine: formiga up --desk PERSON:TYPE",
            )
        waiting = [p for p in ([by] if by else here) if not any(a.by == p for a in question.answers)]
        if len(waiting) > 1:
            raise Refused("who", f"{question.number} asks {_names(waiting)}", "say who answers: --by PERSON")
        if not waiting:
            raise Refused("already_answered", f"{by or _names(here)} answered {question.number} already")
        open_ = self._desk.find(question.number, waiting[0])
        if open_ is None:
            before = ", ".join(q.ask.number for q in self._desk.open_questions(waiting[0]))
            raise Refused(
                "not_shown",
                f"{question.number} is not shown to {waiting[0]} yet",
                f"answer {before} first" if before else "try again in a moment",
            )
        given = {name: text_of(value) for name, value in (fields or {}).items()}
        form = self.telling.read(question.number, {one.name: one.kind for one in question.form}, given)
        reply = self._answering.answer(open_, option, form)
        self._view.catch_up()
        return with_keeping(f"{question.number} is answered: {option} by {waiting[0]}", reply)

    def _question(self, number: str) -> Question:
        with self._view.reading() as state:
            for question in state.questions.values():
                if question.number.lower() == number.lower() or question.id == number:
                    return question
            asked = state.counters.get("question", 0)
        digits = number[1:] if number[:1] in "qQ" else ""
        if digits.isdigit() and 0 < int(digits) <= asked:
            raise Refused(
                "answer_late", f"{number} is closed: it was answered, withdrawn or has lapsed", "formiga inbox"
            )
        raise Refused("unknown_question", f"there is no question '{number}'", "formiga inbox lists the open ones")


def _fits(task: TaskRecord, status: str) -> bool:
    if status.lower() == "open":
        return task.section != "done"
    if status.lower() == "held":
        return bool(task.hold.causes)
    return not status or task.status == status.upper()


def _names(people: Sequence[str]) -> str:
    return " or ".join(people)


def text_of(value: Any) -> str:
    """Return a parameter as the text that `bind_params` reads: texts as they are, other JSON as JSON, which is YAML."""
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
