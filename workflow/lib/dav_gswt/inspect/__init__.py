"""Show results of the workflow in three dimensions: `dav-gswt inspect PATH` (docs/inspect.md).

The modules `*_scenes` read an artefact with the project's readers and make a `Scene`: plain arrays, independent of VTK.
`plotting` and `saving` turn it into a window, a picture or a page. Only these need the extra `inspect` (PyVista);
`command` imports them after it has checked that the extra is installed.
"""
