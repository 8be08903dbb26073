"""Makes pairs: a mission of a practice, its wordings, and the proof that its tree is what the product would accept.

A mission is kept when its tree needs no mend, passes the checker, succeeds in a dry run, passes the checker again with all its
names changed, and is no near-duplicate of an evaluation's. A wording is kept when it is new, says no evaluation's words, and
the product's own comparison (English without slips: that is what it reads) finds nothing missing. Wide wordings are not
compared: a model shall understand more than that.
"""

import json
import random
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from msgspec import Struct

from experiments.e2_llm.train.kinds import (
    conditions,
    deciding,
    formations,
    refusals,
    relays,
    rounds,
    settling,
    single,
    teams,
)
from experiments.e2_llm.train.kinds.clauses import Draw
from experiments.e2_llm.train.kinds.missions import Mission
from experiments.e2_llm.train.leaks import Guard, leaked, shape
from experiments.e2_llm.train.phrases.cases import TOLD
from experiments.e2_llm.train.sites import Practice, practice
from experiments.e2_llm.train.speaker import Speaker
from formiga_bt.lang.json_form.reading import load_task_json
from formiga_bt.llm.envelope import ModelAnswer
from formiga_bt.llm.judging.compare import compare
from formiga_bt.llm.judging.judge import Judged, judge
from formiga_bt.llm.prompt import reading
from formiga_bt.llm.shaping.lifting import Lifter
from formiga_bt.llm.shaping.short import ShortError, expanded
from formiga_bt.llm.words.feasible import impossible
from formiga_bt.llm.words.points import RequestPoint, with_points
from formiga_bt.llm.words.wording import Words, read
from formiga_bt.llm.world import RequestWorld

MISSIONS: Final = 7
"""Of a practice."""
WORDINGS: Final = 2
"""Of a mission."""
HELD_EVERY: Final = 12
"""Each so-many-th practice is held out, and may use wordings that training never has."""
SPANISH: Final = 0.33
WIDE: Final = 0.6
"""Of the wordings."""
FETCH: Final = "FetchHome"
"""What the product makes of a way home that begins on the ground."""
KINDS: Final[tuple[tuple[Callable[[Draw], Mission], int], ...]] = (
    (single.single, 20),
    (teams.side_by_side, 9),
    (teams.at_one_place, 8),
    (formations.formation, 9),
    (formations.parting, 9),
    (teams.in_turn, 2),
    (teams.meet, 3),
    (conditions.yes_no, 3),
    (conditions.battery, 2),
    (conditions.again, 2),
    (conditions.escalate, 2),
    (conditions.refused, 2),
    (conditions.follow, 1),
    (deciding.only_if, 5),
    (deciding.either, 4),
    (deciding.second_if, 6),
    (deciding.told_before, 5),
    (conditions.both_agree, 2),
    (relays.does_same, 3),
    (relays.by_turns, 2),
    (relays.after_yes, 4),
    (settling.settle, 6),
    (settling.parked, 3),
    (rounds.stops, 3),
    (rounds.two_rounds, 1),
    (rounds.there_and_back, 1),
    (rounds.periodic, 2),
    (refusals.impossible, 7),
    (refusals.dangerous, 6),
    (refusals.unclear, 7),
)


class Pair(Struct, frozen=True, kw_only=True):
    """One request and the right answer."""

    id: str
    site: int
    """Number of the practice; the seed is in the file's first row."""
    kind: str
    language: str
    wide: bool = False
    """Said as people do whom the product's own reading of words need not understand."""
    held: bool
    request: str
    """As a model is shown it: coordinates have names."""
    points: dict[str, tuple[float, float]] = {}
    """Latitude and longitude, degrees, of those names."""
    note: str
    """What stands behind it: what the product reads in it for certain."""
    answer: str
    """As a model should write it, with the names of the shown world."""
    shape: str = ""
    """Kinds of steps; "" = no tree."""


