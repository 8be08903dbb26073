"""The task language: YAML files to a checked, typed model. `loader` is the door, `model` is what comes out.

A file passes `document` (nodes with marks), `files` (imports), `params`, `roles` and `steps` (the model, with `expressions` for
every value and condition), then `checks` (what only the whole task shows). Where things are:

    expr      the compiler of expressions; its door is `expressions`
    model     the frozen records of a checked task, of the catalogue and of a site
    steps     reading of steps, one module for each family of kinds
    checks    static checks of a whole task; its docstring says how to add one
    site      site files; `envelope`, `ground`, `fence` and `far` beside it
    scenario  scenario files, for tests and dry runs

Beside them, flat: the tables `kinds`, `synonyms` and `types`; `reading` (keys and words of nodes); `body`, `flow`, `world` and
`written` (names while steps are read); `formatting` and `mending` (`formiga fmt`, `formiga fix`); `llm_in`, `llm_out` (JSON).
"""
