"""Text: YAML with marks, what is wrong with its syntax, its canonical layout, and fixes."""
