"""Which peers there are."""

from benchmarks.peers.asyncbtree import AsyncBtree
from benchmarks.peers.bonsai import Bonsai
from benchmarks.peers.btcpp import BtCpp
from benchmarks.peers.ours import Ours
from benchmarks.peers.protocol import Peer
from benchmarks.peers.pytrees import PyTrees
from benchmarks.peers.threaded import Threaded


def all_peers() -> dict[str, Peer]:
    """Return ours and the others, by short name."""
    return {
        "ours": Ours(),
        "py_trees": PyTrees(),
        "btcpp": BtCpp(),
        "btcpp_native": BtCpp(native=True),
        "bonsai": Bonsai(),
        "async_btree": AsyncBtree(),
        "threads": Threaded(),
    }


def missing(peer: Peer) -> str:
    """Return what must be installed for a peer, or nothing."""
    try:
        peer.version()
    except ImportError as e:
        return f"{peer.name} is not installed ({e}): pip install -e '.[btcpp,peers]'"
    return ""
