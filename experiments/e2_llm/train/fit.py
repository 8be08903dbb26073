"""Tunes a small model on this machine's processor and writes an adapter.

    python -m experiments.e2_llm.train.fit --base smollm2 --data pairs.jsonl --minutes 90 --out adapters/smollm2

With `--start-from ADAPTER` it goes on from an adapter that is there already, as with data that were made later.
It runs in an environment of its own (`requirements.txt`); no model hub is asked for anything. A run that was interrupted goes
on from its last checkpoint when it is started again. The learning rate follows the time that was given, so that the run ends
when the minutes are over, wherever in the data it is then.
"""

import argparse
import hashlib
import json
import math
import random
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from experiments.e2_llm.train.adapter import MOST_BYTES, Adapter, gguf_name, read_adapter, write_adapter
from experiments.e2_llm.train.bases import BASES, Base, base_file
from experiments.e2_llm.train.batches import IGNORED, Example, asked, sequences
from experiments.e2_llm.train.blocks import Blocks
from experiments.e2_llm.train.card import card_of
from formiga_bt.llm.prompt import BRIEF

CHECKPOINT_S: Final = 600.0
WARM: Final = 0.04
"""Of the whole run the learning rate rises."""
LEAST_RATE: Final = 0.05
"""Share of the learning rate at the end."""
CLIP: Final = 1.0
OTHERS: Final = 8000
"""Tokens that the data do not have, among which the right one is to be found all the same."""


