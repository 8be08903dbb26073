"""Text to checked model: pure, without py_trees, network or clock. The door is `loader`."""
