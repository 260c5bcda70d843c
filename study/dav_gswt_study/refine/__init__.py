"""Boundary refinement of a tile set by a prior: pictures of the seams are repaired and Gaussians refitted to them."""
