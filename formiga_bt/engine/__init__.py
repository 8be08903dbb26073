"""The engine: a deterministic function from inputs to steps."""
