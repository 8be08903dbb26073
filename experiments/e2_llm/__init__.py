"""Experiment 2: tasks written by language models, judged in the simulator (docs/experiments.md)."""
