"""Coarse field: a ground layer laid through the start views' points, and what stands on it, fitted to the photos."""
