"""What may stand at a position: the levels that `where` found, led through the tables of keys of the language.

The tables are those that the checker reads (`lang.kinds` and its like for sites, catalogues and scenarios), so a new kind
or option is completed and explained without a word here. Only what a map of free names holds is said here.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from types import MappingProxyType
from typing import Final, Literal

from formiga_bt.lang import site
from formiga_bt.lang.actions import ACTION, FIELD
from formiga_bt.lang.catalogue import FILE, TYPE
from formiga_bt.lang.kinds import (
    FORM,
    KINDS,
    LIBRARY,
    MODIFIERS,
    PARAM,
    RECORD_FIELD,
    ROLE,
    SUBTREE,
    TASK,
    VAR,
    Option,
    StepKind,
)
from formiga_bt.lang.rules.keys import RULE, RULES_FILE
from formiga_bt.lang.scenario import options as scenario
from formiga_bt.rehearsal.cases import options as tests

FileKind = Literal["task", "library", "site", "rules", "catalogue", "scenario", "test"]


@dataclass(frozen=True, slots=True)
class OptionMapping:
    """A mapping with known keys, or a list of such mappings."""

    owner: str
    options: tuple[Option, ...] = ()


@dataclass(frozen=True, slots=True)
class FreeMapping:
    """A mapping with free keys; `what` says whose, `of` what stands behind each."""

    what: str
    of: "Schema | None" = None


@dataclass(frozen=True, slots=True)
class Steps:
    """A list of steps."""


@dataclass(frozen=True, slots=True)
class OptionValue:
    """A value: that of an option, or one behind a free name of `names`."""

    option: Option | None = None
    names: str = ""


Schema = OptionMapping | FreeMapping | Steps | OptionValue


@dataclass(slots=True)
class Slot:
    """What may stand at a position."""

    schema: Schema | None
    """In a key: of the mapping around it. In a value: of the value."""
    step: Mapping[str, str] = field(default_factory=dict)
    """The keys of the nearest step around, each with the scalar behind it."""
    body: str = ""
    """The subtree in whose definition the position is."""
    section: str = ""
    """The key at the left margin."""
    in_list: bool = False
    names: tuple[str, ...] = ()
    """The free names (of a param, an agent type, ...) on the way, outermost first."""

    @property
    def kind(self) -> StepKind | None:
        """Return the kind of the nearest step around."""
        return kind_of(self.step)


_VARS: Final = FreeMapping("vars", OptionMapping("var", VAR))
_PARAMS: Final = FreeMapping("params", OptionMapping("param", PARAM))
_ROLES: Final = FreeMapping("agents", OptionMapping("role", ROLE))
_SUBTREES: Final = FreeMapping("subtrees", OptionMapping("subtree", SUBTREE))
_PLACE: Final = OptionValue(Option("place", "value", "", type="place"))
_TYPE: Final = Option("type", "name", "The type.")
_LIST_TYPE: Final = OptionMapping("list type", (Option("list", "name", "The type of its items: the value is a list."),))
"""What may stand in place of a type's name: `{list: place}`."""

