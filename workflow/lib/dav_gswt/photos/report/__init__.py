"""The photo report: how the photos fit together, what was left out, what is weak."""
