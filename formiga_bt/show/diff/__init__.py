"""What changed between two tasks, as trees: added, removed, moved, changed, renamed. `changes.compare` is the door."""
