"""Drivers: they own time and transports, feed the engine, persist each step, carry out its effects."""
