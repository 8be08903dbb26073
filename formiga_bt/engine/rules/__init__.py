"""Standing rules at work: what happens to agents, and the tasks that are requested then."""
