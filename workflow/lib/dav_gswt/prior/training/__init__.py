"""Training of the project's own prior: synthetic worlds, examples made of them, optimization."""
