"""Photos: structure from motion, a synthetic scene or a finished field, each in a ground frame with z up."""
