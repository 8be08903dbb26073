"""Keys of a site: what is made fits, and whatever does not is refused with a word of what to do."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.x509.oid import ExtendedKeyUsageOID

from formiga_bt.base import authority
from formiga_bt.base.authority import (
    CA_KEY,
    LASTS_S,
    Revoked,
    check_keys,
    issue,
    make_authority,
    read_holders,
    renew,
    revoke,
)
from formiga_bt.base.certificates import CERT, DAY_S, ENGINE, KEY, ROUTER, About, KeysError, read_keys
from formiga_bt.base.errors import FormigaError

NOW = 1_790_000_000.0
ABOUT = About("yard", "tls/engine.example:7447")


@pytest.fixture
def keys(tmp_path: Path) -> Path:
    made = tmp_path / "keys"
    make_authority(made, "yard", ["engine.example", "10.0.0.5"], NOW)
    return made


def certificate(folder: Path) -> x509.Certificate:
    return x509.load_pem_x509_certificate((folder / CERT).read_bytes())


def test_an_agent_gets_keys_of_thirty_days_that_say_who_and_where_it_is(keys: Path) -> None:
    holder = issue(keys, "hwd_1", ABOUT, NOW)
    found = read_keys(keys / "hwd_1", NOW, "hwd_1")
    assert (found.name, found.common_name, found.about) == ("hwd_1", "hwd_1", ABOUT)
    assert found.until == holder.until == NOW + 30 * DAY_S
    assert read_keys(keys / "hwd_1", NOW + LASTS_S - 1).until == holder.until
    assert {
        str(one.relative_to(keys)) for one in keys.rglob("*") if one.is_file() and one.stat().st_mode & 0o077
    } == set()
    assert {one.stat().st_mode & 0o777 for one in (keys, keys / "hwd_1", keys / "engine")} == {0o700}


def test_a_client_is_no_server_and_a_server_no_client(keys: Path) -> None:
    issue(keys, "hwd_1", ABOUT, NOW)
    uses = {}
    for name in ("hwd_1", "engine", "router"):
        found = certificate(keys / name).extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
        uses[name] = list(found)
    client, server = [ExtendedKeyUsageOID.CLIENT_AUTH], [ExtendedKeyUsageOID.SERVER_AUTH]
    assert uses == {"hwd_1": client, "engine": client, "router": server}
    names = certificate(keys / "router").extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName) == ["localhost", "engine.example"]
    assert [str(one) for one in names.get_values_for_type(x509.IPAddress)] == ["127.0.0.1", "::1", "10.0.0.5"]
    assert read_keys(keys / "engine", NOW).name == ENGINE
    assert read_keys(keys / "router", NOW).name == ROUTER


def test_the_authority_stays_when_its_house_gets_new_keys(keys: Path) -> None:
    issue(keys, "hwd_1", ABOUT, NOW)
    before = (keys / "ca.pem").read_bytes()
    assert make_authority(keys, "yard", ["other.example"], NOW + DAY_S) == "renewed"
    assert (keys / "ca.pem").read_bytes() == before
    assert read_holders(keys).hosts == ("engine.example", "10.0.0.5", "other.example")
    assert read_keys(keys / "hwd_1", NOW).name == "hwd_1"
    assert read_keys(keys / "router", NOW + DAY_S).until == NOW + DAY_S + authority.HOUSE_S


def test_a_new_certificate_is_of_the_same_key_and_needs_no_secret_of_the_agent(keys: Path) -> None:
    issue(keys, "hwd_1", ABOUT, NOW)
    handed_over = shutil.move(keys / "hwd_1" / KEY, keys / "away.pem")
    renew(keys, "hwd_1", ABOUT, NOW + 20 * DAY_S)
    shutil.move(handed_over, keys / "hwd_1" / KEY)
    assert read_keys(keys / "hwd_1", NOW + 40 * DAY_S).until == NOW + 50 * DAY_S


def test_revoked_keys_come_back_under_another_common_name_only(keys: Path) -> None:
    issue(keys, "hwd_1", ABOUT, NOW)
    book = Revoked(keys)
    assert book.look() == frozenset()
    revoke(keys, "hwd_1", NOW)
    assert book.look() == {"hwd_1"}
    assert read_holders(keys).counting(NOW) == ()
    with pytest.raises(KeysError, match="revoked"):
        renew(keys, "hwd_1", ABOUT, NOW)
    assert issue(keys, "hwd_1", ABOUT, NOW + 1).common_name == "hwd_1.2"
    assert book.look() == frozenset()
    found = read_keys(keys / "hwd_1", NOW + 1)
    assert (found.name, found.common_name) == ("hwd_1", "hwd_1.2")
    assert [one.common_name for one in read_holders(keys).counting(NOW + 1)] == ["hwd_1.2"]


def test_what_is_known_of_revoked_keys_stays_when_the_file_is_broken(keys: Path) -> None:
    issue(keys, "hwd_1", ABOUT, NOW)
    revoke(keys, "hwd_1", NOW)
    book = Revoked(keys)
    (keys / "holders.json").write_text("{", encoding="utf-8")
    assert book.look() == {"hwd_1"}
    with pytest.raises(KeysError, match=r"holders\.json"):
        Revoked(keys)


def test_keys_that_have_expired_are_made_anew_under_the_same_name(keys: Path) -> None:
    issue(keys, "hwd_1", ABOUT, NOW)
    with pytest.raises(KeysError, match="no keys that count"):
        check_keys(keys, ["hwd_1"], NOW + 31 * DAY_S)
    assert issue(keys, "hwd_1", ABOUT, NOW + 31 * DAY_S).common_name == "hwd_1"
    check_keys(keys, ["hwd_1"], NOW + 31 * DAY_S)


@pytest.mark.parametrize("name", ["engine", "router", "clock", "svc", "a.b", "a/b", "*", "", "-a", "a" * 64])
def test_no_agent_is_called_as_the_wire_itself(keys: Path, name: str) -> None:
    with pytest.raises(KeysError, match="cannot be an agent's name"):
        issue(keys, name, ABOUT, NOW)


def test_an_agent_has_one_set_of_keys(keys: Path) -> None:
    issue(keys, "hwd_1", ABOUT, NOW)
    with pytest.raises(KeysError, match="has keys until") as error:
        issue(keys, "hwd_1", ABOUT, NOW)
    assert "--renew" in error.value.help


def loosened(folder: Path) -> None:
    (folder / KEY).chmod(0o640)


def another_key(folder: Path) -> None:
    shutil.copy(folder.parent / "engine" / KEY, folder / KEY)


def another_authority(folder: Path, site: str = "yard") -> None:
    make_authority(folder.parent / "other", site, [], NOW)
    shutil.copy(folder.parent / "other" / "ca.pem", folder / "ca.pem")


@pytest.mark.parametrize(
    ("spoil", "word"),
    [
        (loosened, "read by others"),
        (another_key, "is not the key of"),
        (another_authority, "not of the authority"),
        (lambda folder: another_authority(folder, "elsewhere"), "not of the authority"),
        (lambda folder: (folder / CERT).write_text("no"), "no PEM"),
        (lambda folder: (folder / KEY).write_text("no"), "no PEM"),
        (lambda folder: (folder / "ca.pem").unlink(), "has no ca.pem"),
        (lambda folder: (folder / "about.json").write_text("["), "about.json"),
        (lambda folder: (folder / CERT).write_text("x" * 70_000), "too large"),
    ],
)
def test_keys_that_do_not_fit_are_refused(keys: Path, spoil: Callable[[Path], object], word: str) -> None:
    issue(keys, "hwd_1", ABOUT, NOW)
    spoil(keys / "hwd_1")
    with pytest.raises(KeysError, match=word) as error:
        read_keys(keys / "hwd_1", NOW)
    assert error.value.help


def test_keys_count_in_their_time_and_for_their_holder_only(keys: Path) -> None:
    issue(keys, "hwd_1", ABOUT, NOW)
    with pytest.raises(KeysError, match="expired"):
        read_keys(keys / "hwd_1", NOW + LASTS_S)
    with pytest.raises(KeysError, match="counts from"):
        read_keys(keys / "hwd_1", NOW - DAY_S)
    with pytest.raises(KeysError, match="those of hwd_1"):
        read_keys(keys / "hwd_1", NOW, "hwd_2")


def test_without_the_authoritys_key_nothing_is_made(keys: Path) -> None:
    (keys / CA_KEY).unlink()
    with pytest.raises(KeysError, match=CA_KEY):
        issue(keys, "hwd_1", ABOUT, NOW)
    assert read_holders(keys).find("hwd_1") is None
    with pytest.raises(KeysError, match=CA_KEY):
        make_authority(keys, "yard", [], NOW)


def test_a_host_is_a_name_or_an_address(tmp_path: Path) -> None:
    with pytest.raises(FormigaError, match="--host"):
        make_authority(tmp_path / "keys", "yard", ["a b"], NOW)
    assert not (tmp_path / "keys").exists()
