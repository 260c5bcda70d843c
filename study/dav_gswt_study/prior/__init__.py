"""The prior on worlds that it was not trained on."""
