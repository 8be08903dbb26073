"""Parts of `benchmarks/torture.py`: sites of real processes that are treated badly, and judges who believe nobody's word.

- `site` makes a folder, `engine` starts and kills its engine, `crew` its simulated agents (`wild_agent` is one).
- `client` works with it and notes what was acknowledged; `readers` look into its past.
- `faults` break things (`deaf`: connections; `privileged`: network, disk; `wall`: the clock).
- `play` makes a round of all of it, and `judge` says what was wrong.
- `scenarios` are short stories, each of a defect that was found once; `kills` is many deaths in a short time; `soak` is hours.

Everything is imported from the tree that `PYTHONPATH` names, so that an older one can be looked at (`torture.py --tree`).
"""
