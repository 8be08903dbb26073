"""How a running engine is found: `.formiga/<site>/engine.json` of this folder or one above it, or an address.

An engine elsewhere is named by its URL, or by the environment: FORMIGA_URL, with FORMIGA_TOKEN, or FORMIGA_TOKEN_FILE, the file
that holds it. A token is never an argument of a command, which other users of the machine can read.
"""

import os
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from formiga_bt.base.durable import open_to_others
from formiga_bt.base.errors import UnusableFile
from formiga_bt.base.site_folder import EngineAddress, find_engines
from formiga_bt.client.calls import NoEngine
from formiga_bt.client.client import Client

MOST_TOKEN: Final = 10_000
"""Letters of a token's file that are read."""


def _base(url: str) -> str:
    """Return the address of an engine, without what is after it.

    Raises:
        UnusableFile: it is no address.
    """
    example = "for example http://127.0.0.1:8420"
    try:
        parts = urlsplit(url.strip())
        port = parts.port
    except ValueError as error:
        raise UnusableFile(f"--url: {error}; {example}") from error
    if "@" in parts.netloc:  # the text is not repeated: it may hold a password
        raise UnusableFile(f"--url: names and passwords do not belong into an address; {example}, with FORMIGA_TOKEN")
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.query or parts.fragment:
        raise UnusableFile(f"--url: '{url}' is no address of an engine; {example}")
    if not all(letter.isascii() and letter.isprintable() and letter != " " for letter in url.strip()):
        raise UnusableFile(f"--url: the address has letters that no address has; {example}")
    host = f"[{parts.hostname}]" if ":" in parts.hostname else parts.hostname
    path = parts.path.rstrip("/").removesuffix("/v1")
    return f"{parts.scheme}://{host}{f':{port}' if port is not None else ''}{path}"


def _own_token(file: Path | None) -> str:
    """Return the token for an engine elsewhere, or an empty text. It is never shown.

    Raises:
        UnusableFile: the file cannot be read, others can read it, or what is there is no token.
    """
    named = os.environ.get("FORMIGA_TOKEN_FILE", "")
    path = file if file is not None else Path(named) if named and "FORMIGA_TOKEN" not in os.environ else None
    if path is None:
        text, where = os.environ.get("FORMIGA_TOKEN", ""), "FORMIGA_TOKEN"
    else:
        where = str(path)
        try:
            with path.open(encoding="utf-8") as opened:
                if open_to_others(os.fstat(opened.fileno())):
                    raise UnusableFile(f"{path} can be read by others", help=f"chmod 600 {path}")
                text = opened.read(MOST_TOKEN)
        except (OSError, UnicodeDecodeError) as error:
            raise UnusableFile(
                f"{path}: the token cannot be read: {getattr(error, 'strerror', '') or 'no text'}"
            ) from None
    token = text.strip()
    if not token.isascii() or not token.isprintable() or " " in token:
        raise UnusableFile(f"{where} holds no token: it is one word of plain letters and digits")
    return token


def connect(site: Path | None = None, url: str = "", token_file: Path | None = None) -> Client:
    """Return a client of the engine at an address, or of the one of this folder.

    Args:
        site: a site file; without it the current folder and those above it are looked at.
        url: an engine's address; without it and `site`, FORMIGA_URL.
        token_file: holds the token for `url`; without it FORMIGA_TOKEN, or the file that FORMIGA_TOKEN_FILE names.

    Raises:
        NoEngine: none runs, or several do.
        UnusableFile: `url` is no address, both are given, or the token cannot be used.
    """
    if url and site is not None:
        raise UnusableFile("--url and --site name two engines; leave one out")
    named_url = url or ("" if site is not None else os.environ.get("FORMIGA_URL", ""))
    if named_url:
        place = EngineAddress(site="", pid=0, epoch=0, url=_base(named_url), endpoint="")
        return Client(place, _own_token(token_file))
    if token_file is not None:
        raise UnusableFile("--token-file goes with --url; an engine of this machine's own has its token in its folder")
    if site is not None:
        folder = site if site.is_dir() else site.parent
        found = [a for a in find_engines(folder) if Path(a.folder).parent.parent == folder.resolve()]
    else:
        folder = Path.cwd()
        found = find_engines(folder)
    named = os.environ.get("FORMIGA_SITE", "")
    if named:
        found = [address for address in found if address.site == named]
    if len(found) == 1:
        return Client(found[0])
    if found:
        sites = ", ".join(address.site for address in found)
        raise NoEngine(f"several engines run here: {sites}", help="choose one: FORMIGA_SITE=NAME formiga ...")
    raise NoEngine(
        f"no engine runs for {'the site ' + named + ' in ' if named else ''}{folder.resolve()}, or a folder above it",
        help="start one in the folder of your site.yaml: formiga up (formiga init makes such a folder);\n"
        "        an engine of another folder: --site FILE",
    )
