"""Synthetic photo sets: six families of ground, rendered with exact poses."""
