"""What a viewer loads: exemplar and recipes of tiles under one manifest, and the archive of the public GSWT renderer.

`build.write_bundle` makes a bundle of a `content.BundleContent`: tile sets, materials and objects.
`store.read_bundle` reads one back, with checks, and composes its tiles.
`encoding`, `blocks` and `recipes` state the bytes, `manifest` the JSON, `orders` how many orders are kept.
"""
