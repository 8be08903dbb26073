"""A folder of keys: what an engine, a router or an agent proves by TLS who it is.

    ca.pem      the certificate of the site's authority, whom the holder believes
    cert.pem    the holder's own; its common name says who it is
    key.pem     the private key of it, readable by its owner only
    about.json  of an agent: its site, and where it connects

Called by both ends of the wire at their start, and by the commands that make such folders (`authority.py`).
"""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Final

import msgspec
from msgspec import Struct

from formiga_bt.base.durable import open_to_others
from formiga_bt.base.errors import FormigaError
from formiga_bt.base.private_files import PrivateFileError, read_private

if TYPE_CHECKING:
    from cryptography.x509 import Certificate

CA, CERT, KEY, ABOUT = "ca.pem", "cert.pem", "key.pem", "about.json"
ENGINE: Final = "formiga.engine"
"""The engine's common name. No agent's id has a dot, so none can be called so."""
ROUTER: Final = "formiga.router"
MOST_BYTES: Final = 64_000
DAY_S: Final = 86_400
SOON_S: Final = 7 * DAY_S
"""So long before they expire keys are spoken of."""


class KeysError(FormigaError):
    """A folder of keys cannot be used."""


class About(Struct, frozen=True):
    """What an agent need not be told besides."""

    site: str = ""
    connect: str = ""
    """The router's endpoint."""


class Keys(Struct, frozen=True):
    """A folder of keys that can be used now."""

    folder: Path
    common_name: str
    until: int
    """Seconds since 1970."""
    about: About = About()

    @property
    def name(self) -> str:
        """Return who it is; the number behind an agent's name counts how often its keys were revoked."""
        return self.common_name if self.common_name in (ENGINE, ROUTER) else self.common_name.partition(".")[0]

    def tls(self, *, listens: bool) -> dict[str, str | bool]:
        """Return Zenoh's options of TLS: both ends show a certificate, and a link ends with the one that it was opened with."""
        side = "listen" if listens else "connect"
        return {
            "root_ca_certificate": str(self.folder / CA),
            f"{side}_certificate": str(self.folder / CERT),
            f"{side}_private_key": str(self.folder / KEY),
            "enable_mtls": True,
            "verify_name_on_connect": True,
            "close_link_on_expiration": True,
        }


def read_keys(folder: Path, now_s: float, who: str = "") -> Keys:
    """Return the keys of a folder, looked through.

    Args:
        folder: see the head of this module.
        now_s: seconds since 1970.
        who: whose they must be; empty: anybody's.

    Raises:
        KeysError: something lacks, does not fit, has expired, or others may read the private key.
    """
    folder = folder.resolve()
    from cryptography.exceptions import InvalidSignature
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    try:
        ca, cert = _certificate(folder / CA), _certificate(folder / CERT)
        key = load_pem_private_key(_bytes(folder / KEY), None)
    except (ValueError, TypeError) as error:
        raise _unusable(folder, f"a file of it is no PEM: {error}") from error
    try:
        cert.verify_directly_issued_by(ca)
    except (ValueError, TypeError, InvalidSignature) as error:
        raise _unusable(folder, f"{CERT} is not of the authority of {CA}") from error
    if open_to_others((folder / KEY).stat()):
        raise KeysError(f"{folder / KEY} can be read by others", help=f"chmod 600 {folder / KEY}")
    if key.public_key() != cert.public_key():
        raise _unusable(folder, f"{KEY} is not the key of {CERT}")
    begins, until = cert.not_valid_before_utc.timestamp(), int(cert.not_valid_after_utc.timestamp())
    if now_s >= until:
        what = f"the certificate of {folder} expired at {cert.not_valid_after_utc:%Y-%m-%d %H:%M} UTC"
        raise KeysError(
            what, help="where the site's authority is: formiga access agent NAME --renew (the engine's: ca)"
        )
    if now_s < begins:
        what = f"the certificate of {folder} counts from {cert.not_valid_before_utc:%Y-%m-%d %H:%M} UTC"
        raise KeysError(what, help="set this machine's clock right")
    found = Keys(folder, common_name(cert), until, _about(folder / ABOUT))
    if who and found.name != who:
        raise KeysError(f"the keys of {folder} are those of {found.name}, not of {who}", help="name its own folder")
    return found


def common_name(cert: "Certificate") -> str:
    """Return the common name of a certificate; empty: it has none."""
    from cryptography.x509.oid import NameOID

    names = cert.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(names[0].value) if names else ""


def _certificate(file: Path) -> "Certificate":
    from cryptography.x509 import load_pem_x509_certificate

    return load_pem_x509_certificate(_bytes(file))


def _bytes(file: Path) -> bytes:
    try:
        found = read_private(file, MOST_BYTES)
    except PrivateFileError as error:
        raise _unusable(file.parent, f"{file.name}: {error}") from error
    if found is None:
        raise _unusable(file.parent, f"it has no {file.name}")
    return found


def _about(file: Path) -> About:
    try:
        return msgspec.json.decode(read_private(file, MOST_BYTES) or b"{}", type=About)
    except (PrivateFileError, msgspec.DecodeError) as error:
        raise _unusable(file.parent, f"{file.name}: {error}") from error


def about_text(about: About) -> str:
    """Return the text of `about.json`."""
    return json.dumps(msgspec.to_builtins(about), indent=2) + "\n"


def _unusable(folder: Path, why: str) -> KeysError:
    return KeysError(
        f"the keys in {folder} cannot be used: {why}", help="folders of keys are made by: formiga access ca, agent NAME"
    )
