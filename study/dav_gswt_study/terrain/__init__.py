"""Measurements of bundle and terrain: levels, pre-sorted orders, frame times, tile uncertainty."""
