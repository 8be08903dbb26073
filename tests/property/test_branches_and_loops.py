"""Parallel, loops, live conditions, `finally` and release at the edges of their rules, by nodes, oracle and py_trees' tick.

Each name says the rule. The numbers of seconds: agents need 1 s for an action unless a `Deed` says else, tasks start at 1 s.
"""

import json
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.tasks.treerun import CompiledTrees
from tests.oracle.naive import NaiveTrees
from tests.property.strategies import Mission, load
from tests.property.test_differential import assert_equal
from tests.property.world import START, Deed, Event, Scripted, World

SLOW = Deed(after=9.0, cancel_after=2.0)
FAILS = Deed(end="failed")
SILENT = Deed(end="never", cancel="never")
REFUSES, LONG = Deed(after=30.0, follows="not_now"), Deed(after=30.0)
ONE, TWO = {"do": "one.Move"}, {"do": "two.Move"}
NEVER = {"wait": "1 s", "when": "n == 7"}
FOLLOW = {"do": "one.Move", "with": {"far": "${n + 1}"}, "track": {"every": "1 s"}}
COUNT = {"set": {"n": "${n + 1}"}}
FIVE = "now > t5"


def say(text: str) -> dict[str, Any]:
    return {"notify": f"={text}" if text.startswith("${") else text}  # a text, not a number


def after(seconds: float, *steps: dict[str, Any]) -> dict[str, Any]:
    return {"sequence": [{"wait": f"{seconds} s"}, *steps]}


def text_of(task: dict[str, Any]) -> str:
    head = {
        "formiga": 1,
        "task": "Edge",
        "params": {"t5": {"type": "time", "default": "1970-01-12T13:46:45Z"}},
        "vars": {"n": "${0}", "flag": "${1 > 2}", "kept": {"type": "int"}},
        "agents": {"one": {"type": "cart"}, "two": {"type": "cart"}},
    }
    return json.dumps({**head, **task}, indent=1)


Case = tuple[list[dict[str, Any]], dict[str, list[Deed]], list[Event], str, str, list[str]]

