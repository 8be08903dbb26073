"""What corresponds to what: the one table of the bridge to BehaviorTree.CPP, and the codes of what gets lost.

Read by the exporter (own nodes and their ports), the importer (which elements are nodes of BT.CPP), and docs/btcpp.md,
which a test holds against it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

Faith = Literal["same", "near", "own"]
"""same: BT.CPP does what we do; near: it does almost; own: a node that the host must register."""


@dataclass(frozen=True, slots=True)
class Correspondence:
    """One correspondence."""

    ours: str
    theirs: str
    faith: Faith
    remark: str = ""


ROWS: Final = (
    Correspondence("`sequence`, `steps`", "`Sequence`", "same"),
    Correspondence("`sequence` with `reactive`", "`ReactiveSequence`", "same"),
    Correspondence(
        "`sequence` with `finally`, `finally`", "`Finally`", "own", "Two children: the body, and what follows it."
    ),
    Correspondence(
        "`fallback`",
        "`Fallback`",
        "same",
        "With an `AlwaysFailure` at its end if all children could be skipped: it fails.",
    ),
    Correspondence("`fallback` with `reactive`", "`ReactiveFallback`", "same"),
    Correspondence("`parallel`, `need: all`", '`ParallelAll max_failures="1"`', "same"),
    Correspondence("`parallel`, `need: all`, `cancel`", "`Parallel` with success_count -1, failure_count 1", "same"),
    Correspondence("`race`", "`Parallel` with success_count 1, failure_count 1", "same"),
    Correspondence("`parallel`, `need: any` or `N`", "`Parallel` with success_count", "near", "L05, L12"),
    Correspondence("`if`", "`IfThenElse`", "same", "Without `else`: a child that is always skipped."),
    Correspondence(
        "`switch`", "`Switch2` to `Switch6`", "same", "On a copy made by `Script`; more than six cases nest."
    ),
    Correspondence("`repeat: N`", "`Repeat`", "same", "Only with nothing but `steps`, and no `break_if` in it."),
    Correspondence("`while`, other `repeat`", "`Loop`", "own"),
    Correspondence("`for`", "`ForEach`", "own"),
    Correspondence("`break_if`", "`BreakIf`", "own"),
    Correspondence("`guard`", "`ReactiveSequence` of the condition and the steps", "same"),
    Correspondence(
        "`do: role.Action`",
        "`Action`, by its name",
        "own",
        "Ports: agent, the fields, an output for each field of the result.",
    ),
    Correspondence("`ask`", "`Ask`", "own"),
    Correspondence("`notify`", "`Notify`", "own"),
    Correspondence("`release`", "`Release`", "own"),
    Correspondence(
        "`call`", "`SubTree`", "same", "Arguments that are computed are computed before it, by `Script` or `Evaluate`."
    ),
    Correspondence("`wait`", "`Sleep`", "same"),
    Correspondence("`wait_until`", "`WaitUntil`", "own"),
    Correspondence("`wait_for`", "`WaitFor`", "own"),
    Correspondence("`check`", "`ScriptCondition`, else `Expression`", "near", "L08 if it has a message."),
    Correspondence("`set`, `vars`, `returns`", "`Script`, else `Evaluate`", "same"),
    Correspondence("`set: {x: null}`", "`UnsetBlackboard`", "same", "A var that is declared by its type begins so."),
    Correspondence("`fail`", "`AlwaysFailure`", "near", "L08"),
    Correspondence("`track`", "-", "near", "L13"),
    Correspondence("`expect`", "`Sequence` of the action and a condition", "same"),
    Correspondence("`when`", "`_skipIf`, else `When`", "same"),
    Correspondence("`timeout`", "`Timeout`", "same"),
    Correspondence(
        "`retry`", "`RetryUntilSuccessful`", "near", "L03 if it pauses; `attempt_timeout` is a `Timeout` inside."
    ),
    Correspondence("`ignore_failure`", "`ForceSuccess`", "same"),
    Correspondence("`on_failure`", "`Fallback` of the steps and `ForceFailure` of the section", "same"),
    Correspondence("`on_abort`", "a tree of its own", "near", "L02"),
    Correspondence("`agents`", "`Agents`", "own", "All roles at once, or none."),
    Correspondence("`with_agents`", "`WithAgents`", "own"),
    Correspondence("`with_resource`", "`WithResource`", "own"),
    Correspondence(
        "`params`", "ports of the tree in TreeNodesModel", "same", "The host puts them on the blackboard, in SI units."
    ),
    Correspondence("`critical`, `priority`, `preemptible`, ...", "-", "near", "L04"),
)
"""Every construct of the language that the bridge knows."""

LOSSES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "L01": "A value cannot be written as a port: it is left away.",
        "L02": "`on_abort` has no counterpart: halting is immediate in BT.CPP. It becomes a tree that nothing starts.",
        "L03": "The pause between attempts also follows the last one, and does not grow (`backoff`).",
        "L04": "An option of fleets (priority, preemption, cleanup, another agent, `on` of a retry, ...) has no counterpart.",
        "L05": "`finish` with `need: N`: BT.CPP cancels the others as soon as N cannot be reached any more.",
        "L06": "A condition is beyond BT.CPP's scripts: it is kept as text for the node `Expression`, `When` or `Loop`.",
        "L07": "A field of an agent is read: the host has to keep this blackboard entry up to date.",
        "L08": "Message and code of a failure are kept in the file, but BT.CPP does not tell them.",
        "L11": "A kind of step is not known to this bridge: it becomes a node of the same name.",
        "L13": "`track`: ports are read once, unless the host reads them again; it is kept in the file.",
        "L12": "A child that is skipped counts neither way for us, but BT.CPP may then wait for ever for `N`.",
    }
)
"""Codes of what an export loses."""

TROUBLES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "X01": "The file is refused: no XML, too large or too deep, a DOCTYPE, or no tree of BT.CPP.",
        "X02": "An element or attribute has no counterpart; it is left away, or kept as a TODO.",
        "X03": "A script cannot be read as an expression.",
        "X04": "A blackboard entry is read that nothing in the file writes: it becomes a param to be typed.",
        "X05": "An action names no agent: it gets the role `robot`, whose type you choose.",
        "X06": "A condition node stands for code: it becomes a yes/no param, to be replaced by an expression.",
        "X07": "A node behaves a little differently here.",
        "X08": "A subtree is named that the file does not have, or that calls itself: an error.",
        "X09": "A node cannot be said in this language: an error. The task fails at that place until a person writes it anew.",
    }
)
"""Codes of what an import reports."""

ERRORS: Final = frozenset({"X01", "X08", "X09"})
"""Those with which an import ends with exit code 1."""


_RESERVED: Final = frozenset({"name", "id", "p_name", "p_id"})


def port_name(name: str) -> str:
    """Return the port of a name of ours; BT.CPP keeps `name`, `ID` and a leading underscore for itself."""
    return f"p_{name}" if name.lower() in _RESERVED or name.startswith("_") else name


def our_name(port: str) -> str:
    """Return the name that `port_name` made a port of."""
    rest = port.removeprefix("p_")
    return rest if port_name(rest) == port else port


@dataclass(frozen=True, slots=True)
class OwnNode:
    """A node of ours that the host registers."""

    name: str
    category: Literal["Action", "Condition", "Control", "Decorator"]
    ports: Mapping[str, Literal["input", "output", "inout"]]
    help: str


def _ins(*names: str) -> dict[str, Literal["input", "output", "inout"]]:
    return dict.fromkeys(names, "input")


OWN: Final[Mapping[str, OwnNode]] = MappingProxyType(
    {
        node.name: node
        for node in (
            OwnNode("Agents", "Action", {}, "Claim one agent for each role, all or none; writes their ids."),
            OwnNode(
                "Ask",
                "Action",
                {
                    **_ins(
                        "question", "of", "options", "policy", "escalate_after", "clears", "clears_on", "if_no_answer"
                    ),
                    "answer": "output",
                    "by": "output",
                    "at": "output",
                },
                "Put a question to people.",
            ),
            OwnNode("Notify", "Action", _ins("text", "to", "severity"), "Notify people; never fails."),
            OwnNode("Release", "Action", _ins("agent"), "Give an agent back."),
            OwnNode("WaitUntil", "Action", _ins("cond"), "Run until the expression is true."),
            OwnNode(
                "WaitFor",
                "Action",
                {**_ins("agent", "event", "since"), "value": "output"},
                "Run until the next event of the agent.",
            ),
            OwnNode("BreakIf", "Action", _ins("cond"), "Leave the nearest Loop or ForEach with success."),
            OwnNode(
                "Evaluate",
                "Action",
                {"text": "input", "value": "output"},
                "Compute an expression that scripts cannot say.",
            ),
            OwnNode("Expression", "Condition", _ins("text"), "Success if the expression is true."),
            OwnNode("When", "Decorator", _ins("cond"), "Skip the child unless the expression is true at entry."),
            OwnNode(
                "Loop",
                "Decorator",
                _ins("while", "times", "duration", "until", "every", "max"),
                "Rounds of the child.",
            ),
            OwnNode(
                "ForEach",
                "Decorator",
                _ins("mode", "max_parallel", "need", "on_child_failure", "collect", "first"),
                "A round of the child for each item of lists of equal lengths.",
            ),
            OwnNode("WithAgents", "Decorator", {}, "Claim more agents, run the child, give them back."),
            OwnNode(
                "WithResource",
                "Decorator",
                _ins("resources", "wait"),
                "Claim units of resources of the site, run the child, give them back.",
            ),
            OwnNode(
                "Finally", "Control", {}, "The first child; then, however it ended, the second. The first one's result."
            ),
        )
    }
)
"""Nodes of ours by name; `Agents`, `WithAgents` and `ForEach` have more ports, one or two for each role or list."""

BTCPP: Final[Mapping[str, str]] = MappingProxyType(
    {
        **dict.fromkeys(
            ("Sequence", "ReactiveSequence", "SequenceStar", "SequenceWithMemory", "AsyncSequence", "Fallback"),
            "Control",
        ),
        **dict.fromkeys(
            ("FallbackStar", "AsyncFallback", "ReactiveFallback", "Parallel", "ParallelAll", "IfThenElse"), "Control"
        ),
        **dict.fromkeys(("WhileDoElse", "Switch2", "Switch3", "Switch4", "Switch5", "Switch6", "TryCatch"), "Control"),
        **dict.fromkeys(
            ("Inverter", "RetryUntilSuccessful", "RetryUntilSuccesful", "KeepRunningUntilFailure", "Repeat", "Timeout"),
            "Decorator",
        ),
        **dict.fromkeys(
            ("Delay", "RunOnce", "ForceSuccess", "ForceFailure", "Precondition", "LoopInt", "LoopBool", "LoopDouble"),
            "Decorator",
        ),
        **dict.fromkeys(("LoopString", "SkipUnlessUpdated", "WaitValueUpdate"), "Decorator"),
        **dict.fromkeys(
            ("AlwaysSuccess", "AlwaysFailure", "Script", "SetBlackboard", "UnsetBlackboard", "Sleep"), "Action"
        ),
        **dict.fromkeys(("ScriptCondition", "BlackboardCheckString"), "Condition"),
        "SubTree": "SubTree",
        "SubTreePlus": "SubTree",
    }
)
"""Nodes that BT.CPP itself has (3.x and 4.x), by category."""

NAV2: Final = frozenset({"RecoveryNode", "RoundRobin"})
"""Control nodes of Nav2 that are read. Its others (PipelineSequence, RateController, ...) tick again what has run already."""


def as_markdown() -> str:
    """Return the table of correspondences as docs/btcpp.md shows it."""
    rows = [f"| {row.ours} | {row.theirs} | {row.faith} | {row.remark} |" for row in ROWS]
    return "\n".join(["| formiga | BehaviorTree.CPP | | |", "|---|---|---|---|", *rows])


def codes_as_markdown(codes: Mapping[str, str]) -> str:
    """Return a table of codes as docs/btcpp.md shows it."""
    return "\n".join(["| code | |", "|---|---|", *(f"| {code} | {said} |" for code, said in codes.items())])
