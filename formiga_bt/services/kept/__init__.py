"""What outlives one start of the engine: the journal, loaded tasks, the flight log, where to go on."""
