"""JSON Schemas made from the tables of the language and the live catalogue: `editor` for people, `llm` for models."""
