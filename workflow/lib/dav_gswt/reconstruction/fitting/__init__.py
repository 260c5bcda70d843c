"""Fitting of a Gaussian field to photos. `trainer.fit_field` is the training loop."""