@dataclass(slots=True)
class Made:
    """A practice and its pairs."""

    practice: Practice
    pairs: list[Pair]


class Maker:
    """Makes practices with their pairs.

    Args:
        seed: of all that is drawn.
        fly: whether every tree is flown.
    """

    def __init__(self, seed: int, *, fly: bool = True) -> None:
        self.seed, self._fly = seed, fly
        self.dropped: Counter[str] = Counter()
        """Why missions and wordings were left out."""
        self._guard: Guard | None = None
        self._requests: set[str] = set()

    def practices(self) -> Iterator[Made]:
        """Return practices for ever."""
        number = 0
        while True:
            yield self.made(number)
            number += 1

    def made(self, number: int) -> Made:
        """Return one practice with its pairs."""
        at = practice(number, self.seed)
        if self._guard is None:
            from formiga_bt.llm.world import world_of

            self._guard = Guard(world_of().catalogue)
        pairs: list[Pair] = []
        held = number % HELD_EVERY == HELD_EVERY - 1
        for index in range(MISSIONS):
            rng = random.Random(f"mission/{self.seed}/{number}/{index}")
            makers, weights = zip(*KINDS, strict=True)
            mission = rng.choices(makers, weights)[0](Draw(rng, at))
            judged = self._judged(mission, at)
            if judged is None and "tree" in mission.answer:
                continue
            for wording in range(WORDINGS):
                pair = self._worded(mission, judged, at, f"{number}/{index}/{wording}", held=held)
                if pair is not None:
                    pairs.append(pair)
        return Made(at, pairs)

    def _judged(self, mission: Mission, at: Practice) -> Judged | None:
        """Return what the product makes of the tree, or None if it is not fit to learn from."""
        tree = mission.answer.get("tree")
        if tree is None:
            return None
        words = read("", at.flown.site, at.flown.catalogue)
        made = expanded(tree, at.flown, at.verbs, Lifter(words, at.flown.site))
        assert self._guard is not None
        if made.added:
            self.dropped["put right by the product"] += 1
            return None
        if self._guard.is_near(made.data):
            self.dropped["near an evaluation's tree"] += 1
            return None
        judged = judge(ModelAnswer(mission.plan, tree=tree), words, at.flown, at.verbs, "short") if self._fly else None
        if judged is not None and (judged.errors or judged.mends):
            self.dropped[f"tree: {judged.shortfalls[0].code if judged.shortfalls else 'mended'}"] += 1
            return None
        problem = renamed_problem(tree, at)
        if problem:
            self.dropped[f"renamed tree: {problem}"] += 1
            return None
        return judged or Judged(None, "", (), ())

    def _worded(self, mission: Mission, judged: Judged | None, at: Practice, id_: str, *, held: bool) -> Pair | None:
        rng = random.Random(f"wording/{self.seed}/{id_}")
        speaker = Speaker(rng, "es" if rng.random() < SPANISH else "en", held=held, wide=rng.random() < WIDE)
        ids = [name for names in at.ids.values() for name in names]
        kinds = [one[0] for one in at.kinds.values()]
        request = speaker.finished(mission.say(speaker), [*mission.names, *ids, *kinds])
        why = self._wrong(request, mission, judged, at, speaker)
        if why:
            self.dropped[f"wording: {why}"] += 1
            return None
        self._requests.add(request.casefold())
        told = mission.answer if speaker.language == "en" else told_in_spanish(mission.answer)
        words = read(request, at.shown.site, at.shown.catalogue)
        answer = with_names({"plan": mission.plan, "answer": at.renaming.tree(told)}, words)
        return Pair(
            id=id_,
            site=at.number,
            kind=mission.kind,
            language=speaker.language,
            wide=speaker.wide,
            held=held,
            request=words.text,
            points={name: (one.lat, one.lng) for name, one in words.points.items()},
            note=reading(words, with_points(at.shown, words.points)),
            answer=json.dumps(answer, ensure_ascii=False),
            shape=shape({"steps": mission.answer["tree"]["steps"]}) if judged is not None else "",
        )

    def _wrong(self, request: str, mission: Mission, judged: Judged | None, at: Practice, speaker: Speaker) -> str:
        if request.casefold() in self._requests:
            return "twice"
        if leaked(request):
            return "an evaluation's words"
        if (
            judged is None
            or judged.task is None
            or judged.flight is None
            or speaker.language != "en"
            or speaker.has_slip
        ):
            return ""
        words = read(request, at.flown.site, at.flown.catalogue)
        named = {name: said for name, said in words.places.items() if name not in words.points}
        words = replace(words, places=named)  # the judged tree has coordinates, not the names of its points
        against = impossible(words, at.flown, at.verbs)
        if against is not None:
            return f"called impossible ({mission.kind})"
        if speaker.wide:
            return ""
        found = compare(words, judged.task, judged.yaml, judged.flight, at.flown)
        alarms = ("wrong_person",) if mission.kind == "escalate" else ()  # the dry run's first yes is enough
        return next((one.code for one in found if one.severity == "error" and one.code not in alarms), "")


