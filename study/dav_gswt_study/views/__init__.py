"""Figures of view selection: the uncertainty sphere, and test views over the rounds."""
