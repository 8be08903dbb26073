"""A site's own authority: it makes the keys of the engine, the router and the agents, and knows whose count no more.

    keys/ca.pem, ca.key    the authority; ca.key may be kept elsewhere, the engine and the router do not need it
    keys/holders.json      which agents have keys, until when, and whose were revoked
    keys/engine, router    folders of keys (`certificates.py`)
    keys/NAME              an agent's: to be handed to it
    keys/router.json       held by a running router: whom its rules know

A revoked name gets its next keys under another common name (`hwd_1.2`), so the rules of a router that was started anew
tell them from the old ones, which no list of Zenoh takes back.
"""

import json
import re
import threading
from collections.abc import Iterable, Sequence
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.certificates import ABOUT, CA, CERT, DAY_S, ENGINE, KEY, ROUTER, About, KeysError, about_text
from formiga_bt.base.durable import is_held, private_folder, write_durably
from formiga_bt.base.errors import FormigaError, SiteError
from formiga_bt.base.private_files import PrivateFileError, read_private

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey
    from cryptography.x509 import Certificate, GeneralName, Name

FOLDER: Final = "keys"
CA_KEY: Final = "ca.key"
HOLDERS: Final = "holders.json"
RUNNING: Final = "router.json"
LASTS_S: Final = 30 * DAY_S
"""An agent's certificate."""
HOUSE_S: Final = 365 * DAY_S
"""The certificates of the engine and the router, whose keys never leave the house."""
CA_S: Final = 3650 * DAY_S
BACK_S: Final = 3600
"""So much earlier a certificate counts than it was made: clocks differ."""
AGENT: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,62}")
RESERVED: Final = frozenset({"engine", "router", "clock", "site", "alive", "attachments", "svc"})
"""Names of the house's folders and of the engine's keys on the wire."""
OWN_HOSTS: Final = ("localhost", "127.0.0.1", "::1")
MOST_BYTES: Final = 4_000_000


class Holder(Struct, frozen=True, forbid_unknown_fields=True):
    """An agent or a program that has keys; instants in seconds since 1970."""

    name: str
    until: int
    generation: int = 1
    """Counts how often it got keys anew after a revocation."""
    revoked: int = 0
    """When; 0: its keys count."""
    is_program: bool = False
    """It calls services as the account of its name, and is no agent."""

    @property
    def common_name(self) -> str:
        """Return the name in its certificate."""
        return self.name if self.generation == 1 else f"{self.name}.{self.generation}"


class Holders(Struct, frozen=True, forbid_unknown_fields=True):
    """All agents that have keys, and the names under which the router is reached."""

    hosts: tuple[str, ...] = ()
    holders: tuple[Holder, ...] = ()

    def find(self, name: str) -> Holder | None:
        """Return the keys of an agent."""
        return next((one for one in self.holders if one.name == name), None)

    def counting(self, now_s: float) -> tuple[Holder, ...]:
        """Return those whose keys count now."""
        return tuple(one for one in self.holders if not one.revoked and now_s < one.until)


class Running(Struct, frozen=True):
    """What a running router says of itself."""

    pid: int
    endpoint: str
    names: tuple[str, ...]
    """The common names that its rules know."""


def read_holders(keys: Path) -> Holders:
    """Return who has keys.

    Raises:
        KeysError: the file cannot be used.
    """
    try:
        found = read_private(keys / HOLDERS, MOST_BYTES)
        return msgspec.json.decode(found, type=Holders) if found is not None else Holders()
    except (PrivateFileError, msgspec.DecodeError) as error:
        what = f"{keys / HOLDERS} cannot be used: {error}; it is not known whose keys count"
        raise KeysError(what, help="put the file back from a copy of the folder") from error


def read_running(keys: Path) -> Running | None:
    """Return the router that runs with these keys on this machine; None: none does."""
    if not is_held(keys / RUNNING):
        return None
    try:
        return msgspec.json.decode((keys / RUNNING).read_bytes(), type=Running)
    except (OSError, msgspec.DecodeError):
        return None