CASES: dict[str, Case] = {
    # rule: steps, deeds, events; status, code, and "seconds text" of what was told
    "parallel: need all waits for all": (
        [{"parallel": [after(1, say("a")), after(3, say("b"))]}, say("end")],
        {}, [], "SUCCEEDED", "", ["2 a", "4 b", "4 end"],
    ),
    "fail: what it carries is there where it is caught, for the failure that was caught": (
        [{"fallback": [
            {"sequence": [{"do": "one.Move", "save_as": "got"}, {"fail": "far", "with": {"n": "${got.n * 2}", "who": "x"}}]},
            {"sequence": [{**say("${error.data.n}"), "when": "is_set(error.data.n)"}, {"fail": "again"}]},
            {"sequence": [{**say("no"), "when": "is_set(error.data.n)"}, say("${error.reason}")]}]}],
        {"c1": [Deed(n=21)]}, [], "SUCCEEDED", "", ["2 =42", "2 =again"],
    ),
    "fail: a failure of another step carries nothing": (
        [{"fallback": [
            {"sequence": [ONE, {"fail": "far", "with": {"n": 1}}]},
            {"sequence": [{**say("${error.data.n}"), "when": "is_set(error.data.n)"}, say("${error.code}")]}]}],
        {"c1": [FAILS]}, [], "SUCCEEDED", "", ["2 =failed:stuck"],
    ),
    "race: a handler beside the work takes each event, also those that come while it is busy, and ends with the work": (
        [{"race": [
            after(6),
            {"repeat": "forever", "steps": [
                {"wait_for": "two.ping", "since": "task", "save_as": "got"}, {"wait": "1 s"}, say("${got.n}")]},
        ]}, say("end")],
        {}, [Event(t, "ping", "c2") for t in (2.0, 2.2, 2.4, 8.0)], "SUCCEEDED", "", ["3 =1", "4 =2", "5 =3", "7 end"],
    ),
    "race: an event interrupts the work of a machine, which does something else and goes on": (
        [{"repeat": "forever", "steps": [
            {"race": [ONE, {"wait_for": "two.ping", "timeout": "1 min", "save_as": "got"}]},
            {"break_if": "not is_set(got)"},
            {"do": "one.Move"}, say("${got.n}"),
        ]}, say("end")],
        {"c1": [SLOW, Deed(), Deed(after=2.0)]}, [Event(3.0, "ping", "c2")], "SUCCEEDED", "", ["6 =1", "8 end"],
    ),
    "track: the agent is told of what has changed, at the next look": (
        [{"parallel": [FOLLOW, after(1.5, COUNT, {"wait": "1.7 s"}, COUNT, COUNT)]}, say("end")],
        {"c1": [SLOW]}, [], "SUCCEEDED", "", ["3 c1 {'far': 2}", "5 c1 {'far': 4}", "10 end"],
    ),
    "track: what has not changed is not told again": (
        [{"parallel": [FOLLOW, after(1.5, COUNT, {"wait": "0.7 s"}, {"set": {"n": 0}}, {"wait": "0.2 s"}, COUNT)]}, say("end")],
        {"c1": [SLOW]}, [], "SUCCEEDED", "", ["3 c1 {'far': 2}", "10 end"],
    ),
    "track: after 10 s without an accepted update the goal is canceled, and the step fails": (
        [{"fallback": [{"race": [FOLLOW, after(1.5, COUNT, {"wait": "1 min"})]}, say("${error.code}")]}],
        {"c1": [replace(REFUSES, cancel_after=2.0)]}, [], "SUCCEEDED", "",
        [*(f"{n} c1 {{'far': 2}}" for n in range(3, 14)), "15 =no_update"],
    ),
    "track: one that is taken in time makes the 10 s begin anew": (
        [{"race": [FOLLOW, {"repeat": "forever", "every": "6 s", "steps": [COUNT]}]}, say("end")],
        {"c1": [LONG]}, [], "SUCCEEDED", "",
        ["2 c1 {'far': 2}", "7 c1 {'far': 3}", "13 c1 {'far': 4}", "19 c1 {'far': 5}", "25 c1 {'far': 6}", "31 end"],
    ),
    "track: a target that comes back in time needs no update": (
        [{"parallel": [FOLLOW, after(1.5, COUNT, {"wait": "8 s"}, {"set": {"n": 0}})]}, say("end")],
        {"c1": [REFUSES]}, [], "SUCCEEDED", "",
        [*(f"{n} c1 {{'far': 2}}" for n in range(3, 11)), "31 end"],
    ),
    "track: work that is done while it is being canceled counts": (
        [{"parallel": [FOLLOW, after(1.5, COUNT)]}, say("end")],
        {"c1": [replace(REFUSES, after=13.0, cancel="refuse")]}, [], "SUCCEEDED", "",
        [*(f"{n} c1 {{'far': 2}}" for n in range(3, 14)), "14 end"],
    ),
    "track: what cannot be computed leaves the old target in force, for 10 s": (
        [{"fallback": [
            {"race": [
                {"do": "one.Move", "with": {"far": "${10 // (1 - n)}"}, "track": {"every": "3 s"}},
                after(1.5, COUNT, {"wait": "1 min"})]},
            say("${error.code}")]}],
        {"c1": [LONG]}, [], "SUCCEEDED", "", ["14 =no_update"],
    ),
    "track: a halt cancels the goal, also while it gives up": (
        [{"sequence": [{"parallel": [FOLLOW, after(1.5, COUNT)]}], "timeout": "13 s", "ignore_failure": True}, say("end")],
        {"c1": [replace(REFUSES, cancel_after=5.0)]}, [], "SUCCEEDED", "",
        [*(f"{n} c1 {{'far': 2}}" for n in range(3, 14)), "18 end"],
    ),
    "track: a goal that goes on after a hold is sent anew, with what is true then": (
        [{"parallel": [FOLLOW, {"sequence": [{"wait_for": "two.pong"}, COUNT, say("n")], "timeout": "1 min"}]}, say("end")],
        {"c1": [SLOW, SLOW]}, [Event(2.5, "hold", "Edge-1"), Event(3.0, "pong", "c2"), Event(7.5, "continue", "Edge-1")],
        "SUCCEEDED", "", ["3 n", "16 end"],
    ),
    "retry: on names what is tried again": (
        [{**ONE, "retry": {"attempts": 3, "on": ["stuck"]}}, say("end")],
        {"c1": [Deed(end="failed"), Deed(end="rejected"), Deed()]}, [], "FAILED", "rejected", [],
    ),
    "retry: failed names each failure with a word of its own": (
        [{**ONE, "retry": {"attempts": 3, "on": ["failed"]}}, say("end")],
        {"c1": [Deed(end="failed"), Deed(end="failed"), Deed()]}, [], "SUCCEEDED", "", ["4 end"],
    ),
    "retry: unless names what is not tried again": (
        [{**ONE, "retry": {"attempts": 3, "unless": ["stuck"]}}, say("end")],
        {"c1": [Deed(end="rejected"), Deed(end="failed"), Deed()]}, [], "FAILED", "failed:stuck", [],
    ),
    "repeat: what a round saved has no value in the next one": (
        [COUNT, {"repeat": 2, "steps": [
            {"do": "one.Move", "save_as": "got", "when": "n == 1"}, {**say("a"), "when": "is_set(got)"}, COUNT]},
            {**say("b"), "when": "is_set(got)"}],
        {"c1": [Deed()]}, [], "SUCCEEDED", "", ["2 a"],
    ),
    "while: what a round saved has no value in the next one, in a loop inside either": (
        [{"while": "n < 2", "steps": [
            {"for": {"i": "${[1, 2]}"}, "steps": [
                {"do": "one.Move", "save_as": "got", "when": "n == 0 and i == 1"}, {**say("a"), "when": "is_set(got)"}]},
            COUNT]}],
        {"c1": [Deed()]}, [], "SUCCEEDED", "", ["2 a"],
    ),
    "repeat: what was saved before the loop keeps its value": (
        [{"do": "one.Move", "save_as": "got", "when": "n < 9"}, {"repeat": 2, "steps": [
            {**say("${got.n}"), "when": "is_set(got)"}]}],
        {"c1": [Deed()]}, [], "SUCCEEDED", "", ["2 =1", "2 =1"],
    ),
    "repeat: after the loop a name has the value of the last round": (
        [{"repeat": 2, "steps": [{"do": "one.Move", "save_as": "got"}]}, say("${got.n}")],
        {"c1": [Deed(n=4), Deed(n=5)]}, [], "SUCCEEDED", "", ["3 =5"],
    ),
    "set: a var without a value has one once it is set, and none after null": (
        [{"repeat": 2, "steps": [
            {**say("a"), "when": "is_set(kept)"}, {"wait": "1 s"}, {"set": {"kept": "${n + 4}"}}, COUNT]},
         say("${kept}"), {"set": {"kept": None}}, {**say("b"), "when": "is_set(kept)"}],
        {}, [], "SUCCEEDED", "", ["2 a", "3 =5"],
    ),
    "retry: what an attempt saved has no value in the next one": (
        [{"sequence": [
            {"do": "one.Move", "save_as": "got", "when": "n == 0"}, {**say("a"), "when": "is_set(got)"},
            COUNT, {"check": "n > 1"}],
          "retry": {"attempts": 2, "delay": "1 s"}}],
        {"c1": [Deed()]}, [], "SUCCEEDED", "", ["2 a"],
    ),
    "retry: what a fail step says is a code, too": (
        [{"fallback": [{"fail": "x", "code": "soon", "retry": {"attempts": 3, "delay": "2 s", "unless": ["soon"]}}, say("b")]}],
        {}, [], "SUCCEEDED", "", ["1 b"],
    ),
    "race: the first that ends decides, well": (
        [{"race": [after(3, say("a")), after(1, say("b")), {"wait": "5 s"}]}, say("end")],
        {}, [], "SUCCEEDED", "", ["2 b", "2 end"],
    ),
    "race: the first that ends decides, badly": (
        [{"race": [after(3, say("a")), after(1, {"fail": "x", "code": "soon"}), {"wait": "5 s"}]}, say("end")],
        {}, [], "FAILED", "failed:soon", [],
    ),
    "race: of those that end in one visit the one that is written first": (
        [{"parallel": [after(1, COUNT), {"race": [
            {"sequence": [{"wait_until": "n > 0"}, {"fail": "x", "code": "soon"}]},
            {"sequence": [{"wait_until": "n > 0"}, say("b")]},
        ], "timeout": "9 s"}]}],
        {}, [], "FAILED", "failed:soon", ["2 b"],
    ),
    "race: a branch that ends at once keeps later ones from being started": (
        [{"race": [{"wait": "1 s"}, {"check": "n < 1"}, say("never")]}, say("end")],
        {}, [], "SUCCEEDED", "", ["1 end"],
    ),
    "race: a skipped branch decides nothing": (
        [{"race": [{**say("a"), "when": "n > 99"}, after(2, say("b"))]}, say("end")],
        {}, [], "SUCCEEDED", "", ["3 b", "3 end"],
    ),
    "race: skipped when all branches are": (
        [{"fallback": [{"race": [{**say("a"), "when": "n > 99"}, {**say("b"), "when": "n > 99"}]}, say("c")]}],
        {}, [], "SUCCEEDED", "", ["1 c"],
    ),
    "race: it ends when the goals of those that were stopped have ended": (
        [{"race": [{"wait": "1 s"}, ONE]}, say("end")],
        {"c1": [SLOW]}, [], "SUCCEEDED", "", ["4 end"],
    ),
    "race: what succeeds while it is stopped changes nothing": (
        [{"race": [after(1, {"fail": "x", "code": "soon"}), ONE]}, say("end")],
        {"c1": [Deed(end="succeeded", after=3.0, cancel="refuse")]}, [], "FAILED", "failed:soon", [],
    ),
    "parallel: finish waits for the others, then fails with the first failure": (
        [{"parallel": [after(1, {"fail": "x", "code": "late"}), {"fail": "y", "code": "soon"}, after(3, say("b"))]}],
        {}, [], "FAILED", "failed:soon", ["4 b"],
    ),
    "parallel: cancel stops the others as soon as need cannot be reached": (
        [{"parallel": [after(1, {"fail": "x"}), after(3, say("b"))], "on_child_failure": "cancel"}],
        {}, [], "FAILED", "failed", [],
    ),
    "parallel: cancel goes on while need can still be reached": (
        [{"parallel": [{"fail": "x"}, after(2, say("b")), after(3, say("c"))], "need": 2, "on_child_failure": "cancel"}],
        {}, [], "SUCCEEDED", "", ["3 b", "4 c"],
    ),
    "parallel: any ends with the first success and stops the rest": (
        [{"parallel": [after(1, say("a")), after(3, say("b"))], "need": "any"}, say("end")],
        {}, [], "SUCCEEDED", "", ["2 a", "2 end"],
    ),
    "parallel: it ends when the stopped goals have drained": (
        [{"parallel": [{"wait": "1 s"}, ONE], "need": "any"}, say("end")],
        {"c1": [SLOW]}, [], "SUCCEEDED", "", ["4 end"],
    ),
    "parallel: a count that is reached stays reached while a sibling drains and fails": (
        [{"parallel": [{"wait": "1 s"}, ONE], "need": "any"}, say("end")],
        {"c1": [Deed(end="failed", after=3.0, cancel="refuse")]}, [], "SUCCEEDED", "", ["4 end"],
    ),
    "parallel: success stays when a stopped goal ends in doubt": (
        [{"parallel": [{"wait": "1 s"}, ONE], "need": "any"}, say("end")],
        {"c1": [SILENT]}, [], "SUCCEEDED", "", ["8 end"],
    ),
    "parallel: failure becomes cancel_unconfirmed when a stopped goal ends in doubt": (
        [{"parallel": [after(1, {"fail": "x"}), ONE], "on_child_failure": "cancel"}],
        {"c1": [SILENT]}, [], "FAILED", "cancel_unconfirmed", [],
    ),
    "parallel: success is looked at before failure, at the end of the visit": (
        [{"parallel": [{"fail": "x"}, say("a"), say("b")], "need": 2, "on_child_failure": "cancel"}],
        {}, [], "SUCCEEDED", "", ["1 a", "1 b"],
    ),
    "parallel: a goal of a child that is stopped in the same step never leaves": (
        [{"parallel": [ONE, say("a")], "need": "any"}],
        {"c1": [SLOW]}, [], "SUCCEEDED", "", ["1 a"],
    ),
    "parallel: skipped children do not count": (
        [{"parallel": [NEVER, after(1, say("a"))], "need": "any"}, say("end")],
        {}, [], "SUCCEEDED", "", ["2 a", "2 end"],
    ),
    "parallel: a number that skipped children keep out of reach fails": (
        [{"parallel": [NEVER, say("a"), say("b")], "need": 3}],
        {}, [], "FAILED", "nothing_applied", ["1 a", "1 b"],
    ),
    "parallel: all skipped is skipped": (
        [{"fallback": [{"parallel": [NEVER, NEVER], "need": "any"}, say("second")]}],
        {}, [], "SUCCEEDED", "", ["1 second"],
    ),
    "parallel: a write wakes readers ahead in the same pass and those behind in the next": (
        [{"parallel": [
            {"sequence": [{"wait_until": "n == 1", "timeout": "5 s"}, say("behind")]},
            {"sequence": [{"wait": "1 s"}, COUNT]},
            {"sequence": [{"wait_until": "n == 1", "timeout": "5 s"}, say("ahead")]},
        ]}],
        {}, [], "SUCCEEDED", "", ["2 ahead", "2 behind"],
    ),
    "stops: what drains under a parallel moves to the outer timeout": (
        [{"sequence": [{"parallel": [{"wait": "1 s"}, ONE], "need": "any"}], "timeout": "2 s", "ignore_failure": True},
         say("end")],
        {"c1": [Deed(after=30.0, cancel_after=4.0)]}, [], "SUCCEEDED", "", ["6 end"],
    ),
    "stops: a guard that is stopped while it halts hands its goals on": (
        [{"sequence": [{"guard": "one.battery > 50 %", "steps": [ONE]}], "timeout": "3 s", "ignore_failure": True},
         say("end")],
        {"c1": [Deed(after=30.0, cancel_after=5.0)]}, [Event(2.0, "low", "c1")], "SUCCEEDED", "", ["7 end"],
    ),
    "stops: nested guards, the outer one decides": (
        [{"fallback": [
            {"guard": "not two.airborne", "steps": [{"guard": "one.battery > 50 %", "steps": [ONE]}]},
            say("${error.code} ${error.step}"),
        ]}],
        {"c1": [Deed(after=30.0, cancel_after=4.0)]}, [Event(2.0, "low", "c1"), Event(3.0, "rise", "c2")],
        "SUCCEEDED", "", ["6 =guard steps/steps[0].fallback[0]"],
    ),
    "wait_for: the next event after the step's start, not an earlier one": (
        [{"wait": "2 s"}, {"wait_for": "one.ping", "timeout": "20 s", "save_as": "told"}, say("${told.n}")],
        {}, [Event(2.0, "ping", "c1"), Event(5.0, "pong", "c1"), Event(6.0, "ping", "c2"), Event(7.0, "ping", "c1")],
        "SUCCEEDED", "", ["7 =3"],
    ),
    "wait_for: since task it takes each event once, in their order": (
        [{"wait": "5 s"}, {"repeat": 3, "steps": [
            {"wait_for": "one.ping", "since": "task", "timeout": "20 s", "save_as": "told"}, say("${told.n}")]}],
        {}, [Event(0.5, "ping", "c1"), Event(2.0, "ping", "c1"), Event(3.0, "ping", "c1"), Event(9.0, "ping", "c1")],
        "SUCCEEDED", "", ["6 =2", "6 =3", "9 =4"],
    ),
    "wait_for: two that come at one instant are two": (
        [{"repeat": 2, "steps": [{"wait_for": "one.ping", "since": "task", "timeout": "20 s"}, say("ping")]}],
        {}, [Event(3.0, "ping", "c1"), Event(3.0, "ping", "c1")], "SUCCEEDED", "", ["3 ping", "3 ping"],
    ),
    "wait_for: branches that wait for the next one all see it": (
        [{"parallel": [{"wait_for": "one.ping", "timeout": "20 s"}, {"wait_for": "one.ping", "timeout": "20 s"}]},
         say("end")],
        {}, [Event(3.0, "ping", "c1")], "SUCCEEDED", "", ["3 end"],
    ),
    "wait_for: without an event its timeout fails": (
        [{"fallback": [{"wait_for": "one.ping", "timeout": "3 s"}, say("${error.code}")]}],
        {}, [Event(2.0, "pong", "c1")], "SUCCEEDED", "", ["4 =timeout"],
    ),
    "guard: false at entry fails before anything starts": (
        [{"guard": "flag", "steps": [say("never")]}], {}, [], "FAILED", "guard", [],
    ),
    "guard: what its own steps write at once counts": (
        [{"guard": "n == 0", "steps": [COUNT, {"wait": "3 s"}]}], {}, [], "FAILED", "guard", [],
    ),
    "guard: a pulse too short for polling is seen": (
        [{"guard": "one.battery > 50 %", "steps": [{"wait": "5 s"}]}],
        {}, [Event(3.0, "pulse", "c1")], "FAILED", "guard", [],
    ),
    "guard: it comes before its child at one instant": (
        [{"guard": "n == 0", "steps": [{"wait_until": "n == 1", "timeout": "9 s"}]}, say("never")],
        {}, [], "FAILED", "timeout", [],
    ),
    "guard: with a sibling's write, guard before child": (
        [{"parallel": [
            after(1, COUNT),
            {"guard": "n == 0", "steps": [{"wait_until": "n == 1", "timeout": "9 s"}, say("never")]},
        ]}],
        {}, [], "FAILED", "guard", [],
    ),
    "guard: with `now` it ends to the microsecond": (
        [{"guard": "now < t5", "steps": [{"wait": "30 s"}], "ignore_failure": True}, say("end")],
        {}, [], "SUCCEEDED", "", ["5 end"],
    ),
    "wait_until: a pulse is enough": (
        [{"wait_until": "one.battery < 50 %", "timeout": "9 s"}, say("low")],
        {}, [Event(3.0, "pulse", "c1")], "SUCCEEDED", "", ["3 low"],
    ),
    "wait_until: who is lost leaves the fleet, and nothing polls": (
        [{"wait_until": "len(fleet('cart')) < 3", "timeout": "50 s"}, say("${len(fleet('cart'))} left")],
        {}, [Event(2.0, "kill", "c3")], "SUCCEEDED", "", ["25 =2 left"],
    ),
    "wait_until: who comes back is there again, in the order of admission": (
        [
            {"wait_until": "len(fleet('cart')) < 3", "timeout": "50 s"},
            {"wait_until": "len(fleet('cart')) > 2", "timeout": "50 s"},
            {"for": {"cart": "${fleet('cart')}"}, "steps": [say("${cart.id}")]},
        ],
        {}, [Event(2.0, "kill", "c3"), Event(40.0, "restart", "c3")],
        "SUCCEEDED", "", ["40 =c1", "40 =c2", "40 =c3"],
    ),
    "guard: a loss in the fleet stops it": (
        [{"guard": "len(fleet('cart')) > 2", "steps": [{"wait": "50 s"}], "ignore_failure": True}, say("end")],
        {}, [Event(2.0, "kill", "c3")], "SUCCEEDED", "", ["25 end"],
    ),
    "guard: the nearest of the fleet is looked at, also when it is no agent of the task": (
        [{"guard": "nearest(offset(base, east=90 m), fleet('cart')).battery > 50 %", "steps": [{"wait": "9 s"}]}],
        {}, [Event(3.0, "pulse", "c3")], "FAILED", "guard", [],
    ),
    "wait_until: `now` in two places is seen by both in one step": (
        [{"parallel": [{"wait_until": FIVE, "timeout": "9 s"}, {"wait_until": FIVE, "timeout": "9 s"}]}, say("end")],
        {}, [], "SUCCEEDED", "", ["5 end"],
    ),
    "reactive sequence: a check that turns false stops what runs, with its own words": (
        [{"fallback": [
            {"sequence": [{"check": "one.battery > 50 %", "message": "low"}, ONE], "reactive": True},
            say("${error.code} ${error.reason} ${error.step}"),
        ]}],
        {"c1": [SLOW]}, [Event(2.0, "low", "c1")],
        "SUCCEEDED", "", ["4 =check low steps/steps[0].fallback[0].sequence[0]"],
    ),
    "reactive fallback: a check that turns true stops what runs and succeeds": (
        [{"fallback": [{"check": "one.battery < 50 %"}, ONE], "reactive": True}, say("end")],
        {"c1": [SLOW]}, [Event(2.0, "low", "c1")], "SUCCEEDED", "", ["4 end"],
    ),
    "reactive fallback: its success stays when a stopped goal ends in doubt": (
        [{"fallback": [{"check": "one.battery < 50 %"}, ONE], "reactive": True}, say("end")],
        {"c1": [SILENT]}, [Event(2.0, "low", "c1")], "SUCCEEDED", "", ["8 end"],
    ),
    "finally: it runs after success and after failure, and changes neither": (
        [{"fallback": [
            {"sequence": [{"fail": "x", "code": "first"}], "finally": [say("tidy"), {"fail": "y", "when": "n == 0"}]},
            {"sequence": [say("${error.code}")], "finally": [{"wait": "1 s"}, say("again")]},
        ]}],
        {}, [], "SUCCEEDED", "", ["1 tidy", "1 =failed:first", "2 again"],
    ),
    "finally: it runs after a sequence that was skipped, which stays so": (
        [{"fallback": [{"sequence": [NEVER], "finally": [say("tidy"), {"wait": "1 s"}, say("tidied")]}, say("b")]},
         {"fallback": [{"sequence": [NEVER], "finally": [say("at once")]}, say("c")]}],
        {}, [], "SUCCEEDED", "", ["1 tidy", "2 tidied", "2 b", "2 at once", "2 c"],
    ),
    "finally: it runs where break_if leaves the loop": (
        [{"repeat": "forever", "timeout": "60 s", "steps": [
            {"sequence": [{"break_if": "n == 0"}, say("never")], "finally": [say("tidy"), {"wait": "1 s"}, say("tidied")]},
            say("nor this")]}, say("end")],
        {}, [], "SUCCEEDED", "", ["1 tidy", "2 tidied", "2 end"],
    ),
    "finally: not of a sequence whose when is false": (
        [{"fallback": [{"sequence": [say("a")], "finally": [say("tidy")], "when": "n == 7"}, say("b")]}],
        {}, [], "SUCCEEDED", "", ["1 b"],
    ),
    "finally: not of a sequence that had not begun": (
        [{"race": [{"check": "n < 1"}, {"sequence": [say("a")], "finally": [say("tidy")]}]}, say("end")],
        {}, [], "SUCCEEDED", "", ["1 end"],
    ),
    "finally: of a stopped sequence it begins when the sequence has drained, and the stopper waits for it": (
        [{"sequence": [ONE], "finally": [say("tidy"), {"wait": "3 s"}, say("tidied")], "timeout": "2 s",
          "ignore_failure": True}, say("end")],
        {"c1": [SLOW]}, [], "SUCCEEDED", "", ["5 tidy", "8 tidied", "8 end"],
    ),
    "finally: inner before outer, each after its own goals": (
        [{"sequence": [
            {"sequence": [{"sequence": [ONE], "finally": [{"do": "one.Home"}, say("inner")]}],
             "finally": [say("outer"), {"wait": "1 s"}]}], "timeout": "2 s", "ignore_failure": True}, say("end")],
        {"c1": [SLOW, Deed(after=2.0)]}, [], "SUCCEEDED", "", ["7 inner", "7 outer", "8 end"],
    ),
    "finally: one that runs in place already goes on as it is": (
        [{"sequence": [{"sequence": [say("work")], "finally": [{"do": "one.Move"}, say("tidied")]}],
          "timeout": "2 s", "ignore_failure": True}, say("end")],
        {"c1": [Deed(after=4.0)]}, [], "SUCCEEDED", "", ["1 work", "5 tidied", "5 end"],
    ),
    "finally: its failure after a stop changes nothing": (
        [{"fallback": [
            {"sequence": [{"wait": "9 s"}], "finally": [say("tidy"), {"fail": "oh no", "when": "n == 0"}, say("never")],
             "timeout": "2 s"},
            say("${error.code}")]}],
        {}, [], "SUCCEEDED", "", ["3 tidy", "3 =timeout"],
    ),
    "finally: with a stopper that is stopped it moves to who stops that": (
        [{"sequence": [{"guard": "one.battery > 50 %", "steps": [
            {"sequence": [{"wait": "30 s"}], "finally": [{"wait": "4 s"}, say("tidied")]}]}],
          "timeout": "3 s", "ignore_failure": True}, say("end")],
        {}, [Event(2.0, "low", "c1")], "SUCCEEDED", "", ["6 tidied", "6 end"],
    ),
    "finally: before on_abort, and the task waits for it": (
        [{"sequence": [ONE], "finally": [{"wait": "2 s"}, say("tidied")]}],
        {"c1": [SLOW]}, [Event(3.0, "abort")], "CANCELED", "aborted", ["7 tidied"],
    ),
    "finally: abort now skips it": (
        [{"sequence": [ONE], "finally": [say("tidied")]}],
        {"c1": [SLOW]}, [Event(3.0, "now")], "CANCELED", "aborted", [],
    ),
    "finally: abort now stops one that runs": (
        [{"sequence": [ONE], "finally": [say("tidy"), {"wait": "20 s"}, say("tidied")]}],
        {"c1": [SLOW]}, [Event(3.0, "abort"), Event(8.0, "now")], "CANCELED", "aborted", ["5 tidy"],
    ),
    "finally: at most two minutes after a stop": (
        [{"sequence": [{"wait": "9 s"}], "finally": [say("tidy"), {"do": "one.Move"}, say("never")],
          "timeout": "1 s", "ignore_failure": True}, say("end")],
        {"c1": [Deed(end="never", cancel_after=3.0)]}, [], "SUCCEEDED", "", ["2 tidy", "125 end"],
    ),
    "finally: it sees the names of the loop and of the call that were stopped": (
        [{"for": {"i": "${[7, 8]}"}, "need": 1, "timeout": "3 s", "ignore_failure": True, "steps": [
            {"sequence": [{"do": "one.Move", "save_as": "got"}, {"wait": "9 s"}],
             "finally": [say("${i}"), COUNT, {"if": "is_set(got)", "then": [say("${got.n}")]}]}]},
         {"for": {"k": "${[5]}", "cart": "${[two]}"}, "mode": "parallel", "timeout": "2 s", "ignore_failure": True,
          "steps": [{"sequence": [{"do": "cart.Move"}],
                     "finally": [{"do": "cart.Home"}, say("${k} ${cart.id}")]}]},
         say("${n}")],
        {"c1": [Deed(n=3)], "c2": [SLOW]}, [], "SUCCEEDED", "", ["4 =7", "4 =3", "9 =5 c2", "9 =1"],
    ),
    "finally: of the branches that a parallel stops, each by itself": (
        [{"parallel": [{"wait": "1 s"},
                       {"sequence": [{"wait": "9 s"}], "finally": [{"wait": "2 s"}, say("b")]},
                       {"sequence": [ONE], "finally": [say("c")]}], "need": "any"}, say("end")],
        {"c1": [SLOW]}, [], "SUCCEEDED", "", ["4 c", "4 b", "4 end"],
    ),
    "finally: an exception in the sequence lets it run, one in it does not": (
        [{"sequence": [{"sequence": [{"check": "10 // n > 2"}], "finally": [say("tidy"), {"check": "10 // n > 2"}]}],
          "finally": [say("outer")]}],
        {}, [], "FAILED", "cannot_compute", ["1 tidy", "1 outer"],
    ),
    "switch: the case of the value, chosen once at entry; no later case, no default": (
        [COUNT, {"switch": "n", "cases": {"0": [say("none")], "1": [say("one"), COUNT, say("still"), {"wait": "1 s"}],
                                         "2": [say("two")]}, "default": [say("many")]},
         {"switch": "n", "cases": {"0": [say("none")]}, "default": [say("many")]}],
        {}, [], "SUCCEEDED", "", ["1 one", "1 still", "2 many"],
    ),
    "switch: its branches save one name, its failure is the branch's": (
        [{"switch": "one.control", "cases": {
            "engine": [{"do": "one.Move", "save_as": "got"}],
            "pilot": [{"do": "two.Move", "save_as": "got"}],
            "failsafe": [{"fail": "x"}], "unknown": [{"fail": "y"}]}},
         {"fallback": [{"switch": "got.n", "cases": {"3": [{"fail": "z", "code": "three"}]}, "default": [say("other")]},
                       say("${error.code}")]}],
        {"c1": [Deed(n=3)]}, [], "SUCCEEDED", "", ["2 =failed:three"],
    ),
    "switch: a branch whose steps were all skipped is skipped": (
        [{"fallback": [{"switch": "n", "cases": {"0": [NEVER]}, "default": [say("default")]}, say("second")]}],
        {}, [], "SUCCEEDED", "", ["1 second"],
    ),
    "switch: stopped with its branch": (
        [{"switch": "n", "cases": {"0": [ONE, say("never")]}, "default": [NEVER], "timeout": "2 s",
          "ignore_failure": True}, say("end")],
        {"c1": [SLOW]}, [], "SUCCEEDED", "", ["5 end"],
    ),
    "while: the condition is read before each round": (
        [{"while": "n < 2", "steps": [{"wait": "1 s"}, COUNT]}, say("${n}")],
        {}, [], "SUCCEEDED", "", ["3 =2"],
    ),
    "while: no round at all is success, not skipped": (
        [{"fallback": [{"while": "flag", "steps": [{"wait": "1 s"}]}, say("never")]}],
        {}, [], "SUCCEEDED", "", [],
    ),
    "loops: when all steps of all rounds were skipped the loop is": (
        [{"fallback": [{"repeat": 2, "every": "1 s", "steps": [NEVER]}, say("second")]}],
        {}, [], "SUCCEEDED", "", ["2 second"],
    ),
    "repeat: until is read after each round": (
        [{"repeat": 9, "steps": [COUNT, {"wait": "1 s"}], "until": "n == 3"}, say("${n}")],
        {}, [], "SUCCEEDED", "", ["4 =3"],
    ),
    "repeat: every counts from start to start, and not after the last round": (
        [{"repeat": 3, "every": "2 s", "steps": [say("round")]}, say("end")],
        {}, [], "SUCCEEDED", "", ["1 round", "3 round", "5 round", "5 end"],
    ),
    "repeat: a round longer than every starts the next at once": (
        [{"repeat": 2, "every": "1 s", "steps": [say("round"), {"wait": "3 s"}]}, say("end")],
        {}, [], "SUCCEEDED", "", ["1 round", "4 round", "7 end"],
    ),
    "repeat: with a duration no round starts after it is over": (
        [{"repeat": "4 s", "steps": [say("round"), {"wait": "3 s"}]}, say("end")],
        {}, [], "SUCCEEDED", "", ["1 round", "4 round", "7 end"],
    ),
    "repeat: with a duration and every it ends with the duration": (
        [{"repeat": "5 s", "every": "3 s", "steps": [say("round")]}, say("end")],
        {}, [], "SUCCEEDED", "", ["1 round", "4 round", "6 end"],
    ),
    "repeat: forever with max ends well after so many rounds": (
        [{"repeat": "forever", "every": "1 s", "max": 2, "steps": [say("round")], "timeout": "9 s"}, say("end")],
        {}, [], "SUCCEEDED", "", ["1 round", "2 round", "2 end"],
    ),
    "repeat: its duration stands still while the task is held, within a round too": (
        [{"repeat": "6 s", "steps": [say("round"), ONE]}, say("end")],
        {"c1": [Deed(after=4.0)] * 3},
        [Event(2.0, "hold", "Edge-1"), Event(22.0, "continue", "Edge-1")],
        "SUCCEEDED", "", ["1 round", "26 round", "30 end"],
    ),
    "repeat: every stands still while the task is held, within a round too": (
        [{"repeat": 2, "every": "8 s", "steps": [say("round"), ONE]}, say("end")],
        {"c1": [Deed(after=4.0)] * 3},
        [Event(2.0, "hold", "Edge-1"), Event(22.0, "continue", "Edge-1")],
        "SUCCEEDED", "", ["1 round", "29 round", "33 end"],
    ),
    "repeat: max is a bound, not a check": (
        [{"repeat": 9, "every": "1 s", "max": 2, "steps": [say("round")]}, say("end")],
        {}, [], "SUCCEEDED", "", ["1 round", "2 round", "2 end"],
    ),
    "repeat: a failed round fails the loop": (
        [{"repeat": 3, "steps": [{"wait": "1 s"}, COUNT, {"check": "n < 2"}]}], {}, [], "FAILED", "check", [],
    ),
    "break_if: it leaves the nearest loop only, through sequences, ifs and modifiers": (
        [{"repeat": 2, "steps": [
            {"repeat": 9, "steps": [
                COUNT, {"wait": "1 s"},
                {"if": "n > 1", "then": [{"sequence": [{"break_if": "n > 1"}, say("never")], "timeout": "5 s"}]},
            ]},
            say("out"),
        ]}],
        {}, [], "SUCCEEDED", "", ["3 out", "4 out"],
    ),
    "for: rounds in the order of the list, the name is gone after it": (
        [{"for": {"i": "${[3, 1]}"}, "steps": [say("${i}"), {"wait": "1 s"}]}],
        {}, [], "SUCCEEDED", "", ["1 =3", "2 =1"],
    ),
    "for: the first failure ends it": (
        [{"for": {"i": "${[1, 2, 3]}"}, "steps": [{"wait": "1 s"}, {"check": "i != 2"}, say("${i}")]}],
        {}, [], "FAILED", "check", ["2 =1"],
    ),
    "for: with need N all run, enough is success": (
        [{"for": {"i": "${[1, 2, 3]}"}, "need": 1, "steps": [{"wait": "1 s"}, {"check": "i != 2"}, say("${i}")]}],
        {}, [], "SUCCEEDED", "", ["2 =1", "4 =3"],
    ),
    "for: with need N too few is the first failure": (
        [{"for": {"i": "${[1, 2]}"}, "need": 2, "steps": [{"wait": "1 s"}, {"check": "i != 2"}, say("${i}")]}],
        {}, [], "FAILED", "check", ["2 =1"],
    ),
    "for in parallel: with need N all run, reaching it stops nobody": (
        [{"for": {"i": "${[1, 2, 3]}"}, "mode": "parallel", "need": 1, "steps": [
            {"repeat": "${i}", "steps": [{"wait": "1 s"}]}, say("${i}"),
        ]}, say("end")],
        {}, [], "SUCCEEDED", "", ["2 =1", "3 =2", "4 =3", "4 end"],
    ),
    "for in parallel: max_parallel starts the next when one ends": (
        [{"for": {"i": "${[1, 2, 3]}"}, "mode": "parallel", "max_parallel": 2, "steps": [say("${i}"), {"wait": "2 s"}]}],
        {}, [], "SUCCEEDED", "", ["1 =1", "1 =2", "3 =3"],
    ),
    "for in parallel: cancel starts no further item": (
        [{"for": {"i": "${[1, 2]}"}, "mode": "parallel", "max_parallel": 1, "on_child_failure": "cancel", "steps": [
            say("${i}"), {"check": "i == 2"}]}],
        {}, [], "FAILED", "check", ["1 =1"],
    ),
    "for in parallel: collect is in the order of the loop, whoever is first": (
        [{"for": {"cart": "${[one, two]}"}, "mode": "parallel", "collect": "got", "steps": [
            {"do": "cart.Move", "save_as": "got"}]}, say("${got[0].n} ${got[1].n}")],
        {"c1": [Deed(after=3.0, n=1)], "c2": [Deed(n=2)]}, [], "SUCCEEDED", "", ["4 =1 2"],
    ),
    "for in parallel: first ends with the item that saves the name first, and waits for the others to stop": (
        [{"for": {"cart": "${[one, two]}"}, "mode": "parallel", "first": "got", "steps": [
            {"do": "cart.Move", "save_as": "got"}, say("done")]}, say("${got.n}")],
        {"c1": [SLOW], "c2": [Deed(n=2)]}, [], "SUCCEEDED", "", ["2 done", "4 =2"],
    ),
    "for in parallel: of two that save it at one moment, first takes the one that stands before": (
        [{"for": {"cart": "${[one, two]}"}, "mode": "parallel", "first": "got", "steps": [
            {"do": "cart.Move", "save_as": "got"}]}, say("${got.n}")],
        {"c1": [Deed(n=1)], "c2": [Deed(n=2)]}, [], "SUCCEEDED", "", ["2 =1"],
    ),
    "for in parallel: an item that ends well without the name goes on to nothing, one that fails after saving does not win": (
        [{"for": {"cart": "${[one, two]}", "i": "${[1, 2]}"}, "mode": "parallel", "first": "got", "steps": [
            {"do": "cart.Move", "save_as": "got", "expect": "result.n == 2"}]}, say("${got.n}")],
        {"c1": [Deed(n=1)], "c2": [Deed(after=3.0, n=2)]}, [], "SUCCEEDED", "", ["4 =2"],
    ),
    "for in parallel: first starts no further item once it has the name": (
        [{"for": {"i": "${[1, 2, 3]}"}, "mode": "parallel", "max_parallel": 1, "first": "got", "steps": [
            say("${i}"), {"do": "one.Move", "save_as": "got", "when": "i == 2"}, {"wait": "1 s"}]}, say("${got.n}")],
        {"c1": [Deed(n=7)]}, [], "SUCCEEDED", "", ["1 =1", "2 =2", "4 =7"],
    ),
    "for in parallel: first fails when every item ended without the name": (
        [{"for": {"i": "${[1, 2]}", "cart": "${[one, two]}"}, "mode": "parallel", "first": "got", "steps": [
            {"do": "cart.Move", "save_as": "got", "when": "n == 7"}, say("${i}"), {"wait": "1 s"}]}, say("${got.n}")],
        {}, [], "FAILED", "nothing_applied", ["1 =1", "1 =2"],
    ),
    "for in parallel: first fails with the first failure, and when all were skipped": (
        [{"fallback": [
            {"for": {"cart": "${[one, two]}"}, "mode": "parallel", "first": "got", "steps": [
                {"do": "cart.Move", "save_as": "got", "when": "n == 7"}]},
            say("${error.code}")]},
         {"for": {"i": "${[1, 2]}", "cart": "${[one, two]}"}, "mode": "parallel", "first": "had", "steps": [
            {"check": "i == 2"}, {"do": "cart.Move", "save_as": "had", "when": "n == 7"}]}],
        {}, [], "FAILED", "check", ["1 =nothing_applied"],
    ),
    "for in parallel: first of no items is a success without the name, also where an earlier run had it": (
        [{"for": {"k": "${[1, 0]}"}, "steps": [
            {"for": {"i": "${range(k)}"}, "mode": "parallel", "max_parallel": 1, "first": "got", "steps": [
                {"do": "one.Move", "save_as": "got"}]},
            {"if": "is_set(got)", "then": [say("${got.n}")], "else": [say("none")]}]}],
        {"c1": [Deed(n=1)]}, [], "SUCCEEDED", "", ["2 =1", "2 none"],
    ),
    "for: collect starts afresh when the loop runs again": (
        [{"repeat": 2, "steps": [
            {"for": {"i": "${[1, 2]}"}, "collect": "got", "steps": [
                {"do": "one.Move", "save_as": "got", "when": "n == 0"}, {"wait": "1 s"}]},
            {"if": "len(got) == 0", "then": [say("none")], "else": [say("${got[0].n}")]},
            COUNT,
        ]}],
        {"c1": [Deed(n=1), Deed(n=2)]}, [], "SUCCEEDED", "", ["5 =1", "7 none"],
    ),
    "release: it waits until the machine is home, the rest goes on": (
        [{"do": "two.Haul"}, {"parallel": [{"sequence": [{"release": "two"}, say("home")]}, after(3, say("b"))]}],
        {"c2": [Deed(), Deed(after=2.0)]}, [], "SUCCEEDED", "", ["4 home", "5 b"],
    ),
    "release: the end of the task waits for a release under way": (
        [{"do": "two.Haul"}, {"sequence": [{"release": "two"}], "timeout": "1 s", "ignore_failure": True}, say("end")],
        {"c2": [Deed(), Deed(after=4.0)]}, [], "SUCCEEDED", "", ["3 end"],
    ),
    "abort: a parallel, a guard and a loop are stopped at once": (
        [{"parallel": [
            {"guard": "not flag", "steps": [ONE]},
            {"repeat": "forever", "timeout": "1 min", "steps": [{"wait": "1 s"}]},
            {"sequence": [TWO]},
        ]}],
        {"c1": [SLOW], "c2": [SLOW]}, [Event(3.5, "abort")], "CANCELED", "aborted", [],
    ),
}  # fmt: skip


