"""Sweeps: the cells of a row of the config's `sweeps`, one table of what they measured, one figure."""
