"""News that leave the engine: from the outbox of the journal to receivers elsewhere, in a thread of its own."""
