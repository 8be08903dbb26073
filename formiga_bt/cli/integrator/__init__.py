"""Verbs of those who connect formiga: simulated agents, editors, assistants, other formats."""
