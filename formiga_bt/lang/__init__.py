"""The task language: YAML files to a checked, typed model (`loader` is the door, `model` is what comes out).

A file passes `document` (nodes with marks), `files` (imports), `params`, `roles` and `steps` (the model, with
`expressions` for every value and condition), then `checks` and `flight` (what only the whole task shows).
"""
