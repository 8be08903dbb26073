"""Bytes of attachments: `PUT` and `GET /v1/attachments/<sha256>`.

What is served is never run by a browser: its type is one of a few harmless ones or plain bytes, nothing is guessed, and a page
made of it may do nothing.
"""

import re
from typing import Annotated, Final
from urllib.parse import quote

import msgspec
from fastapi import Depends, Query, Request
from fastapi.responses import Response

from formiga_bt.base.roles import Deed
from formiga_bt.services.http.routes import REF, FactRoutes
from formiga_bt.services.kept.attachments import AttachmentStore
from formiga_bt.services.refused import Refused
from formiga_bt.show.facts import AttachmentKept
from formiga_bt.transport.attachments import FileError

SHOWN: Final = frozenset(
    {
        "image/png",
        "image/jpeg",
        "image/webp",
        "image/gif",
        "text/plain",
        "text/csv",
        "application/json",
        "application/pdf",
    }
)
"""Media types that are served as what they are; others as plain bytes."""
BYTES: Final = "application/octet-stream"
_PLAIN: Final = re.compile(r"[^A-Za-z0-9._ -]")


def add(routes: FactRoutes, store: AttachmentStore) -> None:
    """Add the routes."""
    routes.kinds.add(AttachmentKept)
    about = {
        "description": "Kept.",
        "content": {"application/json": {"schema": {"$ref": REF.format(name="AttachmentKept")}}},
    }

    path = "/v1/attachments/{sha256}"

    @routes.app.put(
        path, tags=["attachments"], status_code=201, response_model=None, responses={201: about},
        dependencies=routes.guard("PUT", path, Deed.ATTACH),
    )  # fmt: skip
    def keep(sha256: str, data: Annotated[bytes, Depends(_body)]) -> Response:
        """Keep the bytes of an attachment, which are the body; the same again changes nothing."""
        try:
            store.put(sha256, data)
        except FileError as error:
            code, _, text = str(error).partition(": ")
            raise Refused(code, text, "send exactly the bytes whose SHA-256 the path names") from error
        answer = msgspec.json.encode(AttachmentKept(sha256=sha256, size=len(data)))
        return Response(answer, 201, media_type="application/json")

    seeing = routes.guard("GET", path, Deed.SEE)

    @routes.app.get(path, tags=["attachments"], response_model=None, response_class=Response, dependencies=seeing)
    def fetch(
        sha256: str,
        name: Annotated[str, Query(max_length=100, description="how a browser calls the file that it saves")] = "",
        media_type: Annotated[str, Query(max_length=130, description="as the agent said it")] = "",
    ) -> Response:
        """Return the bytes of an attachment."""
        data = store.get(sha256)
        if data is None:
            text = f"no attachment with the hash {sha256[:64]!r} is here: it never came, or it was forgotten"
            raise Refused("no_attachment", text)
        return Response(data, 200, headers(name or sha256, media_type), media_type=None)


async def _body(request: Request) -> bytes:
    return await request.body()


def headers(name: str, media_type: str) -> dict[str, str]:
    """Return the headers with which a file is served."""
    kind = media_type if media_type in SHOWN else BYTES
    how = "inline" if kind.startswith("image/") else "attachment"
    plain = _PLAIN.sub("_", name)[:100].strip(". ") or "file"
    return {
        "Content-Type": f"{kind}; charset=utf-8" if kind.startswith("text/") else kind,
        "Content-Disposition": f"{how}; filename=\"{plain}\"; filename*=UTF-8''{quote(name[:100], safe='')}",
        "X-Content-Type-Options": "nosniff",
        "Content-Security-Policy": "sandbox; default-src 'none'",
        "Cache-Control": "private, max-age=3600",
    }
