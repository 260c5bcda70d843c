"""Training pipeline of the terrain prior: procedural worlds, examples rendered from them, optimization."""
