"""Wang tiles: patches of the exemplar put together along exact cuts, so that neighbours continue one another.

`build.cut_tiles` makes a TileSet from the levels of a field, `store` writes and reads it.
"""
