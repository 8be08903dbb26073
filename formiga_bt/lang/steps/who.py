"""Whom a step addresses: a role or agent param of the body, one that the task holds, an action that it has."""

import re
from collections.abc import Mapping
from typing import Final

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.body import Body
from formiga_bt.lang.model import ActionSpec, Who
from formiga_bt.lang.naming import action_that, comes_down
from formiga_bt.lang.shipped import actions_help
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.text.reading import fix_word
from formiga_bt.lang.text.synonyms import action_for, is_sure, nearest

_NOT_HELD: Final = "it may be looked at and asked; to command one, declare a role under agents:"
_NAMED_ONLY: Final = "declare a role under agents: with id: ${%s}, and command that"
ROLE_ACTION: Final = re.compile(r"([A-Za-z]\w*)\.([A-Za-z]\w*)")
_COMPUTED: Final = re.compile(r"(?:\$\{ *)?(?:\w+\()?(\w+) *[\[,)].*\.([A-Za-z]\w*)(?: *\})?")
"""An agent that is computed, as no step names one: `trail[0].GoTo`, `first(crew).GoTo`."""


def named_first(text: str, such: str) -> str:
    """Return what helps who wrote a text where `role.Action` is due; `such` is an example of that."""
    found = _COMPUTED.fullmatch(text)
    if found is None:
        return f"such as: {such}"
    each = f"for: {{one: ${{{found[1]}}}}} with do: one.{found[2]}"
    return f"who is commanded has a name: a role of its own, or each of a list, {each}"


def read_who(body: Body, name: str, at: Scalar, mark: Mark) -> Who | None:
    """Return the role or agent param `name`, which stands at the start of `at`; report E020 or E024 otherwise."""
    if name in body.agents:
        body.used.add(name)
        if name in body.lists:
            number = f"{body.lists[name]} " if body.lists[name] else ""
            what = f"'{name}' is a list of {number}agents; use for:"
            body.problems.add("E024", mark, what, f"for: {{one: ${{{name}}}}}")
            return None
        return Who(name, body.agent(at, name), site_role=False, mark=mark)
    body.unknown_agent(mark, name)
    body.used.add(name)
    return None


def read_held(body: Body, name: str, at: Scalar, mark: Mark, *, people: bool = True) -> Who | None:
    """Return an agent that a step commands; report E023 for one that the task does not hold. `people` are not commanded."""
    named = body.names.get(name)
    types = body.world.catalogue.types
    human = people and all(of in types and types[of].human for of in body.agents.get(name, ()))
    if named is not None and named.type.is_foreign and not (human and body.agents.get(name)):
        body.used.add(name)
        whence, help_ = origin_of(body, name)
        body.problems.add("E023", mark, f"'{name}' {whence}: this task does not hold it", help_)
        return None
    return read_who(body, name, at, mark)


def origin_of(body: Body, name: str) -> tuple[str, str]:
    """Return in words where an agent comes from that the task does not hold, and how to mend that."""
    of = next(iter(body.items.get(name, ())), name)
    named = body.names.get(of)
    if named is None or named.origin != "param":
        return "comes from fleet()", _NOT_HELD
    if named.type.name == "list":
        return f"is one of the parameter '{of}'" if of != name else "is a parameter", _NOT_HELD
    return "is a parameter", _NAMED_ONLY % of


def find_action(body: Body, role: str, word: str, mark: Mark, *, known: bool) -> ActionSpec | None:
    """Return the action that every agent type of a role has; report E021 or E087 otherwise. `known`: the role is one."""
    catalogue = body.world.catalogue
    types = [catalogue.types[name] for name in body.agents.get(role, ()) if name in catalogue.types]
    for agent_type in types:
        if word not in agent_type.actions:
            have = {name: _meaning(catalogue.actions[name]) for name in agent_type.actions if name in catalogue.actions}
            have = {name: meaning for name, meaning in have.items() if not catalogue.actions[name].cuts}
            _no_action(body, f"{agent_type.name} has no action '{word}'", word, mark, have)
            return None
    spec = catalogue.actions.get(word)
    if spec is None and (known or role in body.agents):
        have = {name: _meaning(action) for name, action in catalogue.actions.items() if not action.cuts}
        _no_action(body, f"no agent has an action '{word}'", word, mark, have)
    if spec is not None and spec.cuts:
        what = f"{word} stops the motors, also in the air: only a person orders it, never a task"
        landing = action_that(comes_down, body.agents.get(role, ()), catalogue)
        other = f"land with {landing}; a person has" if landing else "a person has"
        body.problems.add("E087", mark, what, f"{other}: formiga cut AGENT")
        return None
    return spec


def _meaning(action: ActionSpec) -> str:
    return action.effect or ("moves" if action.moves_to else "")


def _no_action(body: Body, what: str, word: str, mark: Mark, have: Mapping[str, str]) -> None:
    meant = action_for(word, have)
    guess = f"; did you mean '{meant}'?" if meant else ""
    sure = nearest(word, have) != meant or is_sure(word, meant, have)
    at = Scalar(word, mark)
    help_ = actions_help(at, have, elsewhere=word not in body.world.catalogue.actions)
    body.problems.add("E021", mark, what + guess, help_, fix_word(at, meant) if sure else None)


def site_role_names(body: Body) -> tuple[str, ...]:
    """Return the roles that the site gives to people; `watchers` is always one."""
    people = body.world.site.people if body.world.site is not None else {}
    return tuple(dict.fromkeys(("watchers", *people)))
