"""Reads the standing rules of a site: those of the site file, then those of `rules/*.yaml` beside it.

A rule is checked against the task that it requests as a step is: its names, the types of what it is given, the event that it is
on and that event's fields. Tasks are found in `trees/` beside the site file, in its folder, and among those that ship.
"""

import hashlib
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Final

from formiga_bt.base.clock import micros
from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.packaged import folder
from formiga_bt.lang.body import Body
from formiga_bt.lang.expressions import Scope
from formiga_bt.lang.files import read_file
from formiga_bt.lang.keyed import Keys, check_version, read_inside, read_root
from formiga_bt.lang.model import Catalogue, Expr, OnEvent, OnSilence, Rule, Site
from formiga_bt.lang.request.neighbours import Neighbours
from formiga_bt.lang.rules.keys import FOLDER, RULE, RULES_FILE
from formiga_bt.lang.rules.on import Heard, read_on
from formiga_bt.lang.steps.requests import read_args, task_params
from formiga_bt.lang.text.document import Entry, Listing, Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import (
    Problems,
    did_you_mean,
    fix_word,
    quoted_list,
    read_name,
    read_words,
    shorten,
    why_unreadable,
)
from formiga_bt.lang.text.synonyms import nearest, surely
from formiga_bt.lang.types import Type
from formiga_bt.lang.world import World

MOST_RULES: Final = 200
_AT_MOST: Final = re.compile(r"([1-9]\d{0,2})\s+running(\s+per\s+agent)?")
_LEAST_SILENT_US: Final = 5_000_000
"""Statuses come each second, and one that is late says nothing yet."""


