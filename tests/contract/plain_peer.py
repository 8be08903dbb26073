"""An agent written from docs/wire.md alone, in plain Zenoh and JSON: nothing of formiga_bt can be imported here.

It follows the script that `peer.py` tells of, and passes the same suite. What it needs and the page does not say is a gap
of the page.

Run as a process: plain_peer.py SITE ENDPOINT TYPE ID BOOT_ID LEASE_MS
"""

import hashlib
import heapq
import json
import math
import os
import queue
import sys
import time

sys.modules["formiga_bt"] = None  # type: ignore[assignment]  # an import of it raises

import zenoh

END = {"rejected", "succeeded", "failed", "canceled", "taken_over", "superseded"}
MOST_EPOCH = 2**31 - 1


def now_s():
    return time.monotonic()


class Agent:
    def __init__(self, site, endpoint, kind, name, boot, lease_ms):
        self.kind, self.name, self.boot = kind, name, boot
        self.goals, self.running = {}, []  # id -> its record; ids that have not ended
        self.engine, self.epoch, self.ignored, self.beat, self.far = "", 0, 0, 0, None
        self.clock = None  # (when it was heard, the beat)
        self.heard, self.silence, self.untold = now_s(), None, []
        self.status = {"control": "engine", "battery": 80.0, "landed": "unknown", "pose": None}
        self.last, self.seq, self.n = ("", ""), 0, 0
        self.unsure = [[], []]  # events since the newest beat, and since the one before
        self.calls, self.count, self.inbox = [], 0, queue.SimpleQueue()
        self.is_cut, self.lose, self.site = False, False, None
        self.session = zenoh.open(zenoh.Config.from_json5(json.dumps({
            "mode": "peer", "namespace": site, "listen": {"endpoints": []},
            "connect": {"endpoints": [endpoint], "timeout_ms": -1, "exit_on_failure": False,
                        "retry": {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2}},
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
            "transport": {"link": {"tx": {"lease": int(lease_ms)}}}})))  # fmt: skip
        card = json.dumps({
            "id": name, "type": kind, "boot_id": boot, "wire": 2, "limits": {"speed_m_s": 10.0},
            "actions": ["Go", {"name": "Look", "fields": {"at": {"type": "place"}}, "result": {}}],
        })  # fmt: skip

        def hear(what):
            return zenoh.handlers.Callback(lambda item: self.inbox.put((what, item)), None, indirect=False)

        def tell_card(query):
            with query:
                query.reply(self.key("card"), card)

        self.kept = [
            self.session.declare_queryable(self.key("card"), zenoh.handlers.Callback(tell_card, None, indirect=False)),
            self.session.declare_queryable(self.key("action/*/goal"), hear("goal")),
            self.session.declare_queryable(self.key("action/*/cancel"), hear("cancel")),
            self.session.declare_queryable(self.key("action/*/update"), hear("update")),
            self.session.declare_queryable(self.key("goals"), hear("query")),
            self.session.declare_subscriber("engine/clock", hear("clock")),
            self.session.declare_subscriber("engine/site", hear("site")),
            self.session.liveliness().declare_subscriber("engine/alive", hear("engine"), history=True),
        ]
        self.token = self.session.liveliness().declare_token(self.key("alive"))

    # The wire.

    def key(self, rest):
        return f"{self.kind}/{self.name}/{rest}"

    def put(self, rest, message, *, keep=True):
        if not self.is_cut:
            how = zenoh.CongestionControl.BLOCK if keep else zenoh.CongestionControl.DROP
            self.session.put(self.key(rest), json.dumps(message), congestion_control=how, express=True)

    def later(self, delay_s, call):
        self.count += 1
        heapq.heappush(self.calls, (now_s() + delay_s, self.count, call))

    def run(self):
        parent = os.getppid()
        self.tick()
        while os.getppid() == parent:
            wait = self.calls[0][0] - now_s() if self.calls else 0.1
            try:
                self.handle(*self.inbox.get(timeout=max(0.001, min(0.1, wait))))
                while True:
                    self.handle(*self.inbox.get_nowait())
            except queue.Empty:
                pass
            while self.calls and self.calls[0][0] <= now_s():
                heapq.heappop(self.calls)[2]()

    def handle(self, what, item):
        if what in ("clock", "site", "engine"):
            if not self.is_cut:
                self.hear(what, item)
            return
        if what == "sent":
            self.tell("sent", {"why": item})
            return
        with item as query:
            if self.is_cut:
                return
            try:
                asked = json.loads(query.payload.to_bytes())
                answer = {
                    "goal": self.on_goal, "cancel": self.on_cancel, "query": self.on_query, "update": self.on_update,
                }[what](asked)  # fmt: skip
            except (ValueError, KeyError, TypeError) as error:
                query.reply_err(str(error).encode())
                return
            query.reply(str(query.key_expr).replace("*", "any"), json.dumps(answer))

    def hear(self, what, item):
        if what == "clock":
            self.on_clock(json.loads(item.payload.to_bytes()))
            if self.site is None or self.site["engine_id"] != self.engine:
                self.ask_site()
        elif what == "site":
            site = json.loads(item.payload.to_bytes())
            ours = not self.engine or site["engine_id"] in ("", self.engine)
            old = self.site
            if ours and (old is None or old["engine_id"] != site["engine_id"] or site["epoch"] >= old["epoch"]):
                self.site = site
        elif item.kind == zenoh.SampleKind.PUT:
            self.ask_site()

    def ask_site(self):
        def reply(answer):
            if answer.ok is not None:
                self.inbox.put(("site", answer.ok))

        self.session.get("engine/site", zenoh.handlers.Callback(reply, None, indirect=False), timeout=1.0)

    def tick(self):
        """Every 0.1 s: the status, and whether the engine was silent for too long (rule 9)."""
        cut_off = self.silence is not None and now_s() > self.heard + self.silence
        if cut_off and self.status["control"] == "engine":
            self.take_control("failsafe")
        elif not cut_off and self.status["control"] == "failsafe":
            self.take_control("engine")
        self.put("status", self.full_status(), keep=False)
        self.later(0.1, self.tick)

    def full_status(self):
        self.seq += 1
        goal = self.goals[self.running[0]]["request"] if self.running else {}
        return {
            **self.status, "id": self.name, "type": self.kind, "boot_id": self.boot, "seq": self.seq,
            "stamp": self.engine_now(),
            "status": "EXECUTING ACTION" if goal else "STANDBY", "task_id": goal.get("task_id", "None"),
            "action_name": goal.get("action", ""), "beat": self.beat, "epoch": self.epoch, "epoch_ignored": self.ignored,
            "engine_id": self.engine,
            "site": self.site["version"] if self.site else "", "last_goal": self.last[0], "last_goal_state": self.last[1],
        }  # fmt: skip

    def engine_now(self):
        if self.clock is None:
            return int(now_s() * 1e6)
        heard, beat = self.clock
        return beat["engine_us"] + round((now_s() - heard) * 1e6 * beat["speed"])

    # Rules 3 and 4.

    def follows(self, message):
        other = message.get("engine_id", "")
        if not other or other == self.engine:
            return True
        if self.engine:
            if now_s() - self.heard < 30 or message["epoch"] > MOST_EPOCH:
                return False
            self.clock = None
            self.begin_epoch(message["epoch"], message["beat"])
        self.engine = other
        return True

    def believes(self, epoch):
        most = min(MOST_EPOCH, self.epoch + 1000) if self.epoch else MOST_EPOCH
        if epoch > most:
            self.ignored = min(epoch, 2**61)
        return epoch <= most

    def begin_epoch(self, epoch, beat):
        self.epoch, self.beat, self.far = epoch, beat, None
        self.tell_again()

    def tell_again(self):
        for event in (*self.unsure[1], *self.unsure[0]):
            self.put(f"event/{event['event']}", event)

    def on_clock(self, beat):
        if not self.follows(beat) or beat["epoch"] < self.epoch:
            return
        was_cut_off = self.silence is not None and now_s() > self.heard + self.silence
        if beat["epoch"] > self.epoch:
            if not self.believes(beat["epoch"]):
                return
            self.begin_epoch(beat["epoch"], beat["beat"])
        elif self.clock is not None and self.clock[1]["epoch"] == beat["epoch"]:
            far, self.far = self.far, None
            follows = far is not None and far < beat["beat"] <= far + 1000
            if beat["beat"] > self.beat + 1000 and not follows:
                self.far = beat["beat"]
            if beat["beat"] < self.beat or self.far is not None:
                return
        if was_cut_off:
            self.tell_again()
        self.beat, self.heard = max(self.beat, beat["beat"]), now_s()
        self.clock = (self.heard, beat)
        self.unsure = [[], self.unsure[0]]
        if was_cut_off:
            untold, self.untold = self.untold, []
            for goal in untold:
                record = self.goals[goal]
                self.put(f"action/{record['request']['action']}/event", self.answer(record["event"]))

    # Rules 1, 5, 6, 7, 8.

    def event(self, goal, state, n=1, **more):
        return {"goal_id": goal, "agent": self.name, "state": state, "n": n, **more}

    def answer(self, event):
        if event["state"] in END - {"rejected"}:
            return {**event, "status": self.full_status()}
        return event

    def on_goal(self, request):
        goal = request["goal_id"]
        if goal in self.goals:
            return self.answer(self.goals[goal]["event"])
        if not self.follows(request):
            return self.event(goal, "rejected", code="other_engine")
        if request["epoch"] < self.epoch:
            return self.event(goal, "rejected", code="epoch_old")
        if request["epoch"] > self.epoch:
            if not self.believes(request["epoch"]):
                return self.event(goal, "rejected", code="epoch_far")
            self.begin_epoch(request["epoch"], request["beat"])
        code = self.refusal(request)
        record = {"request": request, "event": self.event(goal, "rejected" if code else "accepted", code=code)}
        self.remember(goal, record)
        if code:
            return record["event"]
        rivals, self.heard = list(self.running), now_s()
        self.running.append(goal)
        fields = request.get("fields", {})
        if fields.get("block_s"):
            time.sleep(fields["block_s"])
        if fields.get("do") == "reject":
            self.running.remove(goal)
            record["event"] = self.event(goal, "rejected", code="battery_low")
            return record["event"]
        record["starts"] = 1
        if request.get("link_silence_s") is not None:
            self.silence = request["link_silence_s"]
        self.play(goal, fields)
        for rival in rivals:
            self.finish(rival, "superseded")
        return self.answer(record["event"])

    def passed(self):
        if self.clock is not None and self.clock[1]["epoch"] == self.epoch:
            return math.floor(now_s() - self.clock[0])
        return 0

    def refusal(self, request):
        if request["agent"] != self.name:
            return "wrong_agent"
        if self.beat + self.passed() > request["beat"] + request["ttl_beats"]:
            return "goal_expired"
        if request["action"] not in ("Go", "Look"):
            return "unknown_action"
        if self.status["control"] != "engine":
            return "not_in_command"
        return "busy" if self.running and not request.get("safety") else ""

    def remember(self, goal, record):
        self.goals[goal] = record
        if len(self.goals) > 1000 + len(self.running):
            del self.goals[next(one for one, old in self.goals.items() if old["event"]["state"] in END)]

    def on_cancel(self, asked):
        goal = asked["goal_id"]
        record = self.goals.get(goal)
        if record is None:
            barred = self.event(goal, "canceled", code="canceled_before_start")
            self.remember(goal, {"request": {"action": "any"}, "event": barred})
            return self.event(goal, "unknown", n=0)
        event = record["event"]
        if event["state"] in END or event["state"] == "canceling":
            return self.answer(event)
        if record["request"]["fields"].get("cancel") == "refuse":
            record["event"] = {**event, "n": event["n"] + 1}
            return {**record["event"], "cancel_refused": True}
        record["event"] = {**event, "n": event["n"] + 1, "state": "canceling"}
        self.later(0.02, lambda: self.finish(goal, "canceled"))
        return record["event"]

    def on_update(self, asked):
        record = self.goals.get(asked["goal_id"])
        code = self.no_update(asked, record)
        if not code and asked["n"] > record.get("updates", 0):
            fields = record["request"]["fields"]
            code = "no_update" if not fields.get("updates") else "bad_field" if list(asked["fields"]) != ["to"] else ""
            if not code:
                record["updates"] = asked["n"]
                record["changes"] = record.get("changes", 0) + 1
                fields.update(asked["fields"])
        stands = record.get("updates", 0) if record else 0
        return {"goal_id": asked["goal_id"], "agent": self.name, "n": asked["n"], "stands": stands, "code": code}

    def no_update(self, asked, record):
        if asked["agent"] != self.name:
            return "wrong_agent"
        if not self.follows(asked):
            return "other_engine"
        if asked["epoch"] < self.epoch:
            return "epoch_old"
        if asked["epoch"] > self.epoch:
            if not self.believes(asked["epoch"]):
                return "epoch_far"
            self.begin_epoch(asked["epoch"], asked["beat"])
        if self.beat + self.passed() > asked["beat"] + asked["ttl_beats"]:
            return "goal_expired"
        if record is None:
            return "unknown_goal"
        if record["event"]["state"] in END or record["event"]["state"] == "canceling":
            return "goal_ended"
        return "" if self.status["control"] == "engine" else "not_in_command"

    def on_query(self, asked):
        found = [
            self.answer(self.goals[goal]["event"]) if goal in self.goals else self.event(goal, "unknown", n=0)
            for goal in asked["goal_ids"] or list(self.running)
        ]
        return {"boot_id": self.boot, "goals": found}

    def finish(self, goal, state, **more):
        record = self.goals.get(goal)
        if record is None or record["event"]["state"] in END:
            return
        self.running.remove(goal)
        record["event"] = {**record["event"], "n": record["event"]["n"] + 1, "state": state, **more}
        self.last = (goal, state)
        if self.silence is not None and now_s() > self.heard + self.silence:
            self.untold.append(goal)
        if self.lose:
            self.lose = False
        else:
            self.put(f"action/{record['request']['action']}/event", self.answer(record["event"]))

    def take_control(self, control):
        if control != self.status["control"]:
            self.status["control"] = control
            if control != "engine":
                for goal in list(self.running):
                    self.finish(goal, "taken_over")
            self.put("status", self.full_status(), keep=False)

    # The script.

    def play(self, goal, fields):
        if fields.get("deaf_s"):
            self.later(0.1, lambda: self.cut(vanishes=bool(fields.get("vanishes"))))
            self.later(0.1 + fields["deaf_s"], self.mend)
        for level in fields.get("tell", ()):
            self.tell("alarm", {"level": level})
        step = at = fields.get("step_s", 0.01)
        for progress in fields.get("feedback", ()):
            self.later(at, lambda progress=progress: self.feedback(goal, progress))
            at += step
        self.later(at, lambda: self.end(goal, fields))

    def feedback(self, goal, progress):
        record = self.goals[goal]
        if record["event"]["state"] in END:
            return
        state = "canceling" if record["event"]["state"] == "canceling" else "running"
        record["event"] = {
            **record["event"],
            "n": record["event"]["n"] + 1,
            "state": state,
            "progress": progress,
            "phase": "moving",
        }
        self.put(f"action/{record['request']['action']}/event", record["event"])

    def end(self, goal, fields):
        self.lose = bool(fields.get("lose"))
        match fields.get("do", "succeed"):
            case "succeed":
                self.status |= {"pose": {"east_m": 1.0, "north_m": 2.0, "up_m": 3.0}, "landed": "airborne"}
                record = self.goals[goal]
                told = {"to": fields["to"], "updates": record.get("changes", 0)} if fields.get("updates") else {}
                files = self.files(fields) if "attach" in fields else []
                self.finish(
                    goal,
                    "succeeded",
                    attachments=files,
                    result={**fields.get("result", {}), **told, "starts": record["starts"]},
                )
            case "fail":
                self.finish(goal, "failed", code="motor", text="the motor is hot")
            case "takeover":
                self.take_control("pilot")
                self.later(0.5, lambda: self.take_control("engine"))

    def files(self, fields):
        data = fields["attach"].encode()
        digest = hashlib.sha256(data).hexdigest()
        said = []

        def reply(answer):
            said.append("" if answer.ok is not None else answer.err.payload.to_bytes().decode().partition(":")[0])

        def over():
            self.inbox.put(("sent", said[0] if said else "unreachable"))

        payload = b"other" if fields.get("bad_hash") else data
        handler = zenoh.handlers.Callback(reply, over, indirect=False)
        self.session.get(f"engine/attachments/{digest}", handler, payload=payload, timeout=10.0)
        return [{"name": "note.txt", "media_type": "text/plain", "size": len(data), "sha256": digest}]

    def tell(self, event, fields):
        self.n += 1
        told = {"agent": self.name, "event": event, "boot_id": self.boot, "n": self.n, "stamp": self.engine_now(),
                "fields": fields}  # fmt: skip
        self.unsure[0].append(told)
        del self.unsure[0][:-100]
        self.put(f"event/{event}", told)

    def cut(self, *, vanishes):
        self.is_cut = True
        if vanishes:
            self.token.undeclare()
            self.token = None

    def mend(self):
        self.is_cut = False
        if self.token is None:
            self.token = self.session.liveliness().declare_token(self.key("alive"))


if __name__ == "__main__":
    Agent(*sys.argv[1:]).run()
