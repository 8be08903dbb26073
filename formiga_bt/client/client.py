"""The client of an engine: what can be asked and ordered, with the facts of `show.facts` as answers.

It is a `Source` of pictures, as a ledger of this process is. Facts are imported when the first answer is read, after an order
that stops machines has been sent: it waits for no import.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, TypeVar

from formiga_bt.base.errors import FormigaError
from formiga_bt.client.calls import ApiError, Calls, UnknownId, segment

if TYPE_CHECKING:
    from formiga_bt.show import facts as f

T = TypeVar("T")
RULE: Final = "rule:"
GONE: Final = "no_such_route"


class Client(Calls):
    """One engine's API.

    Each method raises `ApiError` if the engine says no (`UnknownId` for an id that it does not have), `NoEngine` if it does not
    answer. Ids go into paths as they are; texts of answers have `?` for what would steer a terminal.
    """

    # -- any route ---------------------------------------------------------------------------------------------------
    def get(self, kind: type[T], path: str, **query: Any) -> T:
        """Return what a GET answers, as facts of one kind; empty parts of the query are left out."""
        try:
            return self._decoded(kind, self.read(path, query))
        except ApiError as error:
            if error.code == GONE:
                raise self._other_version() from error
            raise

    def post(
        self, kind: type[T], path: str, body: Any = None, *, key: str = "", headers: Mapping[str, str] | None = None
    ) -> T:
        """Return what a POST answers, as facts of one kind; `key` is its Idempotency-Key."""
        return self._decoded(kind, self.send(path, body, key=key, headers=headers))

    def _decoded(self, kind: type[T], text: bytes) -> T:
        import msgspec

        try:
            return msgspec.json.decode(text, type=kind)
        except msgspec.ValidationError as error:
            raise self._other_version() from error
        except msgspec.DecodeError as error:
            raise self._stranger() from error

    def _other_version(self) -> FormigaError:
        return FormigaError(
            f"the engine at {self.address.url} is of another version of formiga",
            help="formiga --version shows yours, GET /v1/health its own; install the same on both sides",
        )

    def _said(self, path: str, body: Any = None) -> str:
        text = self.send(path, body)
        from formiga_bt.show.facts import OrderDone

        return self._decoded(OrderDone, text).text

    # -- pictures: a `Source` ----------------------------------------------------------------------------------------
    def now(self, *, first: int = 0, count: int = 100, find: str = "", over: bool = False) -> "f.Now":
        """Return the site at its instant; see `Source.now`."""
        from formiga_bt.show.facts import Now

        return self.get(Now, "/v1/now", first=first, count=count, find=find, over="1" if over else "")

    def task(self, task_id: str) -> "f.TaskPicture":
        """Return one task with its tree."""
        from formiga_bt.show.facts import TaskPicture

        return self.get(TaskPicture, f"/v1/tasks/{segment(task_id)}/picture")

    def why(self, of: str) -> "tuple[str, list[f.Because]]":
        """Return how a task or an agent stands, and the chain of causes."""
        found = self.explanation(of)
        return found.headline, list(found.because)

    def timeline(self, tasks: Sequence[str] = ()) -> "f.Timeline":
        """Return the actions of some tasks, or of all."""
        from formiga_bt.show.facts import Timeline

        return self.get(Timeline, "/v1/timeline", task=list(tasks))

    def chart(self, tasks: Sequence[str] = ()) -> "f.Chart":
        """Return the site's map."""
        from formiga_bt.show.facts import Chart

        return self.get(Chart, "/v1/chart", task=list(tasks))

    def stats(self, *, task: str = "", hours: float = 0.0) -> "f.Stats":
        """Return durations with their spread, of the last hours; 0: since the engine's start."""
        from formiga_bt.show.facts import Stats

        return self.get(Stats, "/v1/stats", task=task, hours=hours or "")

    def blackboard(self, prefix: str = "/") -> "f.BlackboardFact":
        """Return the keys of the blackboard that begin with this, such as `/fleet/` or `/allocation/requests/`."""
        from formiga_bt.show.facts import BlackboardFact

        return self.get(BlackboardFact, "/v1/blackboard", prefix=prefix)

    # -- tasks -------------------------------------------------------------------------------------------------------
    def request(
        self,
        task: str,
        params: Mapping[str, Any] | None = None,
        *,
        priority: str | None = None,
        by: str = "",
        bundle: str = "",
        wait_s: float | None = None,
        expires_s: float | None = None,
        not_before: str = "",
        after: Sequence[str] = (),
        deadline: str = "",
        if_late: str = "run",
        key: str = "",
        params_from: Sequence[Mapping[str, str]] = (),
    ) -> str:
        """Request a task; return its id.

        Args:
            task: its name.
            params: by name, each a text as on the command line ("60 m", "camp") or JSON.
            priority: low, medium or high; None: the task's own.
            by: who requests it.
            bundle: of the version that is meant; empty: the newest.
            wait_s: how long at most it waits for its first agents; None: as its roles say.
            expires_s: the longest time PENDING; None: as the task says.
            not_before: it is not served before: "14:00" of today or a date and time, in the site's time zone.
            after: ids of tasks that must have SUCCEEDED first.
            deadline: its end is wanted by then, written as `not_before`.
            if_late: run, drop (it ends if it has not begun) or fail (it ends in any case), at the deadline.
            key: the same once more starts nothing, and returns the same id.
            params_from: files with further parameters: `file`, its name, `text`, and `param` if it is for one of another name.
        """
        from formiga_bt.show.facts import TaskRequested

        body: dict[str, Any] = {
            "task": task, "params": dict(params or {}), "priority": priority, "by": by, "bundle": bundle,
            "wait_s": wait_s, "expires_s": expires_s,
        }  # fmt: skip
        if not_before:
            body["not_before"] = not_before
        if after:
            body["after"] = list(after)
        if deadline:
            body |= {"deadline": deadline, "if_late": if_late}
        if params_from:
            body["params_from"] = [dict(one) for one in params_from]
        return self.post(TaskRequested, "/v1/tasks", body, key=key).id

    def tasks(self, status: str = "", limit: int = 100) -> "f.TaskList":
        """Return tasks, those under way first; `status`: one of them, open or held; empty: all."""
        from formiga_bt.show.facts import TaskList

        return self.get(TaskList, "/v1/tasks", status=status, limit=limit)

    def detail(self, task_id: str) -> "f.TaskDetail":
        """Return everything about a task."""
        from formiga_bt.show.facts import TaskDetail

        return self.get(TaskDetail, f"/v1/tasks/{segment(task_id)}")

    def bytes_of(self, digest: str) -> bytes:
        """Return the bytes of an attachment.

        Raises:
            ApiError: they are not here.
        """
        return self.raw(f"/v1/attachments/{segment(digest)}")

    def explanation(self, of: str) -> "f.Explanation":
        """Return why a task, or else an agent, stands as it does; or a rule (`rule:sos`)."""
        from formiga_bt.show.facts import Explanation
        from formiga_bt.show.why.near import shortened

        if of.startswith(RULE):
            return self.get(Explanation, f"/v1/rules/{segment(of.removeprefix(RULE))}/why")
        try:
            return self.get(Explanation, f"/v1/tasks/{segment(of)}/why")
        except UnknownId as unknown:
            try:
                return self.get(Explanation, f"/v1/agents/{segment(of)}/why")
            except UnknownId as error:
                if named := next((one for one in (unknown, error) if one.near), None):
                    raise named from None
                text, help_ = (
                    f"there is no task '{shortened(of)}', and no agent",
                    "formiga tasks and formiga agents list them",
                )
                raise UnknownId(unknown.code, text, help=help_, status=unknown.status) from None

    def abort(self, task_id: str, how: str = "", *, by: str = "", confirmed: bool = False) -> str:
        """End a task; return what happens now. `how`: now (no cleanup), or abandon, which must be confirmed."""
        return self._said(f"/v1/tasks/{segment(task_id)}/abort", {"how": how, "confirmed": confirmed, "by": by})

    def assign(self, task_id: str, agent: str, role: str = "", *, by: str = "") -> "f.AssignedFact":
        """Give an agent to a task that waits for agents; `role`: needed if it could take several."""
        return self._assigned(f"/v1/tasks/{segment(task_id)}/assign", {"agent": agent, "role": role, "by": by})

    def unassign(self, agent: str, *, by: str = "") -> "f.AssignedFact":
        """Take an agent back from its task."""
        return self._assigned(f"/v1/agents/{segment(agent)}/unassign", {"by": by})

    def _assigned(self, path: str, body: Mapping[str, str]) -> "f.AssignedFact":
        from formiga_bt.show.facts import AssignedFact

        return self.post(AssignedFact, path, body)

    def prioritize(self, task_id: str, priority: str, *, first: bool = False, by: str = "") -> str:
        """Give a task that waits another priority (low, medium, high), or the first place in it; return what happened."""
        return self._said(f"/v1/tasks/{segment(task_id)}/priority", {"priority": priority, "first": first, "by": by})

    def zones(self) -> "f.ZoneList":
        """Return what people closed for machines."""
        from formiga_bt.show.facts import ZoneList

        return self.get(ZoneList, "/v1/zones")

    def close_zone(self, zone: str, reason: str, *, by: str = "") -> str:
        """Close a region, or 30 m around a place, for machines; return what happened."""
        return self._said(f"/v1/zones/{segment(zone)}/close", {"reason": reason, "by": by})

    def open_zone(self, zone: str, *, by: str = "") -> str:
        """Open what was closed; return what happened."""
        return self._said(f"/v1/zones/{segment(zone)}/open", {"by": by})

    def rules(self) -> "f.RuleList":
        """Return the standing rules of the site."""
        from formiga_bt.show.facts import RuleList

        return self.get(RuleList, "/v1/rules")

    def rule_word(self, rule: str, do: str, *, agent: str = "", by: str = "") -> str:
        """Say what becomes of something that happened and waits: `start` or `dismiss`; return what happened."""
        return self._said(f"/v1/rules/{segment(rule)}/{segment(do)}", {"agent": agent, "by": by})

    def alarms(self, *, cleared: bool = False) -> "f.AlarmList":
        """Return the open alarms; with `cleared` also the newest of those that are over."""
        from formiga_bt.show.facts import AlarmList

        return self.get(AlarmList, "/v1/alarms", cleared="true" if cleared else "")

    def acknowledge(self, alarm: str, *, by: str = "", note: str = "") -> str:
        """Say that somebody takes care of an alarm; return what happened."""
        return self._said(f"/v1/alarms/{segment(alarm)}/ack", {"by": by, "note": note})

    def news(self) -> "f.ChannelList":
        """Return the channels of the site's news."""
        from formiga_bt.show.facts import ChannelList

        return self.get(ChannelList, "/v1/news")

    def test_news(self, channel: str) -> "f.ChannelTried":
        """Send a test message to a channel of the site's news; return what came back."""
        text = self.send(f"/v1/news/{segment(channel)}/test", {})
        from formiga_bt.show.facts import ChannelTried

        return self._decoded(ChannelTried, text)

    def library(self) -> "f.LibraryList":
        """Return the tasks that can be requested."""
        from formiga_bt.show.facts import LibraryList

        return self.get(LibraryList, "/v1/library")

    # -- machines and people -----------------------------------------------------------------------------------------
    def agents(self) -> "f.AgentList":
        """Return machines and people."""
        from formiga_bt.show.facts import AgentList

        return self.get(AgentList, "/v1/agents")

    def order(self, order: str, target: str = "", *, by: str = "") -> "f.OrderReply":
        """Order hold, return, land or continue for a machine or a task, or (`target` empty) for all.

        What is no machine is taken for a task.
        """
        if not target:
            return self.order_all(order, by=by)
        try:
            return self.order_agent(target, order, by=by)
        except UnknownId:
            return self.order_task(target, order, by=by)

    def order_agent(self, agent: str, order: str, *, by: str = "", confirmed: str = "") -> "f.OrderReply":
        """Order hold, return, land, continue or cut for a machine; cut must be confirmed by the machine's id."""
        more = {"confirmed": confirmed} if confirmed else {}
        return self._ordered(f"/v1/agents/{segment(agent)}/orders", {"order": order, "by": by, **more})

    def order_task(self, task_id: str, order: str, *, by: str = "") -> "f.OrderReply":
        """Order hold, return, land, continue or restart for all machines of a task."""
        return self._ordered(f"/v1/tasks/{segment(task_id)}/orders", {"order": order, "by": by})

    def order_all(self, order: str, *, by: str = "") -> "f.OrderReply":
        """Order hold, return, land or continue for every machine of the site."""
        return self._ordered("/v1/orders", {"order": order, "by": by})

    def lock_down(self, how: str = "return", *, by: str = "") -> "f.OrderReply":
        """Press lockdown: what flies does `how` (hold, return, land); or release it."""
        return self._ordered("/v1/lockdown", {"how": how, "by": by})

    def lockdown(self) -> "f.LockdownFact":
        """Return how lockdown stands."""
        from formiga_bt.show.facts import LockdownFact

        return self.get(LockdownFact, "/v1/lockdown")

    def hand_back(self, agent: str, how: str = "end", *, by: str = "") -> "f.OrderReply":
        """Give a machine back that its pilot had taken over; `how`: continue, return or end."""
        return self._ordered(f"/v1/agents/{segment(agent)}/handback", {"how": how, "by": by})

    def _ordered(self, path: str, body: Mapping[str, str]) -> "f.OrderReply":
        text = self.send(path, body)
        from formiga_bt.show.facts import OrderReply

        return self._decoded(OrderReply, text)

    def out(self, agent: str, reason: str, *, by: str = "") -> str:
        """Take a machine out of service; return what happens now."""
        return self._said(f"/v1/agents/{segment(agent)}/out", {"reason": reason, "by": by})

    def back(self, agent: str, *, by: str = "") -> str:
        """Take a machine back into service."""
        return self._said(f"/v1/agents/{segment(agent)}/in", {"by": by})

    def clear(self, agent: str, *, by: str = "") -> str:
        """Take a quarantined machine back that a person has looked at; return what happens now."""
        return self._said(f"/v1/agents/{segment(agent)}/clear", {"by": by})

    def removed(self, agent: str, *, confirmed: str, by: str = "") -> str:
        """Say that a lost machine was taken away; `confirmed` repeats its id."""
        return self._said(f"/v1/agents/{segment(agent)}/removed", {"confirmed": confirmed, "by": by})

    def preflight(self, agent: str) -> "f.PreflightFact":
        """Return whether a machine is ready to fly."""
        from formiga_bt.show.facts import PreflightFact

        return self.get(PreflightFact, f"/v1/agents/{segment(agent)}/preflight")

    def questions(self, person: str = "") -> "f.QuestionList":
        """Return the open questions, oldest first; of one person if given."""
        from formiga_bt.show.facts import QuestionList

        return self.get(QuestionList, "/v1/inbox", person=person)

    def answer(self, number: str, option: str, *, by: str = "", fields: Mapping[str, Any] | None = None) -> str:
        """Answer a question for a person who works at the engine's desk; `fields` of its form, as texts or JSON."""
        more = {"fields": dict(fields)} if fields else {}
        return self._said(f"/v1/inbox/{segment(number)}/answer", {"option": option, "by": by, **more})

    def report_event(self, agent: str, event: str, fields: Mapping[str, Any] | None = None) -> str:
        """Report an event for a person who works at the engine's desk."""
        return self._said(f"/v1/agents/{segment(agent)}/events", {"event": event, "fields": dict(fields or {})})

    # -- the engine --------------------------------------------------------------------------------------------------
    def health(self) -> "f.EngineHealth":
        """Return how the engine is."""
        from formiga_bt.show.facts import EngineHealth

        return self.get(EngineHealth, "/v1/health")

    def drain(self) -> str:
        """Have the engine admit nothing more, and end when all tasks have."""
        return self._said("/v1/admin/drain")

    def stop(self) -> str:
        """Have the engine end now; agents go on with what they do."""
        return self._said("/v1/admin/stop")

    def events(self, after: str = "", task: str = "") -> "Iterator[f.EventFact | None]":
        """Yield what happens, and None as signs of life in between; ends with the engine.

        Args:
            after: the id `<epoch>.<n>` of an event; empty: from now on.
            task: only what concerns this one.
        """
        from formiga_bt.show.facts import EventFact

        for data in self.stream(after, task):
            yield self._decoded(EventFact, data) if data else None


