"""Each answer of the API tells how far engine time is from the wall clock: whoever shows times of it to people says so."""

from collections.abc import Callable

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.services.http.door import App, Message, Receive, Scope, Send
from formiga_bt.show.offset import AHEAD_HEADER


class Clocked:
    """ASGI middleware.

    Args:
        app: what is behind it.
        ahead: engine time less the wall clock, microseconds.
    """

    def __init__(self, app: App, ahead: Callable[[], Micros]) -> None:
        self._app = app
        self._ahead = ahead

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Have the app answer, with the header."""

        async def told(message: Message) -> None:
            if message["type"] == "http.response.start":
                value = f"{self._ahead() / SECOND:.3f}".encode()
                message = {**message, "headers": [*message.get("headers", ()), (AHEAD_HEADER.lower().encode(), value)]}
            await send(message)

        await self._app(scope, receive, told)
