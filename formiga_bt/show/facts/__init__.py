"""What is seen of a site, as plain values: the one vocabulary of HTTP, the commands, assistants and pictures.

The same from a file, a dry run, a running engine or a stored history. Drawings never look into an engine; what they show is
here, and travels as JSON (facts that come in thousands leave out fields that have their defaults). Instants are engine time in
microseconds (`Micros`), places metres east, north and up of the base station, angles degrees, percent 0..100.
"""

from formiga_bt.show.facts.alarms import AlarmFact, AlarmList, AlarmTurnFact
from formiga_bt.show.facts.fleet import (
    CatalogueFact,
    DiscoveredFact,
    FleetFact,
    FleetList,
    FleetLoaded,
    MemberFact,
    TypeFact,
)  # fmt: skip
from formiga_bt.show.facts.history import (
    BlackboardFact,
    Chart,
    MapLane,
    MapMark,
    MapShape,
    Spread,
    Stats,
    Timeline,
    Track,
    Waiting,
)
from formiga_bt.show.facts.news import ChannelFact, ChannelList, ChannelTried
from formiga_bt.show.facts.orders import (
    AgentList,
    ApprovalFact,
    ApprovalList,
    AssignedFact,
    CheckFact,
    DraftFact,
    LockdownFact,
    OrderDone,
    OrderedFact,
    OrderFact,
    OrderReply,
    PilotFact,
    PilotList,
    PreflightFact,
    ServedFact,
    SkippedFact,
    SpeakerFact,
    TaskList,
    TaskRequested,
    ZoneFact,
    ZoneList,
)  # fmt: skip
from formiga_bt.show.facts.rules import FiringFact, RuleFact, RuleList, RuleWaitFact
from formiga_bt.show.facts.service import (
    Alive,
    EngineHealth,
    EngineLoad,
    EventFact,
    LibraryList,
    LibraryTask,
    ParamFact,
    Problem,
    TaskLoaded,
    VersionFact,
)  # fmt: skip
from formiga_bt.show.facts.site import (
    ActionFact,
    AgentFact,
    AttachmentKept,
    Because,
    Deed,
    Explanation,
    FailureFact,
    FileFact,
    GoalFact,
    HeldUnits,
    LineFact,
    Now,
    PastTask,
    Point,
    QuestionFact,
    QuestionList,
    ResourceFact,
    RunningStep,
    StandingFact,
    TaskDetail,
    TaskFact,
    TaskPicture,
    Top,
)  # fmt: skip
from formiga_bt.show.facts.tree import Box, Drawing, FileSpot, StepFact, StepStatus, Style, StyledSpan

__all__ = [
    "ActionFact", "AgentFact", "AgentList", "AlarmFact", "AlarmList", "AlarmTurnFact", "Alive",
    "ApprovalFact", "ApprovalList", "AssignedFact", "AttachmentKept", "Because", "BlackboardFact", "Box", "CatalogueFact",
    "ChannelFact", "ChannelList", "ChannelTried", "Chart", "CheckFact", "Deed", "DiscoveredFact", "DraftFact", "Drawing",
    "EngineHealth", "EngineLoad", "EventFact", "Explanation", "FailureFact", "FileFact", "FileSpot", "FiringFact",
    "FleetFact", "FleetList", "FleetLoaded", "GoalFact", "HeldUnits", "LibraryList", "LibraryTask", "LineFact",
    "LockdownFact", "MapLane", "MapMark", "MapShape", "MemberFact", "Now", "OrderDone", "OrderFact", "OrderReply",
    "OrderedFact", "ParamFact", "PastTask", "PilotFact", "PilotList", "Point", "PreflightFact", "Problem", "QuestionFact",
    "QuestionList", "ResourceFact", "RuleFact", "RuleList", "RuleWaitFact", "RunningStep", "ServedFact", "SkippedFact",
    "SpeakerFact", "Spread", "StandingFact", "Stats", "StepFact", "StepStatus", "Style", "StyledSpan", "TaskDetail", "TaskFact",
    "TaskList", "TaskLoaded", "TaskPicture", "TaskRequested", "Timeline", "Top", "Track", "TypeFact", "VersionFact",
    "Waiting", "ZoneFact", "ZoneList",
]  # fmt: skip
