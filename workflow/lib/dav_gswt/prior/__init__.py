"""Generative priors: what a view may show that no photo has shown."""