_SECRET: Final = OptionMapping("secret", site.SECRET)
_RULES: Final = FreeMapping("rules", OptionMapping("rule", RULE))
_RECORDS: Final = FreeMapping("records", FreeMapping("record", OptionMapping("record field", RECORD_FIELD)))
_INSIDE: Final[Mapping[tuple[str, str], Schema]] = MappingProxyType(
    {
        ("task", "params"): _PARAMS,
        ("task", "vars"): _VARS,
        ("task", "agents"): _ROLES,
        ("task", "subtrees"): _SUBTREES,
        ("task", "records"): _RECORDS,
        ("library", "records"): _RECORDS,
        ("catalogue", "records"): _RECORDS,
        ("library", "subtrees"): _SUBTREES,
        ("subtree", "params"): _PARAMS,
        ("catalogue", "types"): FreeMapping("types", OptionMapping("type", TYPE)),
        ("catalogue", "actions"): FreeMapping("actions", OptionMapping("action", ACTION)),
        ("step", "form"): FreeMapping("form", OptionMapping("field", FORM)),
        ("param", "type"): _LIST_TYPE,
        ("field", "type"): _LIST_TYPE,
        ("var", "type"): _LIST_TYPE,
        ("action", "fields"): FreeMapping("fields", OptionMapping("field", FIELD)),
        ("action", "result"): FreeMapping("fields", OptionMapping("field", FIELD)),
        ("site", "base"): OptionMapping("base", site.BASE),
        ("site", "ports"): FreeMapping("ports", OptionMapping("port", site.PORT)),
        ("site", "resources"): FreeMapping("resources", OptionMapping("resource", site.RESOURCE)),
        ("site", "places"): FreeMapping("places", _PLACE),
        ("site", "terrain"): OptionMapping("terrain", site.TERRAIN),
        ("site", "allocator"): OptionMapping("allocator", site.ALLOCATOR),
        ("site", "pilots"): OptionMapping("pilot", site.PILOT),
        ("site", "agents"): FreeMapping("site agents", OptionMapping("site agent", site.AGENT)),
        ("site", "rules"): _RULES,
        ("site", "news"): FreeMapping("news", OptionMapping("channel", site.CHANNEL)),
        ("channel", "webhook"): OptionMapping("webhook", site.WEBHOOK),
        ("channel", "mail"): OptionMapping("mail", site.MAIL),
        ("mail", "password"): _SECRET,
        ("channel", "mqtt"): OptionMapping("mqtt", site.MQTT),
        ("mqtt", "password"): _SECRET,
        ("webhook", "url"): _SECRET,
        ("webhook", "secret"): _SECRET,
        ("rules", "rules"): _RULES,
        ("port", "at"): _PLACE,
        ("port", "waiting"): _PLACE,
        ("scenario", "agents"): OptionMapping("scenario agent", scenario.AGENT),
        ("scenario", "tasks"): OptionMapping("scenario task", scenario.TASK),
        ("scenario", "faults"): OptionMapping("fault", scenario.FAULT),
        ("scenario", "orders"): OptionMapping("order", scenario.ORDER),
        ("scenario", "wind"): OptionMapping("wind", scenario.WIND),
        ("scenario agent", "person"): OptionMapping("person", scenario.PERSON),
        ("person", "answers"): OptionMapping("answer", scenario.ANSWER),
        ("test", "cases"): OptionMapping("case", tests.CASE),
        ("case", "agents"): FreeMapping("case agents", OptionMapping("case agent", tests.AGENT)),
        ("case", "answers"): OptionMapping(
            "answer or goal", tuple({o.name: o for o in (*tests.GOAL, *tests.ANSWER)}.values())
        ),
        ("case", "faults"): OptionMapping("fault", (*tests.DURING, *scenario.FAULT)),
        ("case", "orders"): OptionMapping("order", (*tests.DURING, *scenario.ORDER)),
        ("case", "expect"): OptionMapping("expect", tests.EXPECT),
    }
)
"""What the maps and lists of a table hold, where the table itself does not say it."""

_MAPS: Final[Mapping[str, Schema]] = MappingProxyType(
    {
        "with": FreeMapping("with", OptionValue(names="with")),
        "set": FreeMapping("set", OptionValue(names="set")),
        "for": FreeMapping("for", OptionValue(names="for")),
        "cases": FreeMapping("cases", Steps()),
        "with_agents": _ROLES,
    }
)
"""The maps of steps."""

ROOTS: Final[Mapping[FileKind, OptionMapping]] = MappingProxyType(
    {
        "task": OptionMapping("task", TASK),
        "library": OptionMapping("library", LIBRARY),
        "site": OptionMapping("site", site.SITE),
        "rules": OptionMapping("rules", RULES_FILE),
        "catalogue": OptionMapping("catalogue", FILE),
        "scenario": OptionMapping("scenario", scenario.SCENARIO),
        "test": OptionMapping("test", tests.FILE),
    }
)


def file_kind(lines: Sequence[str], name: str = "") -> FileKind:
    """Return what a file is, by its keys at the left margin; a task, if nothing says otherwise."""
    if name.endswith((".test.yaml", ".test.yml")):
        return "test"
    keys = _root_keys(lines)
    if "task" in keys:
        return "task"
    if "formiga_site" in keys:
        return "site"
    if "formiga_rules" in keys:
        return "rules"
    if "scenario" in keys:
        return "scenario"
    if "formiga" in keys:
        return "library" if "subtrees" in keys and "steps" not in keys else "task"
    return "catalogue" if keys & {"types", "actions"} else "task"


def is_ours(lines: Sequence[str]) -> bool:
    """Return whether a file is one of formiga's; an editor shows other YAML files too."""
    keys = _root_keys(lines)
    marks = {"formiga", "formiga_site", "formiga_rules", "formiga_test", "scenario"}
    return bool(keys & marks) or {"task", "steps"} <= keys or bool(keys and keys <= {"types", "actions"})


def _root_keys(lines: Sequence[str]) -> set[str]:
    return {line.split(":", 1)[0].rstrip() for line in lines if line[:1].isalpha() and ":" in line}


_OPTIONS: Final = frozenset(option.name for kind in KINDS.values() for option in kind.options)
"""Names of options, some of which are kinds too."""


