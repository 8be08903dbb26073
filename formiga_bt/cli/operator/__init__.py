"""Verbs of those who run a site: start, request, look, explain, replay."""
