"""A mail server for tests, on the loopback: it takes mails, or says what it is told to say."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from email import message_from_string, policy
from email.message import EmailMessage


class Mailbox:
    """What came in, and how it is answered."""

    def __init__(self) -> None:
        self.mails: list[EmailMessage] = []
        self.words: list[str] = []
        """Every command that was said."""
        self.says: dict[str, str] = {}
        """Command -> its answer, instead of yes."""
        self.port = 0

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        def say(text: str) -> None:
            writer.write(f"{text}\r\n".encode())

        say(self.says.get("", "220 box"))
        try:
            while line := (await reader.readline()).decode():
                word = line.split()[0].upper() if line.split() else ""
                self.words.append(word)
                if word in self.says:
                    say(self.says[word])
                elif word == "EHLO":
                    say("250-box\r\n250 AUTH PLAIN LOGIN")
                elif word == "AUTH":
                    say("235 welcome")
                elif word == "DATA":
                    say("354 go on")
                    text = (await reader.readuntil(b"\r\n.\r\n")).decode()
                    said = self.says.get(".", "250 queued")
                    if said.startswith("250"):
                        mail = message_from_string(text.removesuffix("\r\n.\r\n"), policy=policy.default)
                        assert isinstance(mail, EmailMessage)
                        self.mails.append(mail)
                    say(said)
                elif word == "QUIT":
                    say("221 bye")
                    break
                else:
                    say("250 yes")
                await writer.drain()
        except (ConnectionError, asyncio.IncompleteReadError):
            pass
        finally:
            writer.close()


@contextmanager
def mailbox() -> Iterator[Mailbox]:
    """Serve until the block ends."""
    box, up, loop = Mailbox(), threading.Event(), asyncio.new_event_loop()

    async def main() -> None:
        server = await asyncio.start_server(box.serve, "127.0.0.1", 0)
        box.port = server.sockets[0].getsockname()[1]
        up.set()
        async with server:
            await stop.wait()

    stop = asyncio.Event()
    thread = threading.Thread(target=lambda: loop.run_until_complete(main()), daemon=True)
    thread.start()
    assert up.wait(5)
    try:
        yield box
    finally:
        loop.call_soon_threadsafe(stop.set)
        thread.join(5)
        loop.close()
