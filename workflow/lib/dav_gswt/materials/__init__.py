"""Materials: the classes of ground of an exemplar, and the single objects that stand on them."""
