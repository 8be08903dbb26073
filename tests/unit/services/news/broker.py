"""An MQTT broker for tests, on the loopback: of MQTT 3.1.1 what one who publishes needs."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager

CONNECT, PUBLISH, DISCONNECT = 1, 3, 14


class Broker:
    """What was published, and how it is answered."""

    def __init__(self) -> None:
        self.got: list[tuple[str, bytes, int]] = []
        """Topic, payload, QoS."""
        self.connects: list[bytes] = []
        self.accepts = 0
        """Return code of CONNACK."""
        self.confirms = True
        self.port = 0

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while True:
                head = (await reader.readexactly(1))[0]
                length, shift = 0, 0
                while True:
                    digit = (await reader.readexactly(1))[0]
                    length |= (digit & 0x7F) << shift
                    shift += 7
                    if not digit & 0x80:
                        break
                body = await reader.readexactly(length)
                if head >> 4 == CONNECT:
                    self.connects.append(body)
                    writer.write(bytes((0x20, 2, 0, self.accepts)))
                elif head >> 4 == PUBLISH:
                    size = int.from_bytes(body[:2], "big")
                    qos = (head >> 1) & 3
                    ident, payload = body[2 + size : 4 + size], body[4 + size :]
                    self.got.append((body[2 : 2 + size].decode(), payload, qos))
                    if self.confirms:
                        writer.write(bytes((0x40, 2)) + ident)
                elif head >> 4 == DISCONNECT:
                    break
                await writer.drain()
        except (ConnectionError, asyncio.IncompleteReadError):
            pass
        finally:
            writer.close()


@contextmanager
def broker() -> Iterator[Broker]:
    """Serve until the block ends."""
    made, up, loop, stop = Broker(), threading.Event(), asyncio.new_event_loop(), asyncio.Event()

    async def main() -> None:
        server = await asyncio.start_server(made.serve, "127.0.0.1", 0)
        made.port = server.sockets[0].getsockname()[1]
        up.set()
        async with server:
            await stop.wait()

    thread = threading.Thread(target=lambda: loop.run_until_complete(main()), daemon=True)
    thread.start()
    assert up.wait(5)
    try:
        yield made
    finally:
        loop.call_soon_threadsafe(stop.set)
        thread.join(5)
        loop.close()
