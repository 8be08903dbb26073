"""Tasks: from request to terminal status, who may let one fly, their trees, their cleanup, and the engine's own tasks."""
