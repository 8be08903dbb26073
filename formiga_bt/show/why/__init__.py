"""Why a task waits, is held, chose its agents, failed; why a machine does what it does: a chain of causes in plain words.

`front.explain` is the front, `text.in_words` prints what it returns. Everything here is a pure function over an `EngineState`
and the models of the tasks, so that a running engine, a dry run and a stored history are explained alike.
"""
