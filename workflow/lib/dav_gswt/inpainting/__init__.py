"""What no photo saw is filled in from a prior, and marked: it is no capture, and nothing counts it as such."""
