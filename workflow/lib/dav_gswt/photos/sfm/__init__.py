"""Structure from motion with pycolmap: features, pairs, mapping, focal guard, GPS."""
