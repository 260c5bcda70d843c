"""Numerical stability: every formula against float64, and the whole workflow at the extremes of its settings."""
