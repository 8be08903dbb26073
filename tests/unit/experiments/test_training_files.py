"""What training reads and writes, without torch: sequences, the learning rate, the adapter's file, its card."""

from pathlib import Path

import pytest

from experiments.e2_llm.train.adapter import gguf_name
from experiments.e2_llm.train.bases import BASES, base_file
from experiments.e2_llm.train.batches import IGNORED, asked, sequence_of, sequences
from experiments.e2_llm.train.card import card_of
from experiments.e2_llm.train.fit import by_site, rate_at
from formiga_bt.llm.prompt import ask
from tests.golden import Wording

FACTS = {
    "base": "smollm2", "base_sha256": "b1", "data_sha256": "d1", "first_row": "{}", "steps": "9", "tokens": "900",
    "minutes": "1", "device": "cpu", "seed": "1", "rank": "8", "layers": "v_proj", "rate": "0.001",
    "held_out_before": "2.0", "held_out_loss": "1.0", "bytes": "1000",
}  # fmt: skip


def letters(text: str) -> list[int]:
    return [ord(one) for one in text]


def test_only_answers_are_learned() -> None:
    turns = [(asked("ask", "(drones: lwd)"), "ANSWER"), (asked("more", ""), "OTHER")]
    found = sequence_of(letters, "SYS", turns, 1000)

    assert found is not None
    learned = "".join(chr(one) for one in found.labels if one != IGNORED)
    assert learned == "ANSWER<|im_end|>OTHER<|im_end|>"
    shown = [one.text for one in ask("", "ask", note=lambda _request: "(drones: lwd)") if one.role == "user"]
    assert shown == [turns[0][0]]  # as the product shows it
    assert f"user\n{shown[0]}<|im_end|>" in "".join(map(chr, found.ids))


def test_every_request_is_shown_as_if_it_were_the_only_one() -> None:
    turns = [("ask", "ANSWER"), ("more", "OTHER ONE"), ("last", "END")]
    together = sequence_of(letters, "SYS", turns, 1000)
    assert together is not None

    for number, one in enumerate(turns, start=1):
        alone = sequence_of(letters, "SYS", [one], 1000)
        assert alone is not None
        mine = [index for index, turn in enumerate(together.turn) if turn in (0, number)]
        assert [together.ids[index] for index in mine] == alone.ids
        assert [together.labels[index] for index in mine] == alone.labels
        assert [together.places[index] for index in mine] == alone.places == list(range(len(alone.ids)))


def test_a_sequence_that_is_too_long_loses_its_last_turns() -> None:
    whole = sequence_of(letters, "SYS", [("ask", "ANSWER"), ("more", "OTHER")], 1000)
    assert whole is not None
    shorter = sequence_of(letters, "SYS", [("ask", "ANSWER"), ("more", "OTHER")], len(whole.ids) - 1)

    assert shorter is not None
    assert "".join(chr(one) for one in shorter.labels if one != IGNORED) == "ANSWER<|im_end|>"
    assert sequence_of(letters, "SYS", [("ask", "ANSWER")], 20) is None


def test_a_pass_has_every_pair_once_in_an_order_of_its_seed() -> None:
    data = [(f"SYS{i}", [(f"r{i}{j}", f"a{i}{j}") for j in range(7)]) for i in range(3)]
    one, same, other = (sequences(letters, data, most=9999, seed=seed, turns=5) for seed in (1, 1, 2))
    answers = sorted(part for found in one for part in "".join(map(chr, found.ids)).split("assistant\n")[1:])

    assert one == same
    assert one != other
    assert len(one) == 6
    assert len(answers) == 21


def test_the_rate_rises_falls_and_never_ends() -> None:
    rates = [rate_at(i / 100, 1.0) for i in range(101)]

    assert max(rates) == pytest.approx(1.0, abs=0.01)
    assert rates.index(max(rates)) == 4
    assert rates[4:] == sorted(rates[4:], reverse=True)
    assert rates[-1] == pytest.approx(0.05)


def test_held_out_pairs_are_not_among_those_that_are_learned(tmp_path: Path) -> None:
    file = tmp_path / "pairs.jsonl"
    rows = [
        '{"format": 1}', '{"site": 0, "system": "S"}', '{"request": "r", "note": "", "answer": "a", "held": false}',
        '{"site": 1, "system": "T"}', '{"request": "q", "note": "(drones: lwd)", "answer": "b", "held": true}',
    ]  # fmt: skip
    file.write_text("\n".join(rows), encoding="utf-8")

    assert by_site(file, held=False) == [("S", [("<request>r</request>", "a")])]
    assert by_site(file, held=True) == [("T", [("<request>q</request>\n(drones: lwd)", "b")])]


def test_layers_have_the_names_of_llama_cpp(wording: Wording) -> None:
    assert gguf_name("base_model.model.model.layers.3.mlp.up_proj") == "blk.3.ffn_up.weight"
    assert gguf_name("model.layers.12.self_attn.o_proj") == "blk.12.attn_output.weight"
    with pytest.raises(ValueError, match="lm_head") as refused:
        gguf_name("lm_head")
    wording(refused.value)


def test_llama_gets_no_adapter_where_gguf_permutes() -> None:
    assert not {"q_proj", "k_proj"} & set(BASES["smollm2"].layers)


def test_another_file_than_the_publishers_is_refused(tmp_path: Path, wording: Wording) -> None:
    file = tmp_path / "model.gguf"
    with pytest.raises(SystemExit) as refused:
        base_file(BASES["smollm2"], file)
    wording(refused.value)
    file.write_bytes(b"GGUF")
    with pytest.raises(SystemExit) as refused:
        base_file(BASES["smollm2"], file)
    wording(refused.value)


def test_a_card_says_what_was_not_measured(wording: Wording) -> None:
    bare = card_of(FACTS, {})
    measured = card_of(FACTS, {"base": {"valid": (1, 9)}, "tuned": {"valid": (8, 9), "seconds": 1.25}})

    wording(bare, measured)


@pytest.mark.external
def test_an_adapter_is_read_as_it_was_written(tmp_path: Path) -> None:
    pytest.importorskip("gguf")
    import numpy as np

    from experiments.e2_llm.train.adapter import Adapter, read_adapter, write_adapter

    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(4, 64)).astype(np.float16), rng.normal(size=(32, 4)).astype(np.float16)
    path = tmp_path / "adapter.gguf"
    size = write_adapter(path, Adapter("qwen2", 8.0, {"blk.0.ffn_up.weight": (a, b)}, {"seed": "1"}))
    found = read_adapter(path)

    assert size == path.stat().st_size
    assert (found.architecture, found.alpha, found.about) == ("qwen2", 8.0, {"seed": "1"})
    assert [np.array_equal(x, y) for x, y in zip(found.tensors["blk.0.ffn_up.weight"], (a, b), strict=True)] == [
        True,
        True,
    ]
