"""What stands in a request in words: names, amounts, figures, people to be asked, orders. No model takes part in it."""
