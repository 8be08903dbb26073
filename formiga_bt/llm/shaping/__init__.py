"""From the short form of a task, as a model wrote it, to the language: what is meant in one way only is put right, and told."""
