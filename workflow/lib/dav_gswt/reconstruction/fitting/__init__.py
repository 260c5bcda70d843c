"""Fitting of a Gaussian field to photos, without knowledge of grounds.

`trainer.fit_field` is the training loop; the caller's `constraints` say where Gaussians may be and how they may look.
"""