def kind_of(keys: Mapping[str, str] | Sequence[str]) -> StepKind | None:
    """Return the kind of a step with these keys, as the checker finds it."""
    present = [key for key in keys if key in KINDS]
    options = {option.name for key in present for option in KINDS[key].options}
    kinds = [key for key in present if key not in options] or present
    known = {option.name for option in (*MODIFIERS, *(KINDS[kinds[0]].options if kinds else ()))}
    if len(kinds) == 1 and kinds[0] in _OPTIONS and not known.issuperset(key for key in keys if key not in KINDS):
        return None  # a word such as `wait`, which is an option too, of a step whose kind is not written yet
    return KINDS[kinds[0]] if kinds else None


def options_of(kind: StepKind | None) -> tuple[Option, ...]:
    """Return what a step of a kind may hold, its own key first; of an unknown kind only the modifiers."""
    if kind is None:
        return MODIFIERS
    own = Option(kind.name, kind.form, kind.doc, kind.type, required=True)
    return (own, *kind.options, *MODIFIERS)


def step_value(keys: Mapping[str, str] | Sequence[str], key: str) -> Schema | None:
    """Return what stands behind a key of a step with these keys."""
    return _step_value(tuple(one for one in keys if one in KINDS), key)


@lru_cache(1024)
def _step_value(keys: tuple[str, ...], key: str) -> Schema | None:
    option = next((one for one in options_of(kind_of(keys)) if one.name == key), None)
    if option is None:
        known = [kind for kind in KINDS.values() if kind.name == key]
        option = options_of(known[0])[0] if known else None
    return _of_option("step", option)


def _of_option(owner: str, option: Option | None) -> Schema | None:
    if option is None:
        return None
    inside = _INSIDE.get((owner, option.name))
    if inside is not None:
        return inside
    if option.form == "steps":
        return Steps()
    if option.form == "options":
        return OptionMapping(option.name, option.keys)
    if option.form == "map" and owner == "step":
        return _MAPS.get(option.name, FreeMapping(option.name))
    return OptionValue(option)


def table_value(table: OptionMapping, key: str) -> Schema | None:
    """Return what stands behind a key of a table."""
    return _of_option(table.owner, next((one for one in table.options if one.name == key), None))


def scalar_behind(schema: Schema | None) -> Schema | None:
    """Return what a scalar is that stands where a mapping may: a param in its short form is its type."""
    if isinstance(schema, OptionMapping) and schema.owner in ("param", "field"):
        return OptionValue(next(option for option in schema.options if option.name == "type"))
    if isinstance(schema, OptionMapping) and schema.owner == "var":
        return OptionValue(names="vars")
    if schema is _LIST_TYPE:
        return OptionValue(_TYPE)
    return schema


class GrammarWalk:
    """Leads from the root of a file inwards, a level at a time. Used for positions and for whole documents."""

    def __init__(self, kind: FileKind) -> None:
        self.slot = Slot(ROOTS[kind])
        self._is_step = False

    def fork(self) -> "GrammarWalk":
        """Return a walk that goes on from here by itself."""
        other = GrammarWalk.__new__(GrammarWalk)
        other.slot, other._is_step = self.slot, self._is_step
        return other

    def into_list(self) -> None:
        """Enter a list: its items are steps, mappings of a table, or values."""
        was = self.slot
        self._is_step = isinstance(was.schema, Steps)
        self.slot = Slot(was.schema, was.step, was.body, was.section, True, was.names)

    def into_map(self, keys: Mapping[str, str]) -> None:
        """Enter a mapping with these keys."""
        was = self.slot
        schema, step = was.schema, keys if self._is_step else was.step
        if isinstance(schema, OptionValue) and schema.option is not None and schema.option.keys:
            schema = OptionMapping(schema.option.name, schema.option.keys)
        self.slot = Slot(schema, step, was.body, was.section, False, was.names)

    @property
    def is_step(self) -> bool:
        """Return whether the mapping at hand is a step."""
        return self._is_step

    def behind(self, key: str, *, at_root: bool = False) -> None:
        """Go behind a key of the mapping at hand."""
        schema, names, body = self.slot.schema, self.slot.names, self.slot.body
        inner: Schema | None = None
        if self._is_step:
            inner = step_value(self.slot.step, key)
        elif isinstance(schema, OptionMapping):
            inner = table_value(schema, key)
        elif isinstance(schema, FreeMapping):
            inner = schema.of
            names = (*names, key)
            body = key if schema.what == "subtrees" else body
        self._is_step = False
        section = key if at_root else self.slot.section
        self.slot = Slot(inner, self.slot.step, body, section, self.slot.in_list, names)
