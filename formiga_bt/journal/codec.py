"""A step, or the whole state, as bytes; and back exactly as it was.

    | 1 byte format | 1 byte dictionary, 0 = not compressed | 4 bytes CRC-32 of the rest | msgpack |

The codec knows no record by name: it reads the types of the structs. What stands in fields of type `Any` says itself what it
is, so that tuples stay tuples and places stay places. Names of fields repeat in every step: each is compressed with a
dictionary of them, which is kept in the journal, so that a later version with other fields reads what this one wrote.
"""

import types
import typing
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from itertools import islice
from operator import is_
from typing import Any, Final

import msgspec
from msgspec import Struct
from msgspec.msgpack import Ext
from msgspec.structs import replace

from formiga_bt.base.errors import JournalError
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.types import AgentRef
from formiga_bt.nodes.run import Failure
from formiga_bt.transport.messages import AgentStatus

FORMAT: Final = 5
"""Raised with each change of the records that a step or a state holds: what another number wrote is not read."""
PLAIN: Final = 0
HEADER: Final = 6
LEVEL: Final = 3
"""Of compression: beyond it a step takes half as long again for a tenth less room."""
TUPLE, STRUCT, BIG = 1, 2, 3
"""Codes of msgpack extensions: a tuple, a struct with its kind, an integer beyond 64 bits."""
KINDS: Final[dict[str, type[Struct]]] = {
    "place": Place, "position": Position, "region": Region, "agent": AgentRef, "failure": Failure,
}  # fmt: skip
"""Structs that may stand in a field of type `Any`. Names are never given another meaning."""
_NAMES: Final = {kind: name for name, kind in KINDS.items()}
_STRUCT: Final = msgspec.msgpack.Decoder(tuple[str, msgspec.Raw])
_SMALLEST, _LARGEST = -(2**63), 2**64 - 1
_AS_THEY_ARE: Final = frozenset((bool, str, float, bytes))

Lower = Callable[[Any], Any]
SLICE: Final = 32
"""Entries of a table that are encoded at once."""


