"""Scores a model, with and without its adapter, on the held-out pairs of a training file.

    python -m experiments.e2_llm.train.score --base smollm2 --adapter adapters/smollm2 --data pairs.jsonl --count 60

The model runs in llama.cpp as in `formiga draft --provider local`, with the same prompt and schema, one answer, no
repairs. Counted are: answers of the form; tree, question or refusal as it should be; trees that the checker takes; trees that
fly; trees that are the reference but for names of roles. The numbers go into the adapter's card. `--examples 3` shows three
others of the same site.
"""

import argparse
import json
import statistics
import sys
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from experiments.e2_llm.train.bases import BASES, base_file
from experiments.e2_llm.train.batches import asked
from experiments.e2_llm.train.card import card_of
from experiments.e2_llm.train.make import read_pairs
from experiments.e2_llm.train.pairs import Pair, renamed_problem, with_points_of
from experiments.e2_llm.train.renaming import verbs_renamed
from experiments.e2_llm.train.sites import Practice, practice
from formiga_bt.llm.envelope import ModelAnswer, NoAnswer, read_answer, schema_of
from formiga_bt.llm.judging.judge import judge
from formiga_bt.llm.records import Message
from formiga_bt.llm.vocabulary import offered
from formiga_bt.llm.words.wording import read, roles_of

MOST_TOKENS = 900


def without_role_names(tree: Any) -> Any:
    """Return a tree in the short form with roles called by their order, and without the task's name."""
    order = {str(one.get("name")): f"role {i}" for i, one in enumerate(tree.get("agents", ())) if isinstance(one, dict)}

    def of(value: Any, key: str = "") -> Any:
        if isinstance(value, dict):
            return {k: of(v, k) for k, v in value.items() if k != "task"}
        if isinstance(value, list):
            return [of(one, key) for one in value]
        if key in ("ask", "notify"):
            return "text"
        return order.get(value, value) if key in ("agent", "of", "name") else value

    return of(tree)


def kind_of(answer: Mapping[str, Any]) -> str:
    """Return what an answer is: tree, question or impossible."""
    return next(key for key in ("tree", "question", "impossible") if key in answer)


def marks_of(text: str, data: Any, pair: Pair, at: Practice) -> dict[str, bool | None]:
    """Return what one answer is worth; None = does not count.

    Args:
        text: of the model.
        data: the JSON value in it, if it was read already.
        pair: the request and its reference.
        at: the site.
    """
    due = json.loads(pair.answer)["answer"]
    wants_tree = "tree" in due
    found: dict[str, bool | None] = {"answers": False, "kind": False}
    found |= (
        {"valid": False, "flies": False, "exact": False}
        if wants_tree
        else {"valid": None, "flies": None, "exact": None}
    )
    try:
        given = read_answer(data, text)
    except NoAnswer:
        return found
    is_kind = "tree" if given.tree is not None else "question" if given.question else "impossible"
    found |= {"answers": True, "kind": is_kind == kind_of(due)}
    if not wants_tree or given.tree is None:
        return found
    tree = at.renaming.inverse().tree(given.tree)
    found["valid"] = not renamed_problem(tree, at, pair)
    found["exact"] = without_role_names(given.tree) == without_role_names(due["tree"])
    if found["valid"]:
        world = with_points_of(pair, at.flown)
        words = read(pair.request, world.site, world.catalogue)
        judged = judge(ModelAnswer(given.plan, tree=tree), words, world, at.verbs, "short")
        found["flies"] = judged.flight is not None and judged.flight.status == "SUCCEEDED" and not judged.errors
    return found


def messages_of(pair: Pair, system: str, others: Sequence[Pair]) -> list[Message]:
    """Return the prompt: the system part, other pairs of the site, the request."""
    found = [Message("system", system)]
    for one in others:
        found += [Message("user", asked(one.request, one.note)), Message("assistant", one.answer)]
    return [*found, Message("user", asked(pair.request, pair.note))]


