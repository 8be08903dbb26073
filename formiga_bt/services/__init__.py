"""The engine as a service: HTTP API, its read-only view of the engine, and what `formiga up` keeps running.

`host` is everything of one running engine: site folder, driver, desk, view, API. `orders` is what callers may order: it
speaks to the driver's inbox, never to the engine. `view` is a copy of the engine's state, folded from its steps in a thread of
its own; all answers come from it, and `feed` numbers what happens. `why` explains a task in plain words. `api`, `door` and
`server` are the HTTP around them.
"""
