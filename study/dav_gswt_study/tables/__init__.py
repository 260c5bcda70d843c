"""The paper's tables with their own columns from our own runs, the paper's values beside them, marked as such."""
