"""Reading of steps: from the nodes of a list of steps to their part of the model. `step` is the door.

`step` finds the kind of each step, hands its keys to the module of that kind, and reads the modifiers (`when`, `timeout`,
`retry`, ...), which every kind may have. What is visible, saved or certain at a step is kept by `lang.body` and `lang.flow`.
A new kind needs a row in `lang.kinds`, a class in `lang.model`, and a reader in the table at the end of `step`.
"""
