"""The photo report: how well the photos were registered, which were left out, which are weak."""
