"""Synthetic photo sets: five families of ground, rendered with exact poses."""
