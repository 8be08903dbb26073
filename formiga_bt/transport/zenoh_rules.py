"""The access control of a router, made of the table of keys: an agent writes its own keys only, the engine's are the engine's.

Zenoh's rules name what may pass, everything else is denied. A rule counts for messages that come from a holder of a
certificate (`ingress`), or that go to it (`egress`). Called by `zenoh_router.py`.
"""

from collections.abc import Iterable, Mapping
from typing import Any, Final, Literal, NamedTuple

from formiga_bt.base.certificates import ENGINE
from formiga_bt.transport.zenoh_keys import KEYS, Way, WireKey

Flow = Literal["ingress", "egress"]

WRITES: Final[Mapping[Way, tuple[str, ...]]] = {
    "put": ("put",),
    "query": ("declare_queryable", "reply"),
    "presence": ("liveliness_token",),
}
"""What who owns a key sends."""
READS: Final[Mapping[Way, tuple[str, ...]]] = {
    "put": ("declare_subscriber",),
    "query": ("query",),
    "presence": ("declare_liveliness_subscriber", "liveliness_query"),
}
"""What who reads a key sends."""


class Member(NamedTuple):
    """An agent or a program that a router lets in."""

    name: str
    common_name: str
    """As its certificate says."""
    is_program: bool = False
    """It calls services, and is no agent."""


HOUSE: Final = Member("", ENGINE)


def access_control(site: str, members: Iterable[Member], *, simulation: bool) -> dict[str, Any]:
    """Return Zenoh's configuration `access_control`.

    Args:
        site: the site's name, below which all keys lie.
        members: whose certificates count.
        simulation: whether agents hear where the others move, as simulated people do.
    """
    table = [key for key in KEYS if simulation or key.reader != "simulated"]
    rules: list[dict[str, Any]] = []
    policies: list[dict[str, Any]] = []
    subjects: list[dict[str, Any]] = []
    for member in (HOUSE, *members):
        common_name = member.common_name
        allowed: dict[tuple[Flow, str], set[str]] = {}
        for key in table:
            _allow(allowed, site, key, member)
        for (flow, message), keys in allowed.items():
            rules.append(
                {
                    "id": f"{common_name} {flow} {message}", "permission": "allow", "flows": [flow],
                    "messages": [message], "key_exprs": sorted(keys),
                }
            )  # fmt: skip
        subjects.append({"id": common_name, "cert_common_names": [common_name], "link_protocols": ["tls"]})
        own = [f"{common_name} {flow} {message}" for flow, message in allowed]
        policies.append({"id": common_name, "rules": own, "subjects": [common_name]})
    return {
        "enabled": True, "default_permission": "deny", "rules": rules, "subjects": subjects, "policies": policies,
    }  # fmt: skip


def _allow(allowed: dict[tuple[Flow, str], set[str]], site: str, key: WireKey, member: Member) -> None:
    """Add what a key lets one member do."""
    own, of_all = f"{site}/{key.of('*', member.name or '*')}", f"{site}/{key.of_all}"
    for way in key.ways:
        if _owns(key, member):
            _add(allowed, "ingress", WRITES[way], own)
            # What others ask of it comes in as they say it, a query as the one key that it is for.
            _add(allowed, "egress", READS[way], own if way == "query" else of_all)
        if _reads(key, member):
            _add(allowed, "ingress", READS[way], own if key.reader == "callers" else of_all)
            _add(allowed, "egress", WRITES[way], of_all)


def _owns(key: WireKey, member: Member) -> bool:
    if member.is_program:
        return False
    return (key.owner == "agent") == (member is not HOUSE)


def _reads(key: WireKey, member: Member) -> bool:
    if member is HOUSE:
        return key.reader == "engine"
    return key.reader == "callers" if member.is_program else key.reader != "engine"


def _add(allowed: dict[tuple[Flow, str], set[str]], flow: Flow, messages: Iterable[str], key: str) -> None:
    for message in messages:
        allowed.setdefault((flow, message), set()).add(key)
