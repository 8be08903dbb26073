"""What a task does to its machines: who is where, in the air or on the ground, and who commands whom."""