def summed(rows: Sequence[Mapping[str, bool | None]], seconds: Sequence[float]) -> dict[str, Any]:
    """Return `key` -> (how many, of how many), and the median of the seconds."""
    counts: dict[str, list[int]] = defaultdict(lambda: [0, 0])
    for row in rows:
        for key, value in row.items():
            if value is not None:
                counts[key][0] += value
                counts[key][1] += 1
    return {**counts, "seconds": statistics.median(seconds) if seconds else 0.0}


def main(arguments: Sequence[str] | None = None) -> None:
    """Score base and adapter, and fill in the card."""
    given = _arguments(arguments)
    first, systems, pairs = read_pairs(given.data)
    held = [one for one in pairs if one.held]
    step = max(1, len(held) // given.count)
    chosen = held[::step][: given.count]
    file, digest = base_file(BASES[given.base], given.file)
    facts = json.loads((given.adapter / "facts.json").read_text(encoding="utf-8"))
    if facts["base_sha256"] != digest:
        raise SystemExit(f"{given.adapter} was made for another model: {facts['base']}")
    adapters = {"base": None, "tuned": next(iter(sorted(given.adapter.glob("*.gguf"))))}
    scores = {
        name: _scored(name, path, file, chosen, held, systems, int(first["seed"]), given)
        for name, path in adapters.items()
    }
    (given.adapter / "scores.json").write_text(json.dumps(scores, indent=1) + "\n", encoding="utf-8")
    (given.adapter / "README.md").write_text(card_of(facts, scores), encoding="utf-8")
    sys.stdout.write(json.dumps(scores, indent=1) + "\n")


def _scored(
    name: str,
    adapter: Path | None,
    file: Path,
    chosen: Sequence[Pair],
    held: Sequence[Pair],
    systems: Mapping[int, str],
    seed: int,
    given: argparse.Namespace,
) -> dict[str, Any]:
    from formiga_bt.llm.local import LocalChat
    from formiga_bt.llm.models import OnDisk, known

    about = known(given.base)
    assert about is not None
    on_disk = OnDisk(
        name=about.name,
        file=file,
        size=about.size,
        sha256=about.sha256,
        context=about.context,
        memory_mb=about.memory_mb,
    )
    rows, seconds = [], []
    sites: dict[int, Practice] = {}
    with LocalChat(on_disk, adapter=adapter) as chat:
        for number, pair in enumerate(chosen):
            at = sites.setdefault(pair.site, practice(pair.site, seed))
            same = pair.id.rsplit("/", 1)[0] + "/"
            others = [one for one in held if one.site == pair.site and not one.id.startswith(same)][: given.examples]
            messages = messages_of(pair, systems[pair.site], others)
            verbs = verbs_renamed(offered(at.verbs), at.renaming)
            roles = roles_of(read(pair.request, at.shown.site, at.shown.catalogue), at.shown.catalogue)
            schema = schema_of(at.shown, verbs, "short", typed=True, roles=roles)
            reply = chat.complete(messages, schema, max_tokens=MOST_TOKENS, temperature=0.0, seed=1)
            rows.append(marks_of(reply.text, reply.data, pair, at))
            seconds.append(reply.seconds)
            good = ", ".join(key for key, value in rows[-1].items() if value)
            sys.stderr.write(
                f"{name} {number + 1}/{len(chosen)} {pair.kind}: {good or 'nothing'} ({reply.seconds:.1f} s)\n"
            )
    return summed(rows, seconds)


def _arguments(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m experiments.e2_llm.train.score", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--base", choices=list(BASES), required=True)
    parser.add_argument("--adapter", type=Path, required=True, help="the folder that fit wrote")
    parser.add_argument("--data", type=Path, required=True, help="the training file, for its held-out pairs")
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--examples", type=int, default=0, help="other pairs of the same site in the prompt")
    parser.add_argument("--file", type=Path, help="the base's GGUF file; default: where formiga model fetch put it")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    main()