class PastClient(Client):
    """An engine's API at a moment of its journal; as a `Source` it shows what was then.

    Args:
        client: of the engine.
        moment: as people write it: `10:15`, `-5 min`, `PickUp-3 end`, an ISO time.
    """

    def __init__(self, client: Client, moment: str) -> None:
        super().__init__(client.address, client.token)
        self.moment = moment

    def now(self, *, first: int = 0, count: int = 100, find: str = "", over: bool = False) -> "f.Now":
        """Return the site at its instant."""
        from formiga_bt.show.facts import Now

        more = {"first": first, "count": count, "find": find, "over": "1" if over else "0"}
        return self.get(Now, "/v1/past", at=self.moment, **more)

    def task(self, task_id: str) -> "f.TaskPicture":
        """Return one task with its tree."""
        return self._of(task_id).picture

    def why(self, of: str) -> "tuple[str, list[f.Because]]":
        """Return how a task stood, and the chain of causes."""
        found = self._of(of)
        task = found.picture.task
        return f"{task.id} {task.status}" + (" HELD" if task.held else ""), list(found.because)

    def timeline(self, tasks: Sequence[str] = ()) -> "f.Timeline":
        """Return the actions of some tasks, or of all of a day."""
        from formiga_bt.show.facts import Timeline

        return self.get(Timeline, "/v1/past/timeline", at=self.moment, task=list(tasks))

    def chart(self, tasks: Sequence[str] = ()) -> "f.Chart":
        """Return the site's map."""
        from formiga_bt.show.facts import Chart

        return self.get(Chart, "/v1/past/chart", at=self.moment, task=list(tasks))

    def stats(self, *, task: str = "", hours: float = 0.0) -> "f.Stats":
        """Return durations with their spread."""
        from formiga_bt.show.facts import Stats

        return self.get(Stats, "/v1/past/stats", at=self.moment, task=task, hours=hours or "")

    def blackboard(self, prefix: str = "/") -> "f.BlackboardFact":
        """Return the keys of the blackboard that begin with this, as they stood."""
        from formiga_bt.show.facts import BlackboardFact

        return self.get(BlackboardFact, "/v1/past/blackboard", at=self.moment, prefix=prefix)

    def _of(self, task_id: str) -> "f.PastTask":
        from formiga_bt.show.facts import PastTask

        return self.get(PastTask, f"/v1/past/tasks/{segment(task_id)}", at=self.moment)