def with_points_of(pair: Pair, world: RequestWorld) -> RequestWorld:
    """Return a world in which the names of a pair's coordinates are places."""
    return with_points(world, {name: RequestPoint(lat, lng, name) for name, (lat, lng) in pair.points.items()})


def with_names(data: Any, words: Words) -> Any:
    """Return an answer in which coordinates have the names that they have in the request as it is shown."""
    if isinstance(data, list):
        return [with_names(one, words) for one in data]
    if isinstance(data, dict):
        return {key: with_names(value, words) for key, value in data.items()}
    if not isinstance(data, str):
        return data
    for name, point in words.points.items():
        data = data.replace(f"{point.lat:.5f}, {point.lng:.5f}", name)
    return data


def told_in_spanish(data: Any) -> Any:
    """Return an answer with its messages as a request in Spanish has them: they are copied, not translated."""
    if isinstance(data, list):
        return [told_in_spanish(one) for one in data]
    if not isinstance(data, dict):
        return data
    spanish = dict(TOLD)
    return {
        key: spanish.get(value, value) if key == "notify" else told_in_spanish(value) for key, value in data.items()
    }


def renamed_problem(tree: Mapping[str, Any], at: Practice, pair: Pair | None = None) -> str:
    """Return what the checker has against a tree under its new names; "" = nothing.

    Args:
        tree: with the names of the flown world.
        at: the practice.
        pair: whose coordinates have names in the tree; None = they stand there as they are.
    """
    world = with_points_of(pair, at.shown) if pair is not None else at.shown
    lifter = Lifter(read("", world.site, world.catalogue), world.site)
    flown = with_points_of(pair, at.flown) if pair is not None else at.flown
    try:
        data = expanded(at.renaming.tree(tree), world, at.shown_verbs, lifter).data
        meant = expanded(tree, flown, at.verbs, Lifter(read("", flown.site, flown.catalogue), flown.site)).data
    except ShortError as error:
        return str(error)
    data = _fetched(data, meant, at.renaming.verbs.get(FETCH, FETCH))
    loaded = load_task_json(data, catalogue=world.catalogue, site=world.site, library=world.folders)
    wrong = [one for one in loaded.problems if one.diagnostic.severity == "error"]
    return f"{wrong[0].diagnostic.code} {wrong[0].message}" if wrong else ""


def _fetched(data: Any, meant: Any, fetch: str) -> Any:
    """Return a task whose ways home begin on the ground where they do in what is meant."""
    if isinstance(data, list) and len(data) == len(meant):  # imports may differ
        return [_fetched(one, other, fetch) for one, other in zip(data, meant, strict=True)]
    if not isinstance(data, dict):
        return data
    found = {key: _fetched(value, meant[key], fetch) if key in meant else value for key, value in data.items()}
    return found | {"call": fetch} if meant.get("call") == FETCH else found
