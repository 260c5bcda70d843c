"""What a viewer loads: chunks with pre-sorted orders under one manifest, and the zip of the public GSWT renderer.

`build.write_bundle` makes a bundle from a TileSet; `manifest` and `chunks` read it back with checks.
"""
