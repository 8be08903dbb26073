"""Checks of the agents' wire: whether who speaks on it must prove who they are, and whether keys and router fit together."""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from formiga_bt.base.authority import CA_KEY, read_holders, read_running
from formiga_bt.base.certificates import DAY_S, ENGINE, ROUTER, SOON_S, KeysError, read_keys
from formiga_bt.base.durable import open_to_others
from formiga_bt.cli.operator.checkup.finding import Finding, Patient
from formiga_bt.services.listening import keys_of

if TYPE_CHECKING:
    from formiga_bt.lang.model import Site

HOUSE_SOON_S: Final = 30 * DAY_S


def keys(patient: Patient) -> Iterator[Finding]:
    """Check the keys of the engine, the router and the agents."""
    site = patient.model
    if site is None:
        return
    folder = keys_of(site)
    if folder is None:
        what = "the agents' wire asks for no keys: who reaches it can be any agent"
        yield Finding("warn" if site.mode == "real" else "ok", what, str(patient.site), "formiga access ca")
        return
    yield from _house(folder, "engine", ENGINE)
    if (folder / "router").is_dir():
        yield from _house(folder, "router", ROUTER)
    yield from _agents(site, folder)
    yield from _router(folder)
    if (folder / CA_KEY).exists() and open_to_others((folder / CA_KEY).stat()):
        yield Finding(
            "fail", "others may read the key of the authority", str(folder / CA_KEY), f"chmod 600 {folder / CA_KEY}"
        )


def _house(folder: Path, name: str, common_name: str) -> Iterator[Finding]:
    try:
        found = read_keys(folder / name, time.time(), common_name)
    except KeysError as error:
        yield Finding("fail", error.text, str(folder / name), error.help or "formiga access ca")
        return
    left_s = found.until - time.time()
    text = f"the certificate of the {name} counts for {left_s / DAY_S:.0f} days"
    yield Finding("warn" if left_s < HOUSE_SOON_S else "ok", text, str(folder / name), "formiga access ca")


def _agents(site: "Site", folder: Path) -> Iterator[Finding]:
    now_s, known = time.time(), read_holders(folder)
    counting = {one.name: one for one in known.counting(now_s)}
    for name in site.agents:
        one = known.find(name)
        if name in counting:
            left_s = counting[name].until - now_s
            if left_s < SOON_S:
                what = f"the certificate of {name} counts for {left_s / DAY_S:.1f} days"
                yield Finding("warn", what, str(folder / name), f"formiga access agent {name} --renew")
        elif one is not None and one.revoked:
            yield Finding("warn", f"the keys of {name} were revoked", str(folder), f"formiga access agent {name}")
        elif one is not None:
            yield Finding(
                "warn", f"the certificate of {name} has expired", str(folder), f"formiga access agent {name} --renew"
            )
        else:
            yield Finding("warn", f"{name} has no keys: it is not let in", str(folder), f"formiga access agent {name}")


def _router(folder: Path) -> Iterator[Finding]:
    running = read_running(folder)
    if running is None:
        yield Finding(
            "warn", "no router runs with these keys on this machine: no agent is heard", str(folder), "formiga router"
        )
        return
    known = {one.common_name for one in read_holders(folder).counting(time.time())}
    other = sorted(known ^ set(running.names))
    what = (
        f"the router (process {running.pid}) has older rules: {', '.join(other)} differ" if other else "the router runs"
    )
    yield Finding("warn" if other else "ok", what, running.endpoint, "formiga router --restart")