class Revoked:
    """Whose keys count no more, read anew when the file has changed. Called in many threads.

    Raises:
        KeysError: the file cannot be used at the start; later what was known stays.
    """

    def __init__(self, keys: Path) -> None:
        self._keys = keys
        self._lock = threading.Lock()
        self._seen = self._stamp()
        self._names = self._read()

    def look(self) -> frozenset[str]:
        """Return the names of those whose keys were revoked."""
        with self._lock:
            seen = self._stamp()
            if seen != self._seen:
                with suppress(KeysError):  # written halfway by hand, or gone: looked at again next time
                    self._names = self._read()
                    self._seen = seen
            return self._names

    def _read(self) -> frozenset[str]:
        return frozenset(one.name for one in read_holders(self._keys).holders if one.revoked)

    def _stamp(self) -> tuple[int, ...]:
        try:
            told = (self._keys / HOLDERS).stat()
        except OSError:
            return ()
        return told.st_mtime_ns, told.st_size, told.st_ino


def make_authority(keys: Path, site: str, hosts: Sequence[str], now_s: float) -> Literal["made", "renewed"]:
    """Make the site's authority if there is none, and new certificates of its engine and router.

    Args:
        keys: the folder; made if it is not there.
        site: the site's name.
        hosts: names and addresses under which agents reach the router, beside this machine's own.
        now_s: seconds since 1970.

    Raises:
        KeysError: the folder cannot be used, or has the authority's certificate without its key.
        SiteError: it cannot be written.
    """
    for host in hosts:
        _alternative(host)
    _folder(keys)
    known = read_holders(keys)
    made: Literal["made", "renewed"] = "renewed"
    if not (keys / CA).exists():
        made = "made"
        key = _new_key()
        name = _name(f"formiga {site}")
        _write_key(keys / CA_KEY, key)
        _write_cert(keys / CA, _ca_certificate(name, key, now_s))
    all_hosts = tuple(dict.fromkeys((*known.hosts, *hosts)))
    ca = _read_authority(keys)
    _house(keys / "engine", ca, ENGINE, (), now_s)
    _house(keys / "router", ca, ROUTER, (*OWN_HOSTS, *all_hosts), now_s)
    write_holders(keys, replace(known, hosts=all_hosts))
    return made


def issue(keys: Path, name: str, about: About, now_s: float, *, is_program: bool = False) -> Holder:
    """Make keys of an agent, or of a program, in the folder of its name.

    Raises:
        KeysError: it has keys that count, or no name of an agent; there is no authority; or a router still knows its old keys.
        SiteError: it cannot be written.
    """
    if not AGENT.fullmatch(name) or name in RESERVED:
        raise KeysError(
            f"'{name}' cannot be an agent's name: letters, digits, '_' and '-', and no word of the wire's own"
        )
    known = read_holders(keys)
    before = known.find(name)
    if before is not None and not before.revoked and now_s < before.until:
        help_ = f"a new certificate for them: --renew; lost? formiga access revoke agent {name}"
        raise KeysError(f"{name} has keys until {day(before.until)}; nothing was changed", help=help_)
    running = read_running(keys)
    if before is not None and before.revoked and running is not None and before.common_name in running.names:
        what = f"the router (process {running.pid}) still lets the revoked keys of {name} in; nothing was changed"
        raise KeysError(what, help="start it anew: formiga router --restart, then issue new keys")
    generation = 1 if before is None else before.generation + bool(before.revoked)
    holder = Holder(name, int(now_s) + LASTS_S, generation, is_program=is_program)
    ca, key = _read_authority(keys), _new_key()
    _folder(keys / name)
    _write_key(keys / name / KEY, key)
    _hand_out(keys / name, ca, holder, key.public_key(), about, now_s)
    _note(keys, known, holder)
    return holder


