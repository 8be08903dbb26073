"""A tuned adapter for small models: pairs of requests and trees from the language itself, training, scores."""
