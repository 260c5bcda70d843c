"""Reconstruction: from posed photos to a Gaussian field over a ground (`coarse`), and its updates (`update`)."""
