"""Exports: the terrain in the formats of other programs."""
