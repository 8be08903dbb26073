import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from rigs import MemoryRig, Rig, ZenohRig


@pytest.fixture(scope="module")
def zenoh_rig() -> Iterator[ZenohRig]:
    """One engine for the tests of a module: opening one takes half a second."""
    rig = ZenohRig()
    yield rig
    rig.close()


@pytest.fixture(params=["memory", pytest.param("zenoh", marks=pytest.mark.network)])
def rig(request: pytest.FixtureRequest) -> Iterator[Rig]:
    if request.param == "zenoh":
        shared = request.getfixturevalue("zenoh_rig")
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
