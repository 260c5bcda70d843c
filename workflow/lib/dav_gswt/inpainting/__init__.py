"""Inpainting: a prior generates the ground that no photo saw. Its Gaussians are marked and never count as captured."""
