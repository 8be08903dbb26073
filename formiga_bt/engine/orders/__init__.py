"""What ranks above every task: stops, lockdown, breaches."""
