"""How people say the parts of a mission, in English and Spanish: tables only.

A verb has its forms in brackets: English `[fly|flies]` (after `have a drone`, after `a drone`), Spanish `[vuela|vuele|volar]`
(a drone flies, that it fly, must fly). Blanks are filled by `speaker`. The last wording of a list of four or more is said only
in held-out pairs. None of these may repeat the wordings of an evaluation: `leaks` sees to it. `wide` has what very different
people say; the product's own reading of words need not understand that.
"""

Both = tuple[tuple[str, ...], ...]
"""Wordings in English and in Spanish; behind them wide ones in English and in Spanish, if there are (`speaker.widened`)."""
