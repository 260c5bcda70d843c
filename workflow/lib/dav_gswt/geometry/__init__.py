"""Cameras, candidate poses and georeference: geometry that knows nothing of files or Gaussians."""
