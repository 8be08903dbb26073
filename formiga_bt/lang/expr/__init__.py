"""The compiler of expressions: what stands in `${...}`, in conditions, and in values of a known type.

`lang.expressions` is the door. A text passes `tokens` (columns, units, habits of other languages) and `checker` on `operands`
on `parts` (names, types, code by `operators`), with `typing_rules`, `calls` and `scope` beside them; `compiling` joins them.
`values` and `literals` read YAML values by the type that is due, `interpolation` texts with `${...}` in them. `helpers` is the
table of helpers; `shapes`, `region_shapes`, `daytime` and `members` are what they do. To add a helper, add a row there and a
line to `docs/reference.md`.
"""
