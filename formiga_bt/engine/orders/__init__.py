"""What ranks above every task: stops, lockdown, breaches, and who may let a task fly."""
