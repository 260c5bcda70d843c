"""Forced-choice study: participants choose the crop with the less visible seam; kit, answers and results."""
