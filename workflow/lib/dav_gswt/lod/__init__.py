"""Levels of detail: ever coarser fields of the same ground, each fitted to what its finer neighbour shows."""
