"""What the API answers: its models, made from the view's records."""
