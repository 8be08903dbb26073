"""Why a task waits, is held, chose its agents, failed; why a machine does what it does: a chain of causes in plain words.

`explain` is the front. Everything here is a pure function over an `EngineState` and the models of the tasks, so that a running
engine, a dry run and a stored history are explained alike.
"""

from formiga_bt.show.why.front import as_text, explain, in_words
from formiga_bt.show.why.scene import Scene

__all__ = ["Scene", "as_text", "explain", "in_words"]
