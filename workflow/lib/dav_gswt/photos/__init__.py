"""Photos in: structure from motion, a synthetic scene or a finished field, all in a z-up ground frame."""