def renew(keys: Path, name: str, about: About, now_s: float) -> Holder:
    """Make a new certificate for the keys that an agent has; its private key is not needed for it.

    Raises:
        KeysError: it has none, or they were revoked.
        SiteError: it cannot be written.
    """
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePublicKey
    from cryptography.x509 import load_pem_x509_certificate

    known = read_holders(keys)
    before = known.find(name)
    if before is None or before.revoked:
        what = f"{name} has no keys" if before is None else f"the keys of {name} were revoked"
        raise KeysError(f"{what}; nothing was changed", help=f"new keys: formiga access agent {name}")
    try:
        public = load_pem_x509_certificate((keys / name / CERT).read_bytes()).public_key()
    except (OSError, ValueError) as error:
        help_ = f"formiga access revoke agent {name}, then formiga access agent {name}"
        raise KeysError(f"the last certificate of {name} cannot be read: {error}", help=help_) from error
    assert isinstance(public, EllipticCurvePublicKey), "made here"
    holder = replace(before, until=int(now_s) + LASTS_S)
    _hand_out(keys / name, _read_authority(keys), holder, public, about, now_s)
    _note(keys, known, holder)
    return holder


def revoke(keys: Path, name: str, now_s: float) -> Holder:
    """Take the keys of an agent back: the engine ignores it at once, a router from its next start.

    Raises:
        KeysError: it has none.
        SiteError: it cannot be written.
    """
    known = read_holders(keys)
    before = known.find(name)
    if before is None:
        names = ", ".join(one.name for one in known.holders) or "nobody"
        raise KeysError(f"{name} has no keys; there are those of: {names}", help="formiga access keys")
    holder = replace(before, revoked=before.revoked or int(now_s))
    _note(keys, known, holder)
    return holder


def check_keys(keys: Path, names: Iterable[str], now_s: float) -> None:
    """Look whether agents have keys that count.

    Raises:
        KeysError: some have none.
    """
    counting = {one.name for one in read_holders(keys).counting(now_s)}
    if lacks := [name for name in names if name not in counting]:
        what = f"{', '.join(lacks)} {'has' if len(lacks) == 1 else 'have'} no keys that count in {keys}"
        raise KeysError(what, help=f"formiga access agent {' '.join(lacks)}, then start the router anew")


def write_holders(keys: Path, holders: Holders) -> None:
    """Write who has keys; called within `private_files.changing`.

    Raises:
        SiteError: it cannot be written.
    """
    write_durably(keys / HOLDERS, json.dumps(msgspec.to_builtins(holders), indent=2) + "\n")


def day(instant: float) -> str:
    """Return a day, UTC."""
    return datetime.fromtimestamp(instant, UTC).date().isoformat()


def _note(keys: Path, known: Holders, holder: Holder) -> None:
    others = tuple(one for one in known.holders if one.name != holder.name)
    write_holders(keys, replace(known, holders=tuple(sorted((*others, holder), key=lambda one: one.name))))


def _folder(path: Path) -> None:
    try:
        private_folder(path)
    except OSError as error:
        raise SiteError(f"cannot write {path}: {error.strerror or error}") from error


# -- certificates ----------------------------------------------------------------------------------------------------
class _Authority(Struct, frozen=True):
    cert: "Certificate"
    key: "EllipticCurvePrivateKey"


def _read_authority(keys: Path) -> _Authority:
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey
    from cryptography.hazmat.primitives.serialization import load_pem_private_key
    from cryptography.x509 import load_pem_x509_certificate

    try:
        cert = load_pem_x509_certificate((keys / CA).read_bytes())
        key = load_pem_private_key((keys / CA_KEY).read_bytes(), None)
    except FileNotFoundError as error:
        lacks = Path(str(error.filename)).name
        help_ = "formiga access ca" if lacks == CA else f"put {CA_KEY} back for as long as keys are made"
        raise KeysError(f"there is no {lacks} in {keys}", help=help_) from error
    except (OSError, ValueError, TypeError) as error:
        raise KeysError(f"the authority in {keys} cannot be used: {error}", help="put its files back") from error
    if not isinstance(key, EllipticCurvePrivateKey) or key.public_key() != cert.public_key():
        raise KeysError(f"{keys / CA_KEY} is not the key of {CA}", help="put its files back")
    return _Authority(cert, key)


