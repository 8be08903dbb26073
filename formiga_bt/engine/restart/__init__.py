"""Going on after the engine was away, and while its journal cannot keep up."""
