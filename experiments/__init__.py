"""Experiments that compare formiga_bt with what was published."""
