"""The seam between the engine and agents, and the wires behind it."""
