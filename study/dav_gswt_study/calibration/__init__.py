"""Calibration of scores: comparison with the true error at candidates whose true pictures are available."""
