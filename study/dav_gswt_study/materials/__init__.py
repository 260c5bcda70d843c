"""Materials and objects of synthetic scenes against their true labels."""
