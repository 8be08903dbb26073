"""The model card of an adapter: what it was made of, how, and what it scores; `score` fills in the table."""

from collections.abc import Mapping
from typing import Any, Final

from formiga_bt.llm.models import known

COLUMNS: Final = (("base", "the base alone"), ("tuned", "with the adapter"))
ROWS: Final = (
    ("answers", "the answer is of the form"),
    ("kind", "tree, question or refusal as it should be"),
    ("valid", "the tree passes the checker"),
    ("flies", "the dry run succeeds"),
    ("exact", "the tree is the reference, name for name"),
    ("seconds", "seconds a request (median)"),
)


def card_of(facts: Mapping[str, str], scores: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the card as Markdown.

    Args:
        facts: what `fit` wrote down.
        scores: `base` and `tuned` -> row -> value, of `score`; {} = not measured yet.
    """
    about = known(facts["base"])
    assert about is not None
    lines = [
        f"# An adapter for missions in words: {about.title}",
        "",
        "A LoRA adapter that makes a small model write tasks for formiga_bt in the short form of `formiga draft`. It is of use",
        "with the prompt of this project only. It reads verbs, agent types and places there: it is bound to no catalogue.",
        "What it writes is a draft. The checker, a dry run and a person come before anything flies.",
        "",
        "| | |",
        "|---|---|",
        f"| base | {about.title}, Apache License 2.0, {about.source} |",
        f"| SHA-256 of the base | `{facts['base_sha256']}` |",
        "| licence | Apache License 2.0, as the base; the change is this adapter |",
        f"| data | `python -m experiments.e2_llm.train.make`: {facts['first_row']} |",
        f"| SHA-256 of the data | `{facts['data_sha256']}` |",
        f"| training | {facts['steps']} sequences, {int(facts['tokens']):,} tokens, {facts['minutes']} min "
        f"on {facts['device']}, seed {facts['seed']} |",
        *_start(facts),
        f"| LoRA | rank {facts['rank']} on {facts['layers']}; rate {facts['rate']}, cosine |",
        f"| held-out loss | {facts['held_out_before']} before, {facts['held_out_loss']} after |",
        f"| size | {int(facts['bytes']):,} bytes |",
        "",
        "No wording of an evaluation is in the data, and no tree near a reference of T6 to T10 (`train/leaks.py`).",
        "All data are generated; nobody's words are in them.",
        "",
        "## Scores",
        "",
        "Held-out requests of the generator: other sites, and wordings that training did not have.",
        "`python -m experiments.e2_llm.train.score` fills in this table.",
        "",
        "| | " + " | ".join(said for _, said in COLUMNS) + " |",
        "|---|" + "---|" * len(COLUMNS),
    ]
    for key, said in ROWS:
        lines.append(f"| {said} | " + " | ".join(_cell(scores.get(column, {}), key) for column, _ in COLUMNS) + " |")
    lines += ["", "Scores on T6 to T10 and on the second set are in docs/experiments.md, column `tuned`.", ""]
    return "\n".join(lines)


def _start(facts: Mapping[str, str]) -> list[str]:
    """Return the row that says which adapter training went on from, if it did."""
    if "started_from" not in facts:
        return []
    return [
        f"| went on from | an adapter with SHA-256 `{facts['started_from']}`: {facts['start_steps']} sequences of the data "
        f"with SHA-256 `{facts['start_data_sha256']}` |"
    ]


def _cell(scores: Mapping[str, Any], key: str) -> str:
    if key not in scores:
        return "not measured"
    value = scores[key]
    return f"{value:.1f}" if key == "seconds" else f"{value[0]} of {value[1]}"