class Rules:
    """Reads all rules of one site.

    Args:
        site: as it was read, without its rules.
        catalogue: agent types and actions.
        problems: where to report.
        read: gives the text of a file.
    """

    def __init__(
        self, site: Site, catalogue: Catalogue, problems: Problems, read: Callable[[Path], str] = read_file
    ) -> None:
        self._site = site
        self._problems = problems
        self._read = read
        self._beside = Path(site.file).parent
        shipped = folder("trees")
        self._neighbours = Neighbours(self._beside / "trees", (self._beside, shipped), read)
        self._world = World(catalogue, site, None, self._neighbours)
        self._entries: dict[str, Entry] = {}
        self.sources: dict[str, str] = {}
        """Texts of the files of rules, by name."""

    def all(self, own: Iterable[Entry]) -> tuple[dict[str, Rule], str]:
        """Return the checked rules by name, and the digest of what they say.

        Args:
            own: those of the site file.
        """
        self._collect(own)
        for path in self._files():
            self._collect(self._of_file(path))
        found = {name: rule for name, entry in self._entries.items() if (rule := self._rule(entry)) is not None}
        said = sorted(f"{name}: {_said(entry.value)}" for name, entry in self._entries.items())
        return found, hashlib.sha256("\n".join(said).encode()).hexdigest() if said else ""

    def _files(self) -> list[Path]:
        below = self._beside / FOLDER
        return sorted((*below.glob("*.yaml"), *below.glob("*.yml"))) if below.is_dir() else []

    def _of_file(self, path: Path) -> tuple[Entry, ...]:
        name = str(path)
        try:
            self.sources[name] = text = self._read(path)
        except (OSError, UnicodeDecodeError) as error:
            self._problems.add("E008", Mark(name, 1, 1), f"the file cannot be read: {why_unreadable(error)}")
            return ()
        begin = "formiga_rules: 1"
        keys = read_root(text, name, RULES_FILE, self._problems, what="rules", owner="a file of rules", begin=begin)
        if keys is None:
            return ()
        check_version(keys, "formiga_rules", "these rules need")
        return tuple(keys.entries("rules"))

    def _collect(self, entries: Iterable[Entry]) -> None:
        for entry in entries:
            name = entry.key.text
            if read_name(entry.key, self._problems, "rules") is None:
                continue
            if name in self._entries:
                first = self._entries[name].key.mark
                what = f"the rule '{name}' is there twice; first at {first.said}"
                self._problems.add("E018", entry.key.mark, what, "choose another name")
            elif len(self._entries) == MOST_RULES:
                self._problems.add("E132", entry.key.mark, f"a site has at most {MOST_RULES} rules")
                return
            else:
                self._entries[name] = entry

    # -- one rule ------------------------------------------------------------------------------------------------------
    def _rule(self, entry: Entry) -> Rule | None:
        name, problems = entry.key.text, self._problems
        with problems.within(f"rule {name}"):
            before = len(problems.found)
            keys = read_inside(entry.value, RULE, problems, name, "a rule")
            on, task = keys.text("on"), keys.name("request")
            heard = read_on(on, self._site, self._world.catalogue.types, problems) if on is not None else None
            of = self._of(keys, heard)
            after_us = self._after(keys, heard)
            most, per_agent = self._at_most(keys)
            args = self._args(keys, task, heard) if task is not None else None
            priority = keys.word("priority")
            if problems.has_errors(before) or heard is None or on is None or task is None or args is None:
                return None
            watched = f"{heard.watched} {','.join(of)} {after_us}"
            return Rule(
                name=name, mark=entry.key.mark, on=heard.on, source=on.text, types=heard.types, of=of, after_us=after_us,
                task=task.text, file=self._neighbours.path(task.text), args=args,
                priority=priority, most=most, per_agent=per_agent,  # type: ignore[arg-type]
                watched=hashlib.sha256(watched.encode()).hexdigest(),
            )  # fmt: skip

    def _of(self, keys: Keys, heard: Heard | None) -> tuple[str, ...]:
        """Return the agents that a rule is for; empty: any."""
        if "of" not in keys:
            return ()
        node = keys["of"].value
        if isinstance(node, Scalar) and node.text == "any":
            return ()
        items = [node] if isinstance(node, Scalar) else read_words(node, self._problems, "of")
        agents = self._site.agents
        for at in items:
            known = agents.get(at.text)
            if known is None:
                meant = surely(at.text, agents)
                what = f"no agent is called '{shorten(at.text)}'{did_you_mean(at.text, agents)}"
                told = f"any, or a list of agents: {quoted_list(agents)}"
                self._problems.add("E010", at.mark, what, told, fix_word(at, meant))
            elif heard is not None and known.type not in heard.types:
                what = f"'{at.text}' is of type {known.type}, the rule is on {' or '.join(heard.types)}"
                self._problems.add("E132", at.mark, what, "take it out, or name its type in 'on'")
        return tuple(at.text for at in items)

    def _after(self, keys: Keys, heard: Heard | None) -> int:
        after_us = micros(keys.number("for"))
        if heard is not None and isinstance(heard.on, OnEvent) and "for" in keys:
            what = "an event happens at one moment: it lasts for no time"
            self._problems.add("E132", keys["for"].key.mark, what, "take 'for' out")
        if heard is not None and isinstance(heard.on, OnSilence) and after_us < _LEAST_SILENT_US:
            mark = keys.mark("for") if "for" in keys else keys["on"].value.mark
            self._problems.add("E132", mark, "silent needs 'for', of 5 s at least", "such as: for: 60 s")
        return after_us

    def _at_most(self, keys: Keys) -> tuple[int, bool]:
        at = keys.text("at_most")
        found = _AT_MOST.fullmatch(at.text.strip()) if at is not None else None
        if at is not None and found is None:
            what = f"'at_most' cannot be '{shorten(at.text)}'"
            self._problems.add("E132", at.mark, what, "such as: 1 running per agent, or: 2 running")
        return (int(found[1]), found[2] is not None) if found is not None else (1, True)

    def _args(self, keys: Keys, task: Scalar, heard: Heard | None) -> dict[str, Expr] | None:
        params = task_params(self._neighbours, task.text, self._world)
        if params is None:
            self._no_task(task)
            return None
        body = _RuleBody(self._world, self._problems, heard.event if heard is not None else None)
        return read_args(body, keys, params, task) if heard is not None else None

    def _no_task(self, at: Scalar) -> None:
        if at.text in self._entries:
            what = f"'{at.text}' is a rule: a rule requests a task, never a rule, and never itself"
            self._problems.add("E131", at.mark, what, "name the task that does the work")
            return
        known = self._neighbours.names()
        own = self._neighbours.called(at.text)
        if own:
            what = f"'{at.text}' is another name of {own}, for callers from outside; did you mean '{own}'?"
            self._problems.add("E050", at.mark, what, f"write {own}", fix_word(at, own))
            return
        meant = nearest(at.text, known)
        told = (
            f"tasks: {quoted_list(known)}" if known and not meant else "its file stands in trees/ beside the site file"
        )
        what = f"no task is called '{shorten(at.text)}'{did_you_mean(at.text, known)}"
        self._problems.add("E050", at.mark, what, told, fix_word(at, meant))


class _RuleBody(Body):
    """What the arguments of a rule may read: `event`, `base`, `now`, `site`. There is no task yet."""

    def __init__(self, world: World, problems: Problems, event: Type | None) -> None:
        super().__init__(world, problems, lambda _: None)
        self._event = event

    def scope(self) -> Scope:
        names = {"event": self._event} if self._event is not None else {}
        types, site = self.world.catalogue.types, self.world.site
        return Scope(names, agent_types=types, site=site, built_ins=("base", "now", "site"))


def _said(node: Node) -> str:
    """Return what a node says, however it is laid out."""
    if isinstance(node, Listing):
        return f"[{', '.join(map(_said, node.items))}]"
    if isinstance(node, Mapping_):
        return f"{{{', '.join(sorted(f'{one.key.text}: {_said(one.value)}' for one in node.entries))}}}"
    return repr(node.text)
