"""Do scores of poses say where a field is wrong? Scores beside the true error, of candidates whose truth can be had."""
