"""Choosing agents for tasks: filters, cost, and policies behind one seam. Pure functions over records."""
