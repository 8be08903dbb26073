"""The whole engine with simulated agents on the virtual clock, under a fault plan that a seed draws."""
