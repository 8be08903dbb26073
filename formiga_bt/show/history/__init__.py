"""What happened, folded from steps: the ledger that every picture is read from."""
