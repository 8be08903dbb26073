"""`@action` and `@event`: methods of an agent whose parameters become its card."""

import dataclasses
import inspect
import typing
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, TypeVar, overload

import msgspec
from msgspec import Struct

from formiga_bt.agent.tokens import CancelToken
from formiga_bt.agent.types import field_of, fields_of
from formiga_bt.transport.cards import CardAction, Fields

_F = TypeVar("_F", bound=Callable[..., Any])

_ACTION: Final = "__formiga_action__"
_EVENT: Final = "__formiga_event__"


class ActionError(Exception):
    """Raised by an action: its goal fails with this code (a snake_case word) and text."""

    def __init__(self, code: str, text: str = "") -> None:
        super().__init__(f"{code}: {text}" if text else code)
        self.code, self.text = code, text


class Declared(Struct, frozen=True):
    """An action as its method declares it."""

    call: Callable[..., Any]
    is_async: bool
    card: CardAction
    params: Fields
    result: Fields | None
    """None: anything, the catalogue says what."""
    token: str
    """The name of the parameter that takes a `CancelToken`, or ""."""
    cancelable: bool
    live: tuple[str, ...] = ()
    """Parameters that may change while it runs."""


@overload
def action(method: _F, /) -> _F: ...
@overload
def action(*, cancelable: bool = True, live: Sequence[str] = (), **card: Any) -> Callable[[_F], _F]: ...
def action(method: Any = None, /, *, cancelable: bool = True, live: Sequence[str] = (), **card: Any) -> Any:
    """Make a method an action of the agent; its name, types and defaults become the card.

    Args:
        method: an `async def`, in which a cancel arrives as `asyncio.CancelledError`; or a plain function, which runs
        in a
            thread and may take a `CancelToken`.
        cancelable: False: cancels are refused, and the action goes on to its end.
        live: parameters that may change while it runs: it reads the newest value with `self.live(name)`.
        **card: other fields of the card: `requires`, `effect`, `moves_to`, `repeatable`, `exclusive`, `typical_s`, ...
    """
    unknown = sorted(card.keys() - (set(CardAction.__struct_fields__) - {"name", "fields", "result", "help"}))
    if unknown:
        raise TypeError(f"@action knows no {unknown[0]!r}")

    def mark(function: _F) -> _F:
        setattr(function, _ACTION, (cancelable, tuple(live), card))
        return function

    return mark(method) if method is not None else mark


def event(method: Callable[..., None]) -> Callable[..., None]:
    """Make a method an event: calling it publishes the event with its arguments. Its body is not run.

    A call may also name files (`attachments`), whatever the method's parameters are.
    """
    setattr(method, _EVENT, True)
    return method


def actions_of(cls: type) -> dict[str, Declared]:
    """Return the actions that a class and its bases declare.

    Raises:
        TypeError: a parameter has no type of the language; the text says which.
    """
    return {name: _declared(name, method) for name, method in _marked(cls, _ACTION).items()}


def events_of(cls: type) -> dict[str, Fields]:
    """Return the events that a class and its bases declare.

    Raises:
        TypeError: a parameter has no type of the language; the text says which.
    """
    return {name: _params(f"event {name}", method)[0] for name, method in _marked(cls, _EVENT).items()}


def _marked(cls: type, mark: str) -> dict[str, Callable[..., Any]]:
    found = {}
    for name in dir(cls):
        method = inspect.getattr_static(cls, name)
        if callable(method) and hasattr(method, mark):
            found[name] = method
    return dict(sorted(found.items(), key=lambda one: one[1].__code__.co_firstlineno))


def _declared(name: str, method: Callable[..., Any]) -> Declared:
    cancelable, live, more = getattr(method, _ACTION)
    params, token, returns = _params(f"action {name}", method)
    result = _result(f"action {name}", returns)
    is_async = inspect.iscoroutinefunction(method)
    if is_async and token:
        raise TypeError(
            f"action {name}: an async action is canceled by asyncio.CancelledError; it takes no CancelToken"
        )
    doc = inspect.getdoc(method) or ""
    card = CardAction(name=name, fields=params, result=result, help=doc.split("\n")[0], **more)
    if card.moves_to and card.moves_to not in params:
        raise TypeError(f"action {name}: moves_to names {card.moves_to!r}, which is no parameter of it")
    strange = [one for one in live if one not in params]
    if strange:
        raise TypeError(f"action {name}: live names {strange[0]!r}, which is no parameter of it")
    return Declared(method, is_async, card, params, result, token, cancelable, live)


def _params(what: str, method: Callable[..., Any]) -> tuple[Fields, str, Any]:
    try:
        hints = typing.get_type_hints(method, include_extras=True)
    except NameError as error:
        raise TypeError(f"{what}: {error}; import the type where the class stands") from error
    fields: Fields = {}
    token = ""
    for param in list(inspect.signature(method).parameters.values())[1:]:
        if param.kind in (param.VAR_POSITIONAL, param.VAR_KEYWORD, param.POSITIONAL_ONLY):
            raise TypeError(f"{what}: parameter {param.name!r}: every field has a name")
        if param.name not in hints:
            raise TypeError(f"{what}: parameter {param.name!r} has no type; such as {param.name}: float")
        if hints[param.name] is CancelToken:
            token = param.name
            continue
        try:
            fields[param.name] = field_of(hints[param.name], param.default)
        except TypeError as error:
            raise TypeError(f"{what}: parameter {param.name!r}: {error}") from error
    return fields, token, hints.get("return")


def _result(what: str, returns: Any) -> Fields | None:
    if returns is None or returns is type(None):
        return {}
    if returns is Any or returns is dict or typing.get_origin(returns) in (dict, Mapping):
        return None
    is_record = isinstance(returns, type) and (
        typing.is_typeddict(returns) or dataclasses.is_dataclass(returns) or issubclass(returns, Struct)
    )
    if not is_record:
        raise TypeError(f"{what}: a result is named values: return a TypedDict, a dataclass, dict or nothing")
    try:
        return fields_of(typing.get_type_hints(returns, include_extras=True))
    except TypeError as error:
        raise TypeError(f"{what}: result {error}") from error


def named_values(result: Any) -> dict[str, Any]:
    """Return what an action returned as values by name.

    Raises:
        TypeError: it is no mapping, dataclass or Struct.
    """
    if result is None:
        return {}
    if isinstance(result, Mapping):
        return dict(result)
    if isinstance(result, Struct):
        return msgspec.structs.asdict(result)
    if dataclasses.is_dataclass(result) and not isinstance(result, type):
        return {one.name: getattr(result, one.name) for one in dataclasses.fields(result)}
    raise TypeError(f"a result is named values, got {result!r}")
