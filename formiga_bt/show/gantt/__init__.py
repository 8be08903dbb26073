"""Actions of agents over time: `plan` says which bar goes where, `text` and `figure` draw it."""
