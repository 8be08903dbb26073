"""Kinds of missions: what is drawn for one, its tree, and how it is said with the tables of `phrases`."""
