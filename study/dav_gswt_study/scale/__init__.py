"""How costs grow: seconds and memory over the number of photos, pixels, Gaussians and candidates."""
