"""Boundary refinement: pictures of a tile set's cuts, repaired by a prior, and the Gaussians beside them refitted."""
