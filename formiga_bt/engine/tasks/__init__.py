"""Tasks: from request to terminal status, their trees, their cleanup, and the engine's own tasks."""
