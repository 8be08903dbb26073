"""Verbs of those who decide: stops, continue, answers, approvals, duty."""
