"""`draft`: from a request in words to a task that was checked and flown in virtual time; or a question, or why it cannot be.

    world = world_of(Path("site.yaml"))
    chat = open_chat("local")
    made = draft("A light drone looks at the camp from 30 m and comes home.", world, chat)
    if made.is_flyable:
        print(made.yaml)            # nothing has been started: a person approves

The loop: ask, read the answer, check, dry run, compare with the request; what is wrong goes back to the model, at most three
times. All rounds are kept.
"""

import threading
from collections.abc import Callable
from dataclasses import replace
from time import monotonic
from typing import Any, Final

from msgspec import Struct, json, structs

from formiga_bt.base.errors import UnusableFile
from formiga_bt.llm import prompt
from formiga_bt.llm.client import Chat
from formiga_bt.llm.edits.nearby import Near, nearest
from formiga_bt.llm.envelope import Form, ModelAnswer, NoAnswer, read_answer, schema_of, without_refusal
from formiga_bt.llm.errors import Cancelled, LlmError
from formiga_bt.llm.examples import examples_of, most_similar
from formiga_bt.llm.following import following
from formiga_bt.llm.judging.agreeing import are_at_odds, elected, is_settled
from formiga_bt.llm.judging.contradicted import contradicted
from formiga_bt.llm.judging.judge import Judged, judge
from formiga_bt.llm.judging.needless import is_reported
from formiga_bt.llm.records import Draft, Message, ModelReply, Round, Shortfall
from formiga_bt.llm.rounds import Try, at_odds, guarded, is_unreadable, missing, sound, unreadable, version_of
from formiga_bt.llm.vocabulary import offered, verbs_of
from formiga_bt.llm.words.beyond import beyond
from formiga_bt.llm.words.feasible import impossible
from formiga_bt.llm.words.gainsaid import is_flown, is_groundless
from formiga_bt.llm.words.known_words import goes_nowhere
from formiga_bt.llm.words.only_question import only_question, tree_of
from formiga_bt.llm.words.plain_words import plainly
from formiga_bt.llm.words.points import with_points
from formiga_bt.llm.words.wording import Words, read, roles_of, types_said
from formiga_bt.llm.world import RequestWorld

Progress = Callable[[str, int], None]
"""Is told what goes on (`asking`, `checking`) and how many tokens of an answer there are."""
RAISED: Final = 0.6
"""Temperature of a repair: at 0 a small model says the same again."""
GROUNDLESS: Final = "the model knows of nothing here that does this"
"""Said in place of a danger that the request does not speak of."""
TYPED: Final = ("local", "llamacpp")
"""Providers that hold a model to patterns of texts."""


class Options(Struct, frozen=True, kw_only=True):
    """How a draft is made."""

    form: Form = "short"
    """`full`: the whole language, for large models."""
    examples: int = 3
    rounds: int = 3
    """Most repairs."""
    candidates: int = 1
    """So many first answers are asked for, at most; of those that pass, the one that most of them mean is taken."""
    max_tokens: int = 1200
    temperature: float = 0.0
    seed: int | None = 1
    without: tuple[str, ...] = ()
    """Ids of examples that are not shown; measurements use it."""
    without_verbs: tuple[str, ...] = ()
    """Verbs that nobody uses here, neither the model nor what mends its tree; measurements use it."""
    compare: bool = True
    """Whether the task is compared with the words of the request."""


def draft(
    request: str,
    world: RequestWorld,
    chat: Chat,
    *,
    options: Options | None = None,
    previous: Draft | None = None,
    edit: tuple[str, str] | None = None,
    on_progress: Progress | None = None,
    cancel: threading.Event | None = None,
) -> Draft:
    """Write a task for a request. Nothing is started.

    Args:
        request: in words; at most 2,000 characters.
        world: the catalogue, the site and its fleet.
        chat: a model.
        options: see there.
        previous: the request changes this draft; see `following`.
        edit: (what it is for, JSON of the answer): the request changes this task; see `editing.as_answer`.
        on_progress: is told what goes on.
        cancel: set it from another thread to stop waiting for the model.

    Raises:
        UnusableFile: the request is empty or too long, or the draft before has a task with errors.
        LlmError: the model does not answer.
    """
    options, text = options or Options(), _bounded(request)
    if previous is not None and edit is None:
        after = following(previous, text, world, "full" if options.form == "full" else None)
        text, edit, options = _bounded(after.request), after.before, structs.replace(options, form=after.form)
    return _Drafting(text, world, chat, options, edit, on_progress, cancel).run()


