"""Show results of the workflow in three dimensions: `dav-gswt inspect PATH` (docs/inspect.md).

A function in `readers` opens each kind of artefact and returns a `plot.Scene` of PyVista meshes.
`plot` draws it in a window, as a picture or as a page. `command` imports them after it has checked that the extra
`inspect` is installed. A new artefact takes one function, decorated with `@reader("its name")`.
"""
