"""Fitting: from Gaussians that are about right to Gaussians that look like the photos; knows nothing of terrains.

`trainer.fit` is the loop; `rules` of the caller say where Gaussians may be and what they may look like.
"""