def by_site(path: Path, *, held: bool) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return system prompt and pairs of each site of a training file: of those held out, or of the others."""
    found: list[tuple[str, list[tuple[str, str]]]] = []
    for line in path.read_text(encoding="utf-8").splitlines():
        row = json.loads(line)
        if "system" in row:
            found.append((row["system"], []))
        elif "request" in row and row["held"] == held:
            found[-1][1].append((asked(row["request"], row["note"]), row["answer"]))
    return [one for one in found if one[1]]


def rate_at(done: float, top: float) -> float:
    """Return the learning rate when so much of the run (0 to 1) is done: a short rise, then a cosine."""
    if done < WARM:
        return top * (done / WARM * 0.95 + 0.05)
    fall = 0.5 * (1 + math.cos(math.pi * min(1.0, (done - WARM) / (1 - WARM))))
    return top * (LEAST_RATE + (1 - LEAST_RATE) * fall)


class Run:
    """One training run.

    Args:
        base: which model.
        file: of its weights.
        given: the command line.
    """

    def __init__(self, base: Base, file: Path, given: argparse.Namespace) -> None:
        import torch
        from peft import LoraConfig, get_peft_model
        from transformers import AutoModelForCausalLM, AutoTokenizer, GgufConfig
        from transformers.utils import logging

        self.torch, self.base, self.given = torch, base, given
        torch.manual_seed(given.seed)
        logging.disable_progress_bar()
        plain = GgufConfig(dequantize=True)
        if given.threads:
            torch.set_num_threads(given.threads)
        self.tokenizer: Any = AutoTokenizer.from_pretrained(str(file.parent), gguf_file=file.name)
        model: Any = AutoModelForCausalLM.from_pretrained(
            str(file.parent), gguf_file=file.name, dtype=torch.bfloat16, quantization_config=plain
        )
        rank = given.rank or base.rank
        self.rate = given.rate or base.rate
        self.alpha = 2.0 * rank
        config = LoraConfig(r=rank, lora_alpha=self.alpha, lora_dropout=0.0, target_modules=list(base.layers))
        self.model: Any = get_peft_model(model, config).to(given.device)
        self.model.train()
        self.blocks = Blocks()
        self.blocks.install(self.model.get_base_model())
        self.weights = {name: one for name, one in self.model.named_parameters() if one.requires_grad}
        for one in self.weights.values():
            one.data = one.data.float()
        self.optimizer = torch.optim.AdamW(
            list(self.weights.values()), lr=base.rate, betas=(0.9, 0.98), weight_decay=0.0
        )
        self.steps, self.spent_s, self.tokens = 0, 0.0, 0
        self.losses: list[float] = []
        self.before = float("nan")
        """Held-out loss of the base alone."""

    def start_from(self, adapter: Adapter) -> None:
        """Take the matrices of an adapter for a start.

        Raises:
            SystemExit: it is of another model, rank or alpha.
        """
        if adapter.architecture != self.base.architecture or adapter.alpha != self.alpha:
            raise SystemExit(
                "the adapter to start from is of another model or rank\n  help: give its --rank, or leave it out"
            )
        for name, one in self.weights.items():
            layer, half = _layer_of(name)
            found = adapter.tensors[layer][half == "lora_B"]
            if tuple(found.shape) != tuple(one.shape):
                raise SystemExit(f"{layer} has {found.shape} in the adapter to start from, {tuple(one.shape)} here")
            one.data.copy_(self.torch.from_numpy(found.astype("float32")))

    def learn_words(self, examples: Sequence[Example]) -> None:
        """Take the tokens that the data have; see `tell_apart`."""
        torch = self.torch
        self.whole = self.model.get_base_model().lm_head.weight.detach()
        self.seen = torch.tensor(sorted({token for one in examples for token in one.ids}), device=self.whole.device)
        self.seen_rows = self.whole[self.seen]
        self.tell_apart("held")

    def tell_apart(self, lot: object) -> None:
        """Take the tokens among which the next one is chosen: those of the data, and as many of all others by lot.

        The whole vocabulary of 150,000 would take a fourth of the time. Each step draws others, so that none is left out for
        good: a token that is never among them is never learned to be wrong.
        """
        torch = self.torch
        others = random.Random(f"{self.given.seed}/{lot}").sample(range(self.whole.shape[0]), OTHERS)
        drawn = torch.tensor(sorted(others), device=self.whole.device)
        drawn = drawn[~torch.isin(drawn, self.seen)]
        kept = torch.cat([self.seen, drawn])
        self.head = torch.cat([self.seen_rows, self.whole[drawn]])
        self.index = torch.full((self.whole.shape[0],), -1, device=self.whole.device)
        self.index[kept] = torch.arange(len(kept), device=self.whole.device)

    def encode(self, text: str) -> list[int]:
        """Return the tokens of a text; marks of the chat form are single tokens."""
        found: list[int] = self.tokenizer(text, add_special_tokens=False)["input_ids"]
        return found

    def loss_of(self, example: Example) -> Any:
        """Return the mean loss over the tokens that are learned; other positions get no logits.

        A token sees those before it of the prompt and of its own request (`Example.turn`).
        """
        torch = self.torch
        ids, places, labels = (
            torch.tensor(one, device=self.given.device) for one in (example.ids, example.places, example.labels[1:])
        )
        self.blocks.of(example.turn)
        with torch.autocast(self.given.device, dtype=torch.bfloat16):
            inner = self.model.get_base_model()
            hidden = inner.model(input_ids=ids[None], position_ids=places[None], use_cache=False).last_hidden_state[
                0, :-1
            ]
            at = labels != IGNORED
            logits = torch.nn.functional.linear(hidden[at], self.head)
        return torch.nn.functional.cross_entropy(logits.float(), self.index[labels[at]])

    def step(self, example: Example, done: float) -> float:
        """Learn from one sequence; return its loss."""
        torch = self.torch
        rate = rate_at(done, self.rate)
        self.tell_apart(self.steps)
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        loss = self.loss_of(example)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(list(self.weights.values()), CLIP)
        self.optimizer.step()
        self.optimizer.zero_grad(set_to_none=True)
        return float(loss.detach())

    def held_loss(self, held: Sequence[Example]) -> float:
        """Return the mean loss of sequences that are not learned."""
        self.tell_apart("held")
        with self.torch.no_grad():
            values = [float(self.loss_of(one)) for one in held]
        return sum(values) / len(values) if values else float("nan")

    def save(self, path: Path) -> None:
        """Write a checkpoint; the old one stays until the new one is whole."""
        state = {
            "weights": {name: one.data for name, one in self.weights.items()},
            "optimizer": self.optimizer.state_dict(),
            "steps": self.steps,
            "spent_s": self.spent_s,
            "tokens": self.tokens,
            "losses": self.losses,
            "before": self.before,
        }
        partial = path.with_suffix(".partial")
        self.torch.save(state, partial)
        partial.rename(path)

    def load(self, path: Path) -> None:
        """Go on from a checkpoint."""
        state = self.torch.load(path, map_location=self.given.device, weights_only=True)
        for name, one in self.weights.items():
            one.data.copy_(state["weights"][name])
        self.optimizer.load_state_dict(state["optimizer"])
        self.steps, self.spent_s, self.tokens = state["steps"], state["spent_s"], state["tokens"]
        self.losses, self.before = list(state["losses"]), state["before"]

    def tensors(self) -> dict[str, tuple[Any, Any]]:
        """Return the adapter's matrices by their GGUF names."""
        found: dict[str, dict[str, Any]] = {}
        for name, one in self.weights.items():
            layer, half = _layer_of(name)
            found.setdefault(layer, {})[half] = one.detach().float().cpu().numpy()
        return {name: (two["lora_A"], two["lora_B"]) for name, two in found.items()}


def _layer_of(weight: str) -> tuple[str, str]:
    """Return the GGUF name of the layer that a weight belongs to, and which half it is: `lora_A` or `lora_B`."""
    layer, _, half = weight.replace(".default.weight", "").rpartition(".")
    return gguf_name(layer), half