# -- values of type Any ------------------------------------------------------------------------------------------------
def _pack(value: Any) -> Any:
    """Return a value of unknown type so that its bytes say what it is."""
    if value is None or type(value) in _AS_THEY_ARE:
        return value
    if isinstance(value, int):
        return value if _SMALLEST <= value <= _LARGEST else Ext(BIG, str(value).encode())
    if isinstance(value, dict):
        return {key: _pack(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_pack(item) for item in value]
    if isinstance(value, tuple):
        return Ext(TUPLE, _ENCODER.encode([_pack(item) for item in value]))
    name = _NAMES.get(type(value))
    assert name is not None, f"a value of type {type(value).__name__} cannot be kept: {value!r}"
    return Ext(STRUCT, _ENCODER.encode((name, _lowered(value))))


def _unpack(code: int, data: memoryview) -> Any:
    if code == TUPLE:
        return tuple(_ANY.decode(data))
    if code == STRUCT:
        name, raw = _STRUCT.decode(data)
        return msgspec.msgpack.decode(raw, type=KINDS[name], ext_hook=_unpack)
    if code == BIG:
        return int(bytes(data))
    raise ValueError(f"unknown extension {code}")


_ENCODER: Final = msgspec.msgpack.Encoder()
_ANY: Final = msgspec.msgpack.Decoder(ext_hook=_unpack)


# -- structs: which of their fields hold values of type Any -------------------------------------------------------------
class _Plans:
    """Struct -> its fields that hold such values, each with what makes it ready; made when first asked for."""

    def __init__(self) -> None:
        self.made: dict[type, tuple[tuple[str, Lower], ...]] = {}

    def of(self, kind: type) -> tuple[tuple[str, Lower], ...]:
        """Return the fields of a struct to look at."""
        plan = self.made.get(kind)
        if plan is None:
            hints = _hints(kind)
            plan = tuple((n, lower) for n in kind.__struct_fields__ if (lower := _lower(hints[n])) is not None)  # type: ignore[attr-defined]
            self.made[kind] = plan
        return plan


_PLANS: Final = _Plans()


@cache
def _hints(kind: type) -> Mapping[str, Any]:
    """Return the types of a struct's fields; to resolve them takes far longer than to look at them."""
    return typing.get_type_hints(kind)


def _holds_any(kind: Any, seen: set[Any]) -> bool:
    if kind is Any:
        return True
    if isinstance(kind, type) and issubclass(kind, Struct):
        if kind in seen:
            return False
        seen.add(kind)
        return any(_holds_any(one, seen) for one in _hints(kind).values())
    return any(_holds_any(one, seen) for one in typing.get_args(kind))


def _lower(kind: Any) -> Lower | None:
    """Return what makes a value of a type ready, or None where nothing need be done."""
    if not _holds_any(kind, set()):
        return None
    if kind is Any:
        return _pack
    if isinstance(kind, type) and issubclass(kind, Struct):
        return _lowered
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Union or origin is types.UnionType:
        return _union([lower for one in args if (lower := _lower(one)) is not None])
    inner = _lower(args[-1] if origin is dict else args[0])
    assert inner is not None, f"no way to keep values of {kind}"
    if origin is dict:
        return lambda value: {key: inner(item) for key, item in value.items()}

    def items(values: Any) -> Any:
        made = [inner(item) for item in values]
        return (
            values if all(map(is_, made, values)) else made
        )  # the type says whether it comes back as a list or a tuple

    return items


def _union(others: list[Lower]) -> Lower:
    plain = next((one for one in others if one is not _lowered), None)
    if plain is None:
        return _lowered_if_struct

    def lower(value: Any) -> Any:
        if isinstance(value, Struct):
            return _lowered(value)
        return value if value is None else plain(value)

    return lower


def _lowered_if_struct(value: Any) -> Any:
    return _lowered(value) if isinstance(value, Struct) else value


def _lowered(value: Struct) -> Struct:
    plan = _PLANS.made.get(type(value))
    if plan is None:
        plan = _PLANS.of(type(value))
    if not plan:
        return value
    changed = {}
    for name, lower in plan:
        old = getattr(value, name)
        if lower is _pack or old:
            new = lower(old)
            if new is not old:
                changed[name] = new
    return replace(value, **changed) if changed else value


# -- the dictionary ----------------------------------------------------------------------------------------------------
def _structs(kind: Any, seen: dict[type[Struct], None]) -> None:
    if isinstance(kind, type) and issubclass(kind, Struct) and kind not in seen:
        seen[kind] = None
        for one in _hints(kind).values():
            _structs(one, seen)
    for one in typing.get_args(kind):
        _structs(one, seen)


def _words_of(kind: type[Struct]) -> Iterator[bytes]:
    config = kind.__struct_config__
    if config.tag is not None:
        yield _ENCODER.encode(config.tag_field) + _ENCODER.encode(config.tag)
    for field in msgspec.structs.fields(kind):
        default = b""
        if field.default is not msgspec.NODEFAULT and isinstance(field.default, str | int | float | bool | None):
            default = _ENCODER.encode(field.default)
        yield _ENCODER.encode(field.encode_name) + default


@cache
def dictionary() -> bytes:
    """Return the names that steps of this version repeat, the most usual last: for the first steps of a journal."""
    seen: dict[type[Struct], None] = {}
    _structs(EngineStep, seen)
    often = (GoalRecord, AgentStatus, AgentRecord)
    kinds: list[type[Struct]] = [*(one for one in seen if one not in often), *often]
    return b"".join(word for kind in kinds for word in _words_of(kind))[-32_000:]


def learned(steps: Sequence[EngineStep]) -> bytes:
    """Return a better dictionary from steps of a site: one of each shape, the most usual last."""
    shapes: dict[tuple[str, ...], list[EngineStep]] = {}
    for step in steps:
        shape = (type(step.input).__name__, *(type(change).__name__ for change in step.changes))
        shapes.setdefault(shape, []).append(step)
    usual = sorted(shapes.values(), key=len)
    return b"".join(_ENCODER.encode(_lowered(group[-1])) for group in usual)[-24_000:]


# -- the whole state, in slices -----------------------------------------------------------------------------------------
def _sliced(state: EngineState, pause: Callable[[], None]) -> Iterator[bytes]:
    """Return the bytes that the encoder would make of the state, slice by slice."""
    lower = dict(_PLANS.of(EngineState))
    names = EngineState.__struct_fields__
    yield _map_head(len(names))
    for name in names:
        value, ready = getattr(state, name), lower.get(name, _as_it_is)
        yield _ENCODER.encode(name)
        if not isinstance(value, dict):
            yield _ENCODER.encode(ready(value))
            continue
        yield _map_head(len(value))
        items = iter(value.items())
        while part := dict(islice(items, SLICE)):
            yield _ENCODER.encode(ready(part))[len(_map_head(len(part))) :]
            pause()


def _map_head(count: int) -> bytes:
    if count < 16:
        return bytes((0x80 | count,))
    return b"\xde" + count.to_bytes(2, "big") if count < 65_536 else b"\xdf" + count.to_bytes(4, "big")


def _as_it_is(value: Any) -> Any:
    return value


def _go_on() -> None:
    """Nobody waits."""


class _Light(EngineState):
    """A state whose explanations are passed over: of thousands of ended tasks they are most of a snapshot."""

    explanations: msgspec.Raw = msgspec.Raw(b"\x80")  # type: ignore[assignment]


# -- the codec ---------------------------------------------------------------------------------------------------------
class Codec:
    """Encodes with one dictionary, decodes with all that a journal has.

    Args:
        dictionaries: by number, from 1.
        current: the one to encode with; 0 = none.
    """

    def __init__(self, dictionaries: Mapping[int, bytes], current: int) -> None:
        self._dictionaries = dict(dictionaries)
        self._current = current
        words = self._dictionaries.get(current, b"")
        self._press = zlib.compressobj(LEVEL, zlib.DEFLATED, -15, 5, zlib.Z_DEFAULT_STRATEGY, words)
        self._step = msgspec.msgpack.Decoder(EngineStep, ext_hook=_unpack)
        self._state = msgspec.msgpack.Decoder(EngineState, ext_hook=_unpack)
        self._light = msgspec.msgpack.Decoder(_Light, ext_hook=_unpack)

    def encode(self, step: EngineStep) -> bytes:
        """Return a step as bytes."""
        return self._wrap(_ENCODER.encode(_lowered(step)))

    def encode_state(self, state: EngineState, pause: Callable[[], None] | None = None) -> bytes:
        """Return the whole state as bytes.

        Args:
            state: nobody may change it meanwhile.
            pause: called after each slice, so that other threads have their turn.
        """
        return self._wrap(b"".join(_sliced(state, pause or _go_on)))

    def _wrap(self, data: bytes) -> bytes:
        if self._current:
            mine = self._press.copy()
            small: bytes = mine.compress(data) + mine.flush()
            if len(small) < len(data):
                return bytes((FORMAT, self._current)) + zlib.crc32(small).to_bytes(4, "big") + small
        return bytes((FORMAT, PLAIN)) + zlib.crc32(data).to_bytes(4, "big") + data

    def decode(self, blob: bytes, where: str = "a step") -> EngineStep:
        """Return the step that `encode` wrote.

        Raises:
            JournalError: the bytes are damaged, or a newer version wrote them.
        """
        return self._read(self._step, blob, where)  # type: ignore[no-any-return]

    def decode_state(self, blob: bytes, where: str = "a snapshot", *, light: bool = False) -> EngineState:
        """Return the state that `encode_state` wrote.

        Args:
            blob: the bytes.
            where: for people.
            light: without explanations, which is several times faster where many tasks have ended.

        Raises:
            JournalError: the bytes are damaged, or a newer version wrote them.
        """
        if light:
            found: EngineState = self._read(self._light, blob, where)
            found.explanations = {}
            return found
        return self._read(self._state, blob, where)  # type: ignore[no-any-return]

    def _read(self, decoder: Any, blob: bytes, where: str) -> Any:
        if len(blob) < HEADER or blob[0] != FORMAT:
            what = f"is of format {blob[0]}, this version reads {FORMAT}" if blob else "is empty"
            raise JournalError(f"{where} of the journal {what}", help="read it with the version that wrote it")
        data = blob[HEADER:]
        if zlib.crc32(data).to_bytes(4, "big") != blob[2:HEADER]:
            raise JournalError(f"{where} of the journal is damaged: its checksum is wrong", help=f"{RESTORE}")
        try:
            if blob[1] != PLAIN:
                press = zlib.decompressobj(-15, self._dictionaries[blob[1]])
                data = press.decompress(data) + press.flush()
            return decoder.decode(data)
        except (KeyError, zlib.error, msgspec.DecodeError, ValueError) as error:
            raise JournalError(
                f"{where} of the journal cannot be read: {error}", help="read it with the version that wrote it"
            ) from error


RESTORE: Final = (
    "put a copy of the journal in its place; or begin anew, it is set aside: formiga up --start-anew "
    "(docs/journal.md#damaged)"
)
"""What to do with a journal that is damaged."""
