"""Writes and reads a LoRA adapter as a GGUF file that llama.cpp loads; needs `gguf` and `numpy`, no torch."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

NAMES: Final[Mapping[str, str]] = {
    "self_attn.q_proj": "attn_q",
    "self_attn.k_proj": "attn_k",
    "self_attn.v_proj": "attn_v",
    "self_attn.o_proj": "attn_output",
    "mlp.gate_proj": "ffn_gate",
    "mlp.up_proj": "ffn_up",
    "mlp.down_proj": "ffn_down",
}
"""Names of layers in torch and in GGUF; those of q and k are permuted for the architecture `llama`: leave them out there."""
MOST_BYTES: Final = 16_000_000
Tensors = Mapping[str, tuple[Any, Any]]
"""`blk.N.ffn_up.weight` -> (A: rank x in, B: out x rank)."""


@dataclass(frozen=True, slots=True)
class Adapter:
    """An adapter as it lies in a file."""

    architecture: str
    alpha: float
    tensors: dict[str, tuple[Any, Any]]
    about: dict[str, str] = field(default_factory=dict)


def gguf_name(torch_name: str) -> str:
    """Return the GGUF name of a layer: `...layers.3.mlp.up_proj` is `blk.3.ffn_up.weight`."""
    _, _, rest = torch_name.partition("layers.")
    number, _, layer = rest.partition(".")
    if not number.isdecimal() or layer not in NAMES:
        raise ValueError(f"no layer for an adapter: {torch_name}")
    return f"blk.{number}.{NAMES[layer]}.weight"


def write_adapter(path: Path, adapter: Adapter) -> int:
    """Write an adapter in half precision; return how many bytes it has."""
    import gguf

    partial = path.with_suffix(".partial")
    writer = gguf.GGUFWriter(str(partial), adapter.architecture)
    writer.add_type("adapter")
    writer.add_string("adapter.type", "lora")
    writer.add_float32("adapter.lora.alpha", adapter.alpha)
    for key, value in adapter.about.items():
        writer.add_string(f"formiga.{key}", value)
    for name in sorted(adapter.tensors):
        a, b = adapter.tensors[name]
        writer.add_tensor(f"{name}.lora_a", np.ascontiguousarray(a, dtype=np.float16))
        writer.add_tensor(f"{name}.lora_b", np.ascontiguousarray(b, dtype=np.float16))
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.write_tensors_to_file()
    writer.close()
    partial.rename(path)
    return path.stat().st_size


def read_adapter(path: Path) -> Adapter:
    """Read an adapter.

    Raises:
        ValueError: the file is no LoRA adapter.
    """
    import gguf

    reader = gguf.GGUFReader(str(path))
    texts = {name: one.contents() for name, one in reader.fields.items()}
    if texts.get("adapter.type") != "lora":
        raise ValueError(f"{path} is no LoRA adapter")
    halves: dict[str, dict[str, Any]] = {}
    for one in reader.tensors:
        name, _, half = str(one.name).rpartition(".")
        halves.setdefault(name, {})[half] = np.array(one.data)
    return Adapter(
        architecture=str(texts["general.architecture"]),
        alpha=float(texts["adapter.lora.alpha"]),
        tensors={name: (two["lora_a"], two["lora_b"]) for name, two in halves.items()},
        about={
            name.removeprefix("formiga."): str(value) for name, value in texts.items() if name.startswith("formiga.")
        },
    )
