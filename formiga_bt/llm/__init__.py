"""Missions in words: a language model writes trees, the checker and a dry run judge them, a person approves."""
