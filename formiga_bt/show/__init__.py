"""Drawings of tasks for people: `terminal` prints a checked task as a tree."""
