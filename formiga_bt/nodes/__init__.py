"""The nodes of running trees: py_trees behaviours that are stepped directly."""
