"""A look at what the workflow writes, in three dimensions: `dav-gswt inspect PATH` (docs/inspect.md).

Builders (`fields`, `spheres`, `sites`, `tiles`, `maps`) read an artefact by the project's readers and give a `Scene`,
plain arrays that know nothing of VTK; `drawing` and `saving` turn it into a window, a picture or a page. They alone
need the extra `inspect` (PyVista), and `command` loads them after it has looked whether it is there.
"""
