"""A state as a restarted engine finds it: written and read by the journal's codec."""

from typing import Final

from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.journal.codec import Codec

CODEC: Final = Codec({}, 0)


def written(state: EngineState) -> bytes:
    """Return a state as the bytes of a snapshot."""
    return CODEC.encode_state(state)


def loaded(data: bytes) -> EngineState:
    """Return the state that these bytes hold."""
    return CODEC.decode_state(data)


def reloaded(state: EngineState) -> EngineState:
    """Return a state that went through the bytes of a snapshot."""
    return loaded(written(state))
