"""What a person approves before a task may fly in `mode: real`: the digest of all that decides what it does, and who must.

Pure functions. Called by the engine at each request and grant (`engine.tasks.authority`), and by whoever shows a person what
they are about to approve (`formiga approve`, the API).
"""

import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from formiga_bt.base.errors import TaskError
from formiga_bt.lang.model import ActionSpec, Call, Catalogue, Do, Expr, Site, Step, Task
from formiga_bt.lang.site.keys import APPROVERS
from formiga_bt.lang.walk import all_roles, bare, children

TYPED: Final = 8
"""So many characters of the digest a person types."""

RULES: Final = "rules"
"""What the standing rules of a site are called where a task is named; no task has such a name."""

_NAMED: Final = re.compile(r"([A-Za-z_]\w*)((?:\[-?\d{1,4}\])?(?:\.home)?)")
_RECOVER: Final = "the way home"

Names = Mapping[str, str]
"""Names inside a called subtree -> what they are in the task: `drone`, `drone.home`."""


def approval_digest(task: Task, site: Site) -> str:
    """Return the SHA-256 (hex) over what an approval of a task covers, of the task and of its site (`lang.covered`).

    It changes with the task's file and its imports, with the types and actions that the task and its machines' ways home use,
    and with the site but for its people, agents and wires: any such change voids the approval.
    """
    digest = hashlib.sha256(b"formiga approval 2\n")
    for part in (task.covered, site.covered):
        digest.update(f"{len(part)}:{part}\n".encode())
    return digest.hexdigest()


def rules_digest(site: Site) -> str:
    """Return the SHA-256 (hex) over the standing rules of a site, and what of the site an approval covers: its regions, too."""
    digest = hashlib.sha256(b"formiga approval of rules 1\n")
    for part in (site.rules_digest, site.covered):
        digest.update(f"{len(part)}:{part}\n".encode())
    return digest.hexdigest()


def check_approver(site: Site, by: str) -> None:
    """Refuse the word of somebody who is no approver of a site.

    Raises:
        TaskError: `not_approver`.
    """
    approvers = site.people.get(APPROVERS, ())
    if by not in approvers:
        known = ", ".join(approvers) or "nobody: name people in site.yaml under people: approvers"
        raise TaskError("not_approver", f"{by or 'somebody'} is no approver of {site.name}; it has {known}")


def needs_another(task: Task, catalogue: Catalogue, *, by_program: bool = False) -> bool:
    """Return whether another person than the requester must have approved a task.

    Args:
        task: the task.
        catalogue: what its actions do.
        by_program: a program wrote it, such as a language model.
    """
    return by_program or bool(lands_away(task, catalogue))


def same_person(one: str, other: str) -> bool:
    """Return whether two names may be one person: case and the machine after an `@` do not tell people apart."""
    return _who(one) == _who(other)


def others_than(known: Iterable[str], approvers: Iterable[str]) -> tuple[str, ...]:
    """Return the approvers who are none of these people."""
    people = list(known)
    return tuple(one for one in approvers if not any(same_person(one, other) for other in people))


def _who(name: str) -> str:
    return name.partition("@")[0].strip().casefold()


def lands_away(task: Task, catalogue: Catalogue) -> tuple[str, ...]:
    """Return the steps of a task that land, or may land, elsewhere than at the machine's own `home`; each with its place.

    Conservative: only a landing that names the `home` of the very machine, itself or through the arguments of a call, is one
    at home. Cleanup sections count, and so does the way home of each type that the task may be granted.
    """
    found: list[str] = []
    for steps in (task.steps, task.on_failure, task.on_abort, task.finally_):
        found += _away(steps, {}, "", catalogue)
    types = {t for role in all_roles(task) for t in role.types}
    for kind in catalogue.types.values():
        recover = kind.recover
        if recover is not None and (kind.name in types or types & set(kind.extends)):
            found += [f"{_RECOVER} of {kind.name}: {text}" for text in _away(recover.steps, {}, "", catalogue)]
    return tuple(dict.fromkeys(found))


def _away(steps: tuple[Step, ...], names: Names, scope: str, catalogue: Catalogue) -> Iterator[str]:
    for step in steps:
        if isinstance(step, Do):
            spec = catalogue.actions.get(step.action)
            if spec is not None and _lands(spec) and not _at_home(step, spec, names, scope):
                yield f"{step.who.name}.{step.action}{_where(step, spec, names)} ({step.mark.file}:{step.mark.line})"
        elif isinstance(step, Call):
            inner = {param: _canonical(arg, names, scope) for param, arg in step.args.items()}
            yield from _away(step.subtree.steps, inner, f"{scope}{step.seg}/", catalogue)
        else:
            yield from _away(children(step), names, scope, catalogue)


def _lands(spec: ActionSpec) -> bool:
    return spec.lands or spec.effect == "grounded"


def _at_home(step: Do, spec: ActionSpec, names: Names, scope: str) -> bool:
    place = step.fields.get(spec.moves_to) if spec.moves_to else None
    if place is None:
        return False  # it lands where it is
    default = spec.fields[spec.moves_to].default
    if default is not None and place == default:
        return bare(place) == "agent.home"  # in a default, `agent` is the machine that gets the goal
    who = _canonical(step.who.agent, names, scope) if step.who.agent is not None else ""
    return bool(who) and _canonical(place, names, scope) == f"{who}.home"


def _canonical(expr: Expr, names: Names, scope: str) -> str:
    """Return what an agent, or its home, is called in the task; "" for anything else."""
    found = _NAMED.fullmatch(bare(expr))
    if found is None:
        return ""
    name, rest = found.groups()
    outer = names.get(name)
    if outer is None:
        return f"{scope}{name}{rest}"  # of this body: a role, or the name of a loop
    return f"{outer}{rest}" if outer else ""


def _where(step: Do, spec: ActionSpec, names: Names) -> str:
    place = step.fields.get(spec.moves_to) if spec.moves_to else None
    return f" at {_canonical(place, names, '') or bare(place)}" if place is not None else ""
