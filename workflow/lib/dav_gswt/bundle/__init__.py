"""What a viewer loads: chunks with pre-sorted orders under one manifest, and the ways out to other programs.

`build.write_bundle` makes a bundle from a TileSet; `store.read` reads one back, with checks, chunk by chunk. `encoding`
is how Gaussians become 16 bytes, `ladder` how many orders are kept, `gswt` and `exports` what other viewers read.
"""