def _bounded(request: str) -> str:
    text = prompt.as_data(request)
    if not text or len(request) > prompt.MOST_REQUEST:
        what = "is empty" if not text else f"has more than {prompt.MOST_REQUEST} characters"
        raise UnusableFile(f"the request {what}", help="say in a few sentences who shall do what, and where")
    return text


class _Drafting:
    def __init__(
        self,
        request: str,
        world: RequestWorld,
        chat: Chat,
        options: Options,
        edit: tuple[str, str] | None,
        on_progress: Progress | None,
        cancel: threading.Event | None,
    ) -> None:
        self._request, self._plain_world, self._chat, self._options = request, world, chat, options
        self._world = world
        self._before = self._shown_before = edit
        self._version = version_of(edit[1]) if edit is not None else ""
        self._progress: Progress = on_progress or (lambda _stage, _tokens: None)
        self._cancel = cancel
        hidden = options.without_verbs
        self._verbs = {name: verb for name, verb in verbs_of(world).items() if name not in hidden}
        bare = options.form == "full" or self._before is not None
        self._offered = self._verbs if bare else offered(self._verbs)
        self._words = read(request, world.site, world.catalogue)
        typed = chat.name in TYPED
        roles = roles_of(self._words, world.catalogue) if typed and self._before is None else ()
        self._schema = schema_of(world, self._offered, options.form, typed=typed, roles=roles)
        self._is_tuned = (
            getattr(chat, "prompt", "") == prompt.BRIEF and options.form == "short" and self._before is None
        )
        if hasattr(chat, "is_plain"):
            chat.is_plain = not self._is_tuned
        self._shown = self._words.text if options.form == "short" else request
        if options.form == "short":
            self._name_points()
        self._began = monotonic()
        self._rounds: list[Round] = []

    def run(self) -> Draft:
        against = impossible(self._words, self._world, self._verbs)
        if against is not None:
            return self._done("impossible", say=_sentences(against.why, against.instead))
        if self._before is None and goes_nowhere(self._words, self._world):
            return self._where("")
        asked = self._messages()
        best: tuple[ModelAnswer, Judged] | None = None
        messages, seen = asked, set[str]()
        for number in range(1 + self._options.rounds):
            tries = max(1, self._options.candidates) if number == 0 else 1
            answer, judged, reply = self._best_of(messages, tries, number)
            if answer is not None and answer.tree is None:
                return self._said(answer)
            if answer is not None and judged is not None:
                if best is None or judged.errors <= best[1].errors:
                    best = answer, judged
                if not judged.errors:
                    break
            problems = self._rounds[-1].shortfalls
            if reply.text in seen and number > 1:
                break
            seen.add(reply.text)
            errors = [one for one in problems if one.severity == "error"]
            tree, shown = answer.tree if answer is not None else None, self._rounds[-1].answer or reply.text
            plain = self._offered is not self._verbs and not self._options.without_verbs
            if self._is_tuned:  # it was trained on requests, not on talks about answers: it is asked again
                messages = asked
                continue
            fresh = plain and (number % 2 == 0 or not tree)
            messages = prompt.again(asked, errors) if fresh else prompt.repair(asked, shown, errors, tree)
        return self._judged(self._own(best))

    def _name_points(self) -> None:
        """Have the coordinates of this request, and of the one that it changes, under the same names everywhere."""
        every = self._all_words()
        self._world = with_points(self._world, every.points)
        if self._before is not None and every.points:
            lines, count = every.text.split("\n"), self._before[0].count("\n") + 1
            self._shown = "\n".join(lines[count:])
            self._shown_before = ("\n".join(lines[:count]), self._before[1])
            self._words = read(self._shown, self._world.site, self._world.catalogue)

    def _messages(self) -> list[Message]:
        world, options = self._world, self._options
        if self._is_tuned:
            system = prompt.brief_prompt(self._plain_world, self._offered)
            return prompt.ask(system, self._plainly(), note=self._note)
        system = prompt.system_prompt(self._plain_world, self._offered, options.form)
        chosen: list[Any] = []
        if options.examples and options.form == "short" and self._before is None:
            names = [*world.site.places, *world.site.regions]
            examples = examples_of(world, without=options.without)
            chosen = most_similar(self._words.text, examples, options.examples, names)
        if options.form == "full":
            return prompt.ask(system, self._request, chosen, previous=self._before)
        return prompt.ask(system, self._plainly(), chosen, previous=self._shown_before, note=self._note)

    def _plainly(self) -> str:
        """Return the request as a model is shown it: in the words of the vocabulary."""
        words, regions = self._words, self._world.site.regions
        names = [said for name, said in (*words.places.items(), *words.agents.items()) if name not in regions]
        return plainly(self._shown, [said for name, said in words.places.items() if name in regions], names)

    def _note(self, request: str) -> str:
        """Return what a request names for certain."""
        site = self._world.site
        return prompt.reading(read(request, site, self._world.catalogue), self._world)

    def _best_of(
        self, messages: list[Message], tries: int, number: int
    ) -> tuple[ModelAnswer | None, Judged | None, ModelReply]:
        """Ask, once or several times, and return the answer that is taken; its round is the last one."""
        found: list[Try] = []
        good: list[Try] = []
        lost: list[Shortfall] = []
        for attempt in range(tries):
            first = number == 0 and attempt == 0
            temperature = self._options.temperature if first else max(RAISED, self._options.temperature)
            seed = None if self._options.seed is None else self._options.seed + 100 * number + attempt
            try:
                answer, judged, reply, one = self._ask(messages, temperature, seed)
            except LlmError as error:
                if not good or isinstance(error, Cancelled):
                    raise
                lost = [missing(attempt, tries, error)]  # what came before it passed, and stays
                break
            self._rounds.append(one)
            errors = judged.errors if judged is not None else 0 if answer is not None else 1000
            found.append(Try(errors, answer, judged, reply, one))
            if errors == 0:
                good.append(found[-1])
            if is_settled([one.means for one in good], tries - 1 - attempt) and good:
                break
        chosen = good[elected([one.means for one in good])] if good else min(found, key=lambda one: one.errors)
        if self._rounds[-1] is not chosen.round:
            self._rounds.remove(chosen.round)
            self._rounds.append(chosen.round)
        judged = chosen.judged
        told = [*lost, *([at_odds(len(good))] if are_at_odds([one.means for one in good]) else [])]
        if judged is not None and told:
            judged = replace(judged, shortfalls=(*judged.shortfalls, *told))
            self._rounds[-1] = structs.replace(chosen.round, shortfalls=judged.shortfalls)
        return chosen.answer, judged, chosen.reply

    def _ask(
        self, messages: list[Message], temperature: float, seed: int | None
    ) -> tuple[ModelAnswer | None, Judged | None, ModelReply, Round]:
        self._progress("asking", 0)
        reply = self._chat.complete(
            messages,
            self._schema,
            max_tokens=self._options.max_tokens,
            temperature=temperature,
            seed=seed,
            on_progress=lambda tokens: self._progress("asking", tokens),
            cancel=self._cancel,
        )
        reply = sound(reply)
        said = tuple(messages)

        def without(code: str, text: str, help_: str = "") -> tuple[None, None, ModelReply, Round]:
            return None, None, reply, Round(messages=said, reply=reply, shortfalls=(Shortfall(code, text, help=help_),))

        if reply.finish == "length":
            return without("too_long", "the answer was cut off, for it is too long", "write a shorter tree")
        try:
            answer = read_answer(reply.data, reply.text)
        except NoAnswer as error:
            return without("no_answer", str(error))
        if answer.tree is None:
            wrong = contradicted(answer, self._world, self._all_words())
            if wrong:
                told = is_reported(self._words, self._world)
                if told or (answer.impossible and is_flown(self._words, self._world)):
                    self._schema = without_refusal(self._schema, may_ask=not told)
                return without("contradicted", wrong)
            return answer, None, reply, Round(messages=said, reply=reply)
        self._progress("checking", reply.usage.completion)
        judged = self._judge(answer)
        edited = ""
        if judged.errors and self._options.form == "short" and self._before is None:
            near = self._nearest(answer, judged)
            if near is not None and near.told:
                answer, judged = near.answer, near.judged
                edited = json.encode({"plan": answer.plan, "answer": {"tree": answer.tree}}).decode()
        one = Round(
            messages=said,
            reply=reply,
            yaml=judged.yaml,
            shortfalls=judged.shortfalls,
            flight=judged.flight,
            mends=judged.mends,
            answer=edited,
        )
        return answer, judged, reply, one

    def _judge(self, answer: ModelAnswer, edited: tuple[str, ...] = ()) -> Judged:
        if self._version and self._options.form == "short":
            answer = replace(answer, tree={**(answer.tree or {}), "version": self._version})
        return guarded(
            lambda: judge(
                answer,
                self._all_words(),
                self._world,
                self._verbs,
                self._options.form,
                credit=f"{self._chat.name} {self._chat.model}".strip(),
                compared=self._words if self._options.compare else None,
                is_change=self._before is not None,
                edited=edited,
            ),
            lambda error: unreadable(error, edited),
        )

    def _nearest(self, answer: ModelAnswer, judged: Judged) -> Near | None:
        """Return the nearest tree, edited or not; None: what cannot be read cannot be edited."""
        if is_unreadable(judged):
            return None
        verbs = self._verbs
        return guarded(
            lambda: nearest(answer, judged, self._words, self._world, verbs, self._judge), lambda _error: None
        )

    def _all_words(self) -> Words:
        """Return the words of the request, and of the one that it changes: values come from both."""
        if self._before is None:
            return self._words
        return read(f"{self._before[0]}\n{self._request}", self._plain_world.site, self._plain_world.catalogue)

    def _said(self, answer: ModelAnswer) -> Draft:
        if answer.question:
            return self._done("question", plan=answer.plan, say=answer.question)
        why = GROUNDLESS if is_groundless(answer.impossible, self._words, self._world) else answer.impossible
        return self._done("impossible", plan=answer.plan, say=_sentences(why, answer.instead))

    def _own(self, best: tuple[ModelAnswer, Judged] | None) -> tuple[ModelAnswer, Judged] | None:
        """Return the best answer, or if none passes and only a question is wanted, the task of that question."""
        is_new = self._options.form == "short" and self._before is None
        only = only_question(self._words, self._world) if is_new else None
        if only is None or (best is not None and not best[1].errors):
            return best
        answer = ModelAnswer("", tree=tree_of(only))
        who = " and ".join(one.id or f"a {one.type}" for one in only.people)
        judged = self._judge(
            answer, (f"the question of the request is put to {who}, and no more: no answer of the model did that",)
        )
        if judged.errors:
            return best
        text = json.encode({"plan": "", "answer": {"tree": answer.tree}}).decode()
        self._rounds.append(
            Round(
                messages=(),
                reply=ModelReply(text=text),
                yaml=judged.yaml,
                shortfalls=judged.shortfalls,
                flight=judged.flight,
                mends=judged.mends,
                answer=text,
            )
        )
        return answer, judged

    def _judged(self, best: tuple[ModelAnswer, Judged] | None) -> Draft:
        names_nothing = not (self._words.places or self._words.agents or self._words.amounts) and self._before is None
        if best is None and names_nothing and self._rounds and self._rounds[-1].shortfalls[0].code == "contradicted":
            return self._where("")
        if best is None:
            problem = self._rounds[-1].shortfalls[0].text if self._rounds and self._rounds[-1].shortfalls else ""
            return self._done("failed", say=_sentences("the model gave no usable answer: " + problem))
        answer, judged = best
        flies = judged.task is not None and not judged.errors
        if not flies and names_nothing:
            return self._where(answer.plan)
        against = None if flies else beyond(self._rounds, self._words.text, self._world)
        if against is not None:
            return self._done("impossible", plan=answer.plan, say=_sentences(against.why, against.instead))
        say = ""
        if not flies:
            wrong = list(dict.fromkeys(one.text for one in judged.shortfalls if one.severity == "error"))
            say = "no answer of the model passed. What is wrong with the best one: " + "; ".join(wrong[:4])
        return structs.replace(
            self._done("task" if flies else "failed", plan=answer.plan, say=say),
            task=judged.task.name if judged.task is not None else "",
            yaml=judged.yaml,
            values=judged.values,
            flight=judged.flight,
            shortfalls=judged.shortfalls,
        )

    def _where(self, plan: str) -> Draft:
        """Ask back: the request names no place, and perhaps no machine."""
        site = self._world.site
        words = self._words
        who = words.agents or words.counts or types_said(words, self._world.catalogue)
        names = ", ".join(["base", *site.places, *site.regions][:12])
        return self._done(
            "question", plan=plan, say=f"{'Where to' if who else 'Who shall go where'}? Places of this site: {names}."
        )

    def _done(self, kind: Any, *, plan: str = "", say: str = "") -> Draft:
        request = self._request if self._before is None else f"{self._before[0]}\n{self._request}"
        return Draft(
            request=request,
            kind=kind,
            plan=plan,
            say=say,
            rounds=tuple(self._rounds),
            provider=self._chat.name,
            model=self._chat.model,
            seconds=round(monotonic() - self._began, 2),
        )


def _sentences(*texts: str) -> str:
    parts = [text.strip().rstrip(".") for text in texts if text.strip()]
    said = parts[0] + "." if parts else ""
    return f"{said} Possible instead: {parts[1]}." if len(parts) > 1 else said
