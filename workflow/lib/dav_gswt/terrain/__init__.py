"""The endless terrain: which tile lies where, stills of it, and the page to walk in."""