def told(world: World) -> list[str]:
    found = []
    for step in world.steps:
        for effect in step.effects:
            if isinstance(effect, inp.NotifyPeople) and effect.task == "Edge-1":
                found.append(f"{(step.at - START) / 1e6:.0f} {effect.text}")
            if isinstance(effect, inp.UpdateGoalFields):
                found.append(f"{(step.at - START) / 1e6:.0f} {effect.agent} {effect.fields}")
    return found


@pytest.mark.parametrize("rule", CASES)
def test_it_goes_as_the_rule_says(rule: str) -> None:
    steps, deeds, events, status, code, texts = CASES[rule]
    text = text_of({"steps": steps})
    model = load(text)
    if model is None:
        from tests.property.strategies import why_refused

        pytest.fail(why_refused(text))
    mission = Mission((text,), {a: tuple(d) for a, d in deeds.items()}, (Event(1.0, "submit", "Edge"), *events))
    ours, theirs, ticked = (
        World([model], mission.deeds, mission.events, trees=trees)
        for trees in (CompiledTrees, NaiveTrees, lambda host: CompiledTrees(host, tick=True))
    )
    for world in (ours, theirs, ticked):
        world.run(200.0)
    record = ours.engine.state.tasks["Edge-1"]
    assert (record.status, record.outcome.code, told(ours)) == (status, code, texts), record
    assert_equal(ours, theirs, mission)
    assert ours.steps == ticked.steps