def _house(folder: Path, ca: _Authority, name: str, hosts: Iterable[str], now_s: float) -> None:
    key = _new_key()
    _folder(folder)
    _write_key(folder / KEY, key)
    _write_cert(folder / CERT, _leaf(ca, name, key.public_key(), tuple(hosts), now_s, HOUSE_S))
    _write_cert(folder / CA, ca.cert)


def _hand_out(folder: Path, ca: _Authority, holder: Holder, public: "object", about: About, now_s: float) -> None:
    _write_cert(folder / CERT, _leaf(ca, holder.common_name, public, (), now_s, LASTS_S))
    _write_cert(folder / CA, ca.cert)
    write_durably(folder / ABOUT, about_text(about))


def _new_key() -> "EllipticCurvePrivateKey":
    from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, generate_private_key

    return generate_private_key(SECP256R1())


def _name(text: str) -> "Name":
    from cryptography.x509 import Name, NameAttribute
    from cryptography.x509.oid import NameOID

    return Name([NameAttribute(NameOID.COMMON_NAME, text)])


def _ca_certificate(name: "Name", key: "EllipticCurvePrivateKey", now_s: float) -> "Certificate":
    from cryptography import x509
    from cryptography.hazmat.primitives.hashes import SHA256

    begins = datetime.fromtimestamp(now_s - BACK_S, UTC)
    usage = x509.KeyUsage(
        digital_signature=False, content_commitment=False, key_encipherment=False, data_encipherment=False,
        key_agreement=False, key_cert_sign=True, crl_sign=True, encipher_only=False, decipher_only=False,
    )  # fmt: skip
    made = x509.CertificateBuilder().subject_name(name).issuer_name(name).public_key(key.public_key())
    made = made.serial_number(x509.random_serial_number()).not_valid_before(begins)
    made = made.not_valid_after(begins + timedelta(seconds=CA_S))
    made = made.add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
    made = made.add_extension(usage, critical=True)
    made = made.add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
    return made.sign(key, SHA256())


def _leaf(
    ca: _Authority, name: str, public: "object", hosts: tuple[str, ...], now_s: float, lasts_s: int
) -> "Certificate":
    """Return a certificate: of a server if it has hosts, else of a client; neither counts as the other."""
    from cryptography import x509
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePublicKey
    from cryptography.hazmat.primitives.hashes import SHA256
    from cryptography.x509.oid import ExtendedKeyUsageOID

    assert isinstance(public, EllipticCurvePublicKey)
    use = ExtendedKeyUsageOID.SERVER_AUTH if hosts else ExtendedKeyUsageOID.CLIENT_AUTH
    made = x509.CertificateBuilder().subject_name(_name(name)).issuer_name(ca.cert.subject).public_key(public)
    made = made.serial_number(x509.random_serial_number())
    made = made.not_valid_before(datetime.fromtimestamp(now_s - BACK_S, UTC))
    made = made.not_valid_after(datetime.fromtimestamp(int(now_s) + lasts_s, UTC))
    made = made.add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
    made = made.add_extension(x509.ExtendedKeyUsage([use]), critical=False)
    if hosts:
        names = x509.SubjectAlternativeName([_alternative(host) for host in dict.fromkeys(hosts)])
        made = made.add_extension(names, critical=False)
    return made.sign(ca.key, SHA256())


def _alternative(host: str) -> "GeneralName":
    from cryptography.x509 import DNSName, IPAddress

    try:
        return IPAddress(ip_address(host.strip("[]")))
    except ValueError:
        pass
    if not re.fullmatch(r"[A-Za-z0-9]([A-Za-z0-9.-]{0,251}[A-Za-z0-9])?", host):
        raise FormigaError(
            f"--host: '{host}' is no name or address of a machine", help="such as engine.example or 10.0.0.5"
        )
    return DNSName(host)


def _write_key(file: Path, key: "EllipticCurvePrivateKey") -> None:
    from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

    write_durably(file, key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()).decode())


def _write_cert(file: Path, cert: "Certificate") -> None:
    from cryptography.hazmat.primitives.serialization import Encoding

    write_durably(file, cert.public_bytes(Encoding.PEM).decode())
