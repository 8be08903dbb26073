"""Questions of a task in the short form, as the request has them: to each who must agree, and when the machine is there.

A question to several people is answered by whoever is first. Where all must agree, a model asks all at once and looks at a
field that no answer has; and it asks before the flight that the request tells of first. Both are put right here, where it is
certain what is meant, and told.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from formiga_bt.llm.shaping.lifting import bare
from formiga_bt.llm.words.questions import AskedQuestion, Person
from formiga_bt.llm.world import RequestWorld

Step = Mapping[str, Any]
_LISTS: Final = ("steps", "then", "else", "parallel", "sequence")
_ROOT: Final = re.compile(r"(?<![\w.])[A-Za-z_]\w*")
_QUOTED: Final = re.compile(r"'[^']*'|\"[^\"]*\"")
_WORDS: Final = frozenset({"and", "all", "true", "True", "yes", "len", "count", "sum", "both"})
"""Names in a condition that stand for no answer."""
_NOT_YES: Final = re.compile(
    r"!|<|\b(?:not|no|or|any|some|either|none|neither|false|mixed)\b|_(?:no|any|or)\b|\|\|", re.IGNORECASE
)
_OF_GOING: Final = re.compile(r"\b(?:go|fly|start|take off|deliver|ir|volar|despegar)\b", re.IGNORECASE)
_LANDS: Final = ("FlyAndLand", "LandIn")


def as_asked(
    tree: Step, questions: Sequence[AskedQuestion], world: RequestWorld, added: list[str], *, height: str = ""
) -> Step:
    """Return a tree whose questions are put to whom the request names, and when it says.

    Args:
        tree: in the short form; it is not changed.
        questions: of the request.
        world: its people.
        added: is told what was put right.
        height: at which a machine hovers where the model has it land at once; "" = that is not put right.
    """
    for question in questions:
        tree = _each_agrees(tree, question, world, added)
    moments = [one for one in questions if one.after]
    return _asked_there(tree, moments[0], world, added, height) if len(moments) == 1 else tree


def _each_agrees(tree: Step, question: AskedQuestion, world: RequestWorld, added: list[str]) -> Step:
    """Return a tree in which each who must agree is asked, one after another."""
    roles = _roles(tree)
    asks = [(step, inside) for step, inside in _asks(tree) if _is_of(step, question.people, roles, world)]
    if not question.all or len(question.people) < 2 or len(asks) != 1:
        return tree
    ask, is_looped = asks[0]
    people = _people(ask)
    theirs = all(any(_means(name, one, roles, world) for one in question.people) for name in people)
    elsewhere = any(_is_of(step, question.people, roles, world) for step, _ in _asks(tree) if step is not ask)
    if is_looped or not theirs or elsewhere or ask.get("options") not in (None, [], ["yes", "no"]):
        return tree
    agents = [*_named_apart(tree.get("agents"), world)]
    roles = {str(one.get("name")): one for one in agents}
    names = [_name_of(one, roles) for one in question.people]
    saved = str(ask.get("save_as") or "")
    looks = [step for step in _all_steps(tree) if saved and step is not ask and _looks_at(step, saved)]
    changes: dict[int, list[Step]] = {}
    kept = {key: value for key, value in ask.items() if key not in ("save_as", "of")}
    plain: list[Step] = [{**kept, "of": [name]} for name in names]
    if not looks:
        changes[id(ask)] = plain
    else:
        if len(looks) != 1 or not _is_yes(looks[0].get("if"), saved):
            return tree
        look, behind = looks[0], _behind(tree, looks[0])
        if behind is None or _behind(tree, ask) is None or look not in (_behind(tree, ask) or ()):
            return tree
        then = look.get("then")
        if look.get("else") or behind or not isinstance(then, list):
            saves = [f"{saved}_{number}" for number in range(1, len(names) + 1)]
            changes[id(ask)] = [{**one, "save_as": name} for one, name in zip(plain, saves, strict=True)]
            changes[id(look)] = [{**look, "if": " and ".join(f"{name}.answer == 'yes'" for name in saves)}]
        else:
            changes[id(ask)], changes[id(look)] = plain, then
    who = " and ".join(one.id or f"a {one.type}" for one in question.people)
    added.append(f"{who} are asked one after the other and must each say yes, as the request says")
    changed: Step = {**_replaced(tree, changes), "agents": agents}
    return changed


def _asked_there(tree: Step, question: AskedQuestion, world: RequestWorld, added: list[str], height: str) -> Step:
    """Return a tree in which the flight that the request tells of first is in front of the question."""
    machines = [
        one
        for one in _listed(tree.get("agents"))
        if isinstance(one, dict) and not _is_human(str(one.get("type")), world)
    ]
    if len(machines) != 1 or machines[0].get("count") not in (None, 1):
        return tree
    for steps in _lists(tree):
        found = _there(steps, question, _roles(tree), world, height)
        if found is None:
            continue
        begun = [*_before(tree, steps), *steps[: found[0]]]
        if any(_place(one) in question.after for one in _flat(begun)):
            return tree
        places = " and ".join(question.after)
        added.append(f"{machines[0].get('name')} goes to {places} before anybody is asked, as the request says")
        changed: Step = _with_list(tree, steps, found[1])
        return changed
    return tree


def _there(
    steps: Sequence[Any], question: AskedQuestion, roles: Mapping[str, Step], world: RequestWorld, height: str
) -> tuple[int, list[Any]] | None:
    """Return where the questions of a list begin, and the list with the flight in front of them; None = not certain."""
    at = next((i for i, one in enumerate(steps) if _is_ask(one) and _is_of(one, question.people, roles, world)), None)
    if at is None:
        return None
    end = at
    while end < len(steps) and _is_ask(steps[end]) and _is_of(steps[end], question.people, roles, world):
        end += 1
    asks, rest = list(steps[at:end]), list(steps[end:])
    if not all(any(_is_of(ask, (one,), roles, world) for ask in asks) for one in question.people):
        return None
    saves = {str(one["save_as"]) for one in asks if one.get("save_as")}
    look = rest[0] if rest and isinstance(rest[0], dict) and "if" in rest[0] else None
    body = look.get("then") if look is not None else rest
    if not isinstance(body, list) or (look is not None and not _is_yes(look["if"], *saves)):
        return None
    front = _front(body, question)
    if not front and height and question.then == "land" and _place(body[0] if body else None) in question.after[-1:]:
        place, agent = question.after[-1], body[0].get("agent")  # it lands there at once
        body = [{"do": "FlyTo", "agent": agent, "to": place, "height": height}, *body]
        front = _front(body, question)
    asks = [_of_leaving(one, question) for one in asks]
    if not front:
        return None
    head = [*steps[:at], *body[:front]]
    if look is None:
        return (at, [*head, *asks, *body[front:]]) if front < len(body) else None
    other = look.get("else")
    if front < len(body):
        inner = {**look, "then": body[front:]}
        if isinstance(other, list) and other[:front] == body[:front]:
            inner["else"] = other[front:]
        return at, [*head, *asks, inner, *rest[1:]]
    if (
        question.then != "leave"
        or other
        or len(rest) < 2
        or any(_looks_at(one, s) for one in _flat(rest[1:]) for s in saves)
    ):
        return None
    return at, [*head, *({k: v for k, v in one.items() if k != "save_as"} for one in asks), *rest[1:]]


def _of_leaving(ask: Step, question: AskedQuestion) -> Step:
    """Return a question in words that fit the machine where it is: it no longer asks whether it may go there."""
    if _OF_GOING.search(str(ask["ask"])) is None:
        return ask
    return {**ask, "ask": "May the drone land?" if question.then == "land" else "May the drone leave?"}


def _front(body: Sequence[Any], question: AskedQuestion) -> int:
    """Return how many steps at the begin of a list are the flight that comes before the question; 0 = not certain."""
    count = 0
    reached = set()
    for step in body:
        place = _place(step)
        lands = isinstance(step, dict) and step.get("do") in _LANDS
        if place in question.after and not (lands and question.then == "land"):
            reached.add(place)
        elif not (reached and isinstance(step, dict) and set(step) == {"wait"}):
            break
        count += 1
    lands_next = count < len(body) and isinstance(body[count], dict) and body[count].get("do") in _LANDS
    return count if reached == set(question.after) and (question.then == "land") == lands_next else 0


def _named_apart(agents: Any, world: RequestWorld) -> Iterator[Step]:
    """Yield the roles; people of one name and several ids are called by these, for a name means one of them."""
    listed = [one for one in _listed(agents) if isinstance(one, dict)]
    for one in listed:
        ids = {str(other["id"]) for other in listed if other.get("id") and other.get("name") == one.get("name")}
        if len(ids) > 1 and one.get("id") and _is_human(str(one.get("type")), world):
            yield {**one, "name": str(one["id"])}
        else:
            yield one


def _name_of(person: Person, roles: Mapping[str, Step]) -> str:
    """Return what a person is called in the tree: by a role, else by the id or the type."""
    if person.id:
        return next((name for name, role in roles.items() if role.get("id") == person.id), person.id)
    return next((n for n, role in roles.items() if role.get("type") == person.type and not role.get("id")), person.type)


def _is_of(ask: Step, people: Sequence[Person], roles: Mapping[str, Step], world: RequestWorld) -> bool:
    return any(_means(name, one, roles, world) for name in _people(ask) for one in people)


def _means(name: str, person: Person, roles: Mapping[str, Step], world: RequestWorld) -> bool:
    """Return whether a name of `of` may mean a person: a role, an id, a type, a role of the site."""
    agents = world.site.agents
    role = roles.get(name)
    ids = [name] if name in agents else list(world.site.people.get(name, ()))
    if role is not None and name not in agents:
        ids = [str(role["id"])] if role.get("id") else []
    if person.id:
        return person.id in ids or (not ids and _type_of(name, role) == person.type)
    return _type_of(name, role) == person.type or any(one in agents and agents[one].type == person.type for one in ids)


def _type_of(name: str, role: Step | None) -> str:
    return str(role.get("type")) if role is not None else name.rstrip("s")


def _is_human(type_: str, world: RequestWorld) -> bool:
    known = world.catalogue.types.get(type_)
    return known is not None and known.human


def _is_yes(condition: Any, *saved: str) -> bool:
    """Return whether a condition means that these answers were yes, however the model wrote it."""
    if not isinstance(condition, str) or _NOT_YES.search(condition) is not None:
        return False
    roots = set(_ROOT.findall(_QUOTED.sub("''", condition))) - _WORDS
    return roots <= set(saved) if saved else len(roots) == 1 and ".answer" in condition


def _looks_at(step: Step, saved: str) -> bool:
    texts = [value for key, value in step.items() if key != "save_as" and isinstance(value, str)]
    return any(re.search(rf"\b{re.escape(saved)}\b", text) for text in texts)


def _roles(tree: Step) -> dict[str, Step]:
    return {str(one.get("name")): one for one in _listed(tree.get("agents")) if isinstance(one, dict)}


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _is_ask(step: Any) -> bool:
    return isinstance(step, dict) and "ask" in step


def _people(ask: Step) -> list[str]:
    of = ask.get("of")
    return [str(one) for one in of] if isinstance(of, list) else [str(of)] if of else []


def _place(step: Any) -> str:
    """Return where a step sends a machine, "" = nowhere."""
    if not isinstance(step, dict) or "do" not in step:
        return ""
    where = next((step[key] for key in ("to", "at") if isinstance(step.get(key), str)), "")
    return bare(where)


def _asks(tree: Step, *, looped: bool = False) -> Iterator[tuple[Step, bool]]:
    """Yield the questions below a node, and whether each is in a loop or beside something else."""
    for key in _LISTS:
        for one in tree[key] if isinstance(tree.get(key), list) else ():
            if isinstance(one, dict):
                inside = looped or key == "parallel" or "repeat" in one or "for" in one
                if "ask" in one:
                    yield one, inside
                yield from _asks(one, looped=inside)


def _all_steps(tree: Step) -> Iterator[Step]:
    for steps in _lists(tree):
        yield from (one for one in steps if isinstance(one, dict))


def _lists(tree: Step) -> Iterator[list[Any]]:
    """Yield the lists of steps that are done one after another, the outer ones first."""
    for key in _LISTS:
        listed = tree.get(key)
        if not isinstance(listed, list):
            continue
        if key != "parallel":
            yield listed
        for one in listed:
            if isinstance(one, dict):
                yield from _lists(one)


def _flat(steps: Sequence[Any]) -> Iterator[Step]:
    for one in steps:
        if isinstance(one, dict):
            yield one
            yield from _all_steps(one)


def _before(tree: Step, steps: Sequence[Any]) -> list[Any]:
    """Return the steps that are written before a list."""
    found: list[Any] = []
    for key in _LISTS:
        listed = tree.get(key)
        if listed is steps:
            return found
        for one in listed if isinstance(listed, list) else ():
            if isinstance(one, dict) and any(each is steps for each in _lists(one)):
                return [*found, *_before(one, steps)]
            found.append(one)
    return found


def _behind(tree: Step, step: Step) -> list[Any] | None:
    """Return the steps of its list that stand behind a step."""
    for steps in _lists(tree):
        for index, one in enumerate(steps):
            if one is step:
                return steps[index + 1 :]
    return None


def _replaced(node: Any, changes: Mapping[int, Sequence[Step]]) -> Any:
    """Return a copy of a tree with several steps in place of one; those to be replaced are known by `id`."""
    if not isinstance(node, dict):
        return node
    found = dict(node)
    for key in _LISTS:
        if isinstance(node.get(key), list):
            found[key] = [
                new
                for one in node[key]
                for new in ([_replaced(each, changes) for each in changes[id(one)]] if id(one) in changes else
                            [_replaced(one, changes)])
            ]  # fmt: skip
    return found


def _with_list(node: Any, old: Sequence[Any], new: Sequence[Any]) -> Any:
    """Return a copy of a tree with another list of steps in place of one."""
    if not isinstance(node, dict):
        return node
    return {
        key: list(new) if value is old else [_with_list(one, old, new) for one in value] if key in _LISTS and
        isinstance(value, list) else value
        for key, value in node.items()
    }  # fmt: skip
