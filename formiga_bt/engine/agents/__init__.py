"""Agents: who is there, which process speaks for whom, who can be trusted."""
