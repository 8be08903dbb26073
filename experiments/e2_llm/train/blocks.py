"""Attention of a sequence whose requests see the prompt and themselves only, without the work for what none of them sees.

With nine requests after one prompt (`batches`), a mask over the whole sequence costs about five times the products that are
needed.
"""

from typing import Any, Final

NAME: Final = "requests_beside_each_other"


class Blocks:
    """Where the prompt ends and where each request begins and ends, in the sequence that is being learned."""

    def __init__(self) -> None:
        self.spans: list[tuple[int, int]] = []
        """(begin, end) of the prompt, then of each request."""

    def of(self, turn: list[int]) -> None:
        """Take the spans of a sequence: `turn` is `batches.Example.turn`."""
        begins = [index for index, one in enumerate(turn) if index == 0 or one != turn[index - 1]]
        self.spans = list(zip(begins, [*begins[1:], len(turn)], strict=True))

    def attention(
        self, _module: Any, query: Any, key: Any, value: Any, *_mask: Any, scaling: float | None = None, **_: Any
    ) -> tuple[Any, None]:
        """Return attention as transformers' models ask for it; shapes (1, heads, tokens, width of a head).

        Returns:
            (1, tokens, heads, width of a head), and no weights.
        """
        import torch

        attend = torch.nn.functional.scaled_dot_product_attention
        shared = self.spans[0][1]
        found = []
        for begin, end in self.spans:
            keys, values = key[:, :, begin:end], value[:, :, begin:end]
            sees = None
            if begin:
                keys = torch.cat((key[:, :, :shared], keys), dim=2)
                values = torch.cat((value[:, :, :shared], values), dim=2)
                sees = torch.ones(end - begin, shared + end - begin, dtype=torch.bool, device=query.device).tril(shared)
            found.append(
                attend(query[:, :, begin:end], keys, values, sees, is_causal=not begin, scale=scaling, enable_gqa=True)
            )
        return torch.cat(found, dim=2).transpose(1, 2).contiguous(), None

    def install(self, model: Any) -> None:
        """Make a transformers model use it."""
        from transformers import AttentionInterface

        AttentionInterface.register(NAME, self.attention)
        model.set_attn_implementation(NAME)
