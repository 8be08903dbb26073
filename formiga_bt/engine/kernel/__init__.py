"""What every part of the engine stands on: records, changes, the state and `apply`, inputs and steps, the core of one step."""
