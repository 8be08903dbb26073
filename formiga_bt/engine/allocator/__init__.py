"""Who gets which agents: filters, costs, policies."""