def test_a_task_in_haste_is_slowed_alike() -> None:
    """Beyond its budget of wakes deadlines are rounded up: by nodes and by the oracle at the same instants."""
    loops = [{"repeat": "4 s", "steps": [{"wait": f"{1 + n % 3} ms"}]} for n in range(12)]
    every = {"repeat": "10 s", "every": "2 ms", "steps": [COUNT]}
    timed = {"sequence": [every], "timeout": "3 s", "ignore_failure": True}
    model = load(text_of({"steps": [{"parallel": [*loops, timed]}, say("end")]}))
    assert model is not None
    events = (Event(1.0, "submit", "Edge"),)
    ours, theirs = (World([model], {}, events, trees=trees) for trees in (CompiledTrees, NaiveTrees))
    for world in (ours, theirs):
        world.run(60.0)
    assert ours.engine.state.tasks["Edge-1"].status == "SUCCEEDED"
    assert [c for step in ours.steps for c in step.changes if isinstance(c, ch.WakesPut) and c.wakes.rounded]
    assert_equal(ours, theirs, Mission((), {}, events))


def test_who_is_released_and_never_comes_down_is_helped_after_three_ways_home(monkeypatch: pytest.MonkeyPatch) -> None:
    def rise_for_good(body: Scripted, landed: str) -> None:
        before = body.__dict__.get("height", "grounded")
        body.__dict__["height"] = "airborne" if "airborne" in (before, landed) else landed

    monkeypatch.setattr(
        Scripted, "landed", property(lambda body: body.__dict__["height"], rise_for_good), raising=False
    )
    model = load(text_of({"steps": [{"do": "two.Haul"}, {"release": "two"}, ONE]}))
    assert model is not None
    world = World([model], {}, [Event(1.0, "submit", "Edge")])
    catalogue = world.engine.core.catalogue
    home = replace(catalogue.actions["Home"], effect="")
    world.engine.core.catalogue = replace(catalogue, actions={**catalogue.actions, "Home": home})
    world.run(60.0)
    sent = [e.goal_id for s in world.steps for e in s.effects if isinstance(e, inp.SendGoal) and e.action == "Home"]
    ways = [f"Edge-1/1/recover:c2#{attempt}/steps[0]@1" for attempt in (1, 2, 3)]
    assert sent[:3] == ways
    assert len(set(sent)) == len(sent)
    alarms = [e.code for s in world.steps for e in s.effects if isinstance(e, inp.Alarm)]
    assert "agent_needs_help" in alarms
    assert world.engine.state.tasks["Edge-1"].status == "SUCCEEDED"
