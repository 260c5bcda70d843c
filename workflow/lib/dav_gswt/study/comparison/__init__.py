"""What policies are worth: curves of quality against photos, and paired comparisons with intervals."""
