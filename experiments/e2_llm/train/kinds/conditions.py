"""Missions that depend on people, charge and time."""

from typing import Any, Final

from experiments.e2_llm.train.kinds.clauses import Clause, Draw, Steps
from experiments.e2_llm.train.kinds.missions import Mission, chain, machine, names_of, person, third, told, tree
from experiments.e2_llm.train.phrases.cases import CASES
from experiments.e2_llm.train.phrases.second import BOTH_AGREE
from experiments.e2_llm.train.phrases.wide.cases import MORE_CASES, MORE_SENDING, SENDING
from experiments.e2_llm.train.speaker import Speaker, Time, Times, widened

_CASES: Final = widened(CASES, MORE_CASES)
_SENDING: Final = (*SENDING, *MORE_SENDING)


def _branch(draw: Draw) -> tuple[Clause, Clause]:
    return draw.clause(draw.rng.choice(("over", "watch", "ring", "over_plain"))), draw.clause("home")


def yes_no(draw: Draw) -> Mission:
    """Return a mission that depends on an answer: two ways, or nothing on a no."""
    who, asked = machine(draw, "drone", draw.rng.choice(("lwd", "hwd"))), person(draw)
    question, en, es = draw.fact()
    yes, no = list(_branch(draw)), draw.clause("tell") if draw.rng.random() < 0.5 else None
    other = [no] if no is not None else list(_branch(draw))
    step: dict[str, Any] = {"if": "reply.answer == 'yes'", "then": chain(yes, "drone")}
    two = draw.rng.random() < 0.7
    if two:
        step["else"] = chain(other, "drone")
    steps: Steps = [{"ask": question, "of": [asked.role], "save_as": "reply"}, step]

    def say(speaker: Speaker) -> str:
        if no is not None:
            b = speaker.filled(speaker.pick(_SENDING), no.values)
        else:
            b = third(speaker, who, other)
        values = {"u": asked.said, "x": (en, es), "a": third(speaker, who, yes), "b": b, "question": question}
        return speaker.filled(speaker.pick(_CASES["yes_no" if two else "if_yes"]), values)

    plan = f"{asked.said[0]} is asked first; on yes the drone {', '.join(c.plan for c in yes)}" + (
        f"; on no: {', '.join(c.plan for c in other)}" if two else ""
    )
    return Mission("answer", tree("AskThenFly", (who, asked), steps), plan, say, names_of([*yes, *other]))


def percent_said(speaker: Speaker, percent: int) -> str:
    """Return a charge in words."""
    words = f"{percent} percent" if speaker.language == "en" else f"{percent} por ciento"
    return str(speaker.of((f"{percent} %", f"{percent}%", words)))


def battery(draw: Draw) -> Mission:
    """Return a mission that depends on the charge."""
    who = machine(draw, "drone", draw.rng.choice(("lwd", "hwd")), by_id=draw.rng.random() < 0.4)
    clauses, percent, text = (
        list(_branch(draw)),
        draw.rng.choice((35, 40, 45, 50, 55, 60, 65, 70, 75, 80, 85)),
        draw.told(),
    )
    waits = draw.rng.random() < 0.4
    flight = chain(clauses, "drone")
    test = f"drone.battery > {percent} %"
    steps: Steps = (
        [{"wait_until": f"drone.battery >= {percent} %"}, *flight]
        if waits
        else [{"if": test, "then": flight, "else": [{"notify": text[0]}]}]
    )

    def say(speaker: Speaker) -> str:
        amount = percent_said(speaker, percent)
        name = who.said(speaker)
        values = {"b": amount, "x": text, "m": name, "a": third(speaker, who, clauses)}
        return speaker.filled(speaker.pick(_CASES["charged" if waits else "battery"]), values)

    plan = f"With {'at least' if waits else 'more than'} {percent} % of charge {told(clauses, 'the drone')}"
    return Mission("battery", tree("IfCharged", (who,), steps), plan, say, names_of(clauses))


def again(draw: Draw) -> Mission:
    """Return a mission that is done every so often."""
    who = machine(draw, "drone", draw.rng.choice(("lwd", "hwd")), by_id=draw.rng.random() < 0.2)
    clauses, n, t = (
        list(_branch(draw)),
        Times(draw.rng.choice((2, 3, 4, 5))),
        Time(60 * draw.rng.choice((6, 8, 12, 15, 20, 30))),
    )
    steps: Steps = [{"repeat": n.value, "every": t.value, "steps": chain(clauses, "drone")}]

    def say(speaker: Speaker) -> str:
        return speaker.filled(speaker.pick(_CASES["again"]), {"n": n, "t": t, "a": third(speaker, who, clauses)})

    plan = f"{n.n} times, every {t.value}, {told(clauses, 'the drone')}"
    return Mission("every", tree("AgainAndAgain", (who,), steps), plan, say, names_of(clauses))


