"""Generative priors: models that sample what a view may show, given the field's render and the nearest photo."""
