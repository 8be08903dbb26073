"""The same trees in other engines, each behind one protocol: what `bench_peers.py` compares."""