def main(arguments: Sequence[str] | None = None) -> None:
    """Train, and write adapter and card."""
    given = _arguments(arguments)
    base = BASES[given.base]
    file, digest = base_file(base, given.file)
    given.out.mkdir(parents=True, exist_ok=True)
    data_digest = hashlib.sha256(given.data.read_bytes()).hexdigest()
    run = Run(base, file, given)
    learn = sequences(run.encode, by_site(given.data, held=False), most=base.most_tokens, seed=given.seed)
    held = sequences(run.encode, by_site(given.data, held=True), most=base.most_tokens, seed=given.seed)[: given.held]
    if not learn:
        raise SystemExit(f"{given.data} has nothing to learn")
    run.learn_words([*learn, *held])
    started: dict[str, str] = {}
    if given.start_from is not None:
        first = read_adapter(given.start_from)
        run.start_from(first)
        digest_of = hashlib.sha256(given.start_from.read_bytes()).hexdigest()
        started = {"started_from": digest_of} | {f"start_{key}": first.about[key] for key in ("data_sha256", "steps")}
    checkpoint = given.out / f"checkpoint-{data_digest[:12]}.pt"
    if checkpoint.is_file():
        run.load(checkpoint)
        _say(f"goes on after {run.steps} steps, {run.spent_s / 60:.0f} min")
    if not run.steps:
        run.before = run.held_loss(held)
    before = run.before
    size = sum(one.numel() for one in run.weights.values())
    _say(f"{len(learn)} sequences, {len(held)} held out; {size / 1e6:.2f} M weights; held-out loss {before:.3f}")
    _train(run, learn, checkpoint)
    after = run.held_loss(held)
    path = given.out / f"{base.name}-formiga.gguf"
    about = {
        "prompt": BRIEF,
        "base_sha256": digest,
        "data_sha256": data_digest,
        "seed": str(given.seed),
        "steps": str(run.steps),
        "held_out_loss": f"{after:.4f}",
    }
    about |= started
    written = write_adapter(path, Adapter(base.architecture, run.alpha, run.tensors(), about))
    facts = about | {
        "base": base.name,
        "data": given.data.name,
        "minutes": f"{run.spent_s / 60:.0f}",
        "tokens": str(run.tokens),
        "rank": str(given.rank or base.rank),
        "layers": ", ".join(base.layers),
        "rate": str(run.rate),
        "bytes": str(written),
        "held_out_before": f"{before:.4f}",
        "device": given.device,
        "first_row": given.data.open(encoding="utf-8").readline().strip(),
    }
    (given.out / "facts.json").write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
    (given.out / "README.md").write_text(card_of(facts, {}), encoding="utf-8")
    _say(
        f"{path}: {written:,} bytes; held-out loss {before:.3f} -> {after:.3f}; {run.steps} steps, {run.spent_s / 60:.1f} min"
    )
    if written > MOST_BYTES:
        raise SystemExit(f"the adapter is larger than {MOST_BYTES:,} bytes; take a smaller --rank")


def _train(run: Run, learn: list[Example], checkpoint: Path) -> None:
    """Learn until the time, or the number of steps, is over. What was learned from is not repeated before all else was."""
    given = run.given
    whole_s = given.minutes * 60.0
    order = list(range(len(learn)))
    last, saved = time.monotonic(), run.spent_s
    while run.spent_s < whole_s and not (given.steps and run.steps >= given.steps):
        turn, index = divmod(run.steps, len(learn))
        random.Random(f"{given.seed}/{turn}").shuffle(order := sorted(order))
        done = run.steps / given.steps if given.steps else run.spent_s / whole_s
        example = learn[order[index]]
        run.losses = [*run.losses[-49:], run.step(example, done)]
        now = time.monotonic()
        run.spent_s, last = run.spent_s + now - last, now
        run.steps, run.tokens = run.steps + 1, run.tokens + len(example.ids)
        mean = sum(run.losses) / len(run.losses)
        left = (given.steps - run.steps) * run.spent_s / run.steps if given.steps else whole_s - run.spent_s
        if run.steps % given.every == 0:
            _say(
                f"step {run.steps}, pass {run.steps / len(learn):.2f}: loss {mean:.4f}; "
                f"{run.spent_s / run.steps:.2f} s a step, {run.tokens / run.spent_s:.0f} tokens/s, {left / 60:.0f} min left"
            )
        if run.spent_s - saved >= CHECKPOINT_S:
            run.save(checkpoint)
            saved, last = run.spent_s, time.monotonic()
    run.save(checkpoint)


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def _arguments(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m experiments.e2_llm.train.fit", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--base", choices=list(BASES), required=True)
    parser.add_argument("--data", type=Path, required=True, help="of experiments.e2_llm.train.make")
    parser.add_argument("--out", type=Path, required=True, help="a folder")
    parser.add_argument("--minutes", type=float, default=90.0, help="so long it learns; default 90")
    parser.add_argument("--steps", type=int, default=0, help="or so many sequences")
    parser.add_argument("--file", type=Path, help="the base's GGUF file; default: where formiga model fetch put it")
    parser.add_argument("--start-from", type=Path, help="an adapter (.gguf) of the same base and rank to go on from")
    parser.add_argument("--rate", type=float, default=0.0, help="learning rate at its height; default: the base's")
    parser.add_argument("--rank", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--held", type=int, default=24, help="sequences for the held-out loss")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--device", choices=["cpu", "cuda"], default="cpu")
    parser.add_argument("--every", type=int, default=10, help="a line every so many steps")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    main()
