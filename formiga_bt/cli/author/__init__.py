"""Verbs of those who write tasks: check, show, dry-run, test, draft."""