def escalate(draw: Draw) -> Mission:
    """Return a mission for which a second person is asked if the first one does not say yes."""
    who, one, two = machine(draw, "drone", "lwd"), person(draw, "picker"), person(draw, "watcher")
    question, en, es = draw.fact()
    clauses = list(_branch(draw))
    steps: Steps = [
        {"ask": question, "of": [one.role], "save_as": "reply"},
        {"if": "reply.answer != 'yes'", "then": [{"ask": question, "of": [two.role]}]},
        *chain(clauses, "drone"),
    ]

    def say(speaker: Speaker) -> str:
        values: dict[str, Any] = {"u": one.said, "v": two.said, "x": (en, es), "a": third(speaker, who, clauses)}
        values["question"] = question
        return speaker.filled(speaker.pick(_CASES["escalate"]), values)

    plan = (
        f"{one.said[0]} is asked, without a yes {two.said[0]} too; then the drone {', '.join(c.plan for c in clauses)}"
    )
    return Mission("escalate", tree("AskTwo", (who, one, two), steps), plan, say, names_of(clauses))


def both_agree(draw: Draw) -> Mission:
    """Return a mission that two people must agree to, asked one after the other, each about something else."""
    who = machine(draw, "drone", draw.rng.choice(("lwd", "hwd", "drone")), plain=True)
    people = [person(draw, "picker"), person(draw, "watcher")]
    draw.rng.shuffle(people)
    one, two = people
    question, en, es = draw.fact()
    other, other_en, other_es = draw.fact()
    while other == question:
        other, other_en, other_es = draw.fact()
    clauses = list(_branch(draw))
    steps: Steps = [{"ask": question, "of": [one.role]}, {"ask": other, "of": [two.role]}, *chain(clauses, "drone")]

    def say(speaker: Speaker) -> str:
        values: dict[str, Any] = {"u": one.said, "v": two.said, "x": (en, es), "y": (other_en, other_es)}
        return speaker.filled(speaker.pick(BOTH_AGREE), values | {"a": third(speaker, who, clauses)})

    plan = f"{one.said[0]} must agree, then {two.said[0]}; then the drone {', '.join(c.plan for c in clauses)}"
    return Mission("both_agree", tree("BothAgree", (who, one, two), steps), plan, say, names_of(clauses))


def refused(draw: Draw) -> Mission:
    """Return a mission in which a no is told, and the machine comes home in any case."""
    who, asked = machine(draw, "drone", draw.rng.choice(("lwd", "hwd"))), person(draw)
    question, en, es = draw.fact()
    first, text = draw.clause(draw.rng.choice(("over", "over_plain", "watch"))), draw.told()
    steps: Steps = [
        *chain([first], "drone"),
        {"ask": question, "of": [asked.role], "save_as": "reply"},
        {"if": "reply.answer == 'no'", "then": [{"notify": text[0]}]},
        {"do": "ReturnHome", "agent": "drone"},
    ]

    def say(speaker: Speaker) -> str:
        values = {"a": third(speaker, who, [first]), "u": asked.said, "x": (en, es), "y": text, "question": question}
        return speaker.filled(speaker.pick(_CASES["refused"]), values)

    plan = f"The drone {first.plan}, {asked.said[0]} is asked, a no is told; it returns"
    return Mission("refused", tree("AskAndTell", (who, asked), steps), plan, say, first.names)


def follow(draw: Draw) -> Mission:
    """Return a mission that goes where a tracker says. Only simulated pickers have one."""
    if draw.at.kinds["picker"][0] != "picker":
        return refused(draw)
    who, asked = machine(draw, "drone", draw.rng.choice(("lwd", "hwd"))), person(draw, "picker")
    h, t = draw.height(), Time(draw.rng.choice((10, 20, 25, 30, 40)))
    base = "base"
    steps: Steps = [
        {"do": "FlyTo", "agent": "drone", "to": base, "height": h.value},
        {
            "repeat": "1 h",
            "every": t.value,
            "steps": [
                {"do": "MiniFinder", "agent": asked.role, "base": base, "save_as": "fix"},
                {"break_if": "fix.in_range"},
                {"do": "FlyTo", "agent": "drone", "to": "fix.go_to", "height": h.value},
            ],
        },
        {"do": "ReturnHome", "agent": "drone"},
    ]

    def say(speaker: Speaker) -> str:
        values = {"a": who.said(speaker), "u": asked.said, "h": h, "t": t}
        return speaker.filled(speaker.pick(_CASES["follow"]), values)

    plan = f"The drone asks the tracker every {t.value} and follows it at {h.value} until in range, then returns"
    return Mission("follow", tree("FollowTracker", (who, asked), steps), plan, say)
