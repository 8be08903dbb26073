import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from rigs import MemoryRig, PlainZenohRig, Rig, SecuredZenohRig, ZenohRig


@pytest.fixture(scope="module")
def zenoh_rig() -> Iterator[ZenohRig]:
    """One engine for the tests of a module: opening one takes half a second."""
    rig = ZenohRig()
    yield rig
    rig.close()


@pytest.fixture(scope="module")
def plain_rig() -> Iterator[ZenohRig]:
    """The same engine's end, with peers that know nothing of formiga_bt."""
    rig = PlainZenohRig()
    yield rig
    rig.close()


@pytest.fixture(scope="module")
def secured_rig() -> Iterator[ZenohRig]:
    """Engine and peers with keys, and a router between them."""
    rig = SecuredZenohRig()
    yield rig
    rig.close()


NETWORK = {"zenoh": "zenoh_rig", "plain": "plain_rig", "secured": "secured_rig"}


@pytest.fixture(params=["memory", *(pytest.param(one, marks=pytest.mark.network) for one in NETWORK)])
def rig(request: pytest.FixtureRequest) -> Iterator[Rig]:
    if request.param in NETWORK:
        shared = request.getfixturevalue(NETWORK[request.param])
        shared.log.clear()
        yield shared
    else:
        rig = MemoryRig()
        yield rig
        rig.close()


@pytest.fixture
def peer(rig: Rig) -> str:
    """A peer that other tests of the module may use too; not to be killed or to be given another epoch."""
    shared = getattr(rig, "shared_peer", "")
    if not shared:
        shared = rig.shared_peer = rig.new_peer()  # type: ignore[attr-defined]
    return shared
