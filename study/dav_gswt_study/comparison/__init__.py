"""Comparison of policies: PSNR against the number of photos, and paired differences with intervals."""
