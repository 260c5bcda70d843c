"""DAV-GSWT: Gaussian-splat Wang tiles from a few photos.

The functions of `dav_gswt.api` are offered here: `dav_gswt.read_field(path)`. One subpackage a stage has the rest.
"""

from typing import Any

__version__ = "0.1.0"


def __getattr__(name: str) -> Any:
    """Load a function of `dav_gswt.api` when it is first used: loading takes time, and jobs use none."""
    if not name.startswith("_") and name != "api":
        from dav_gswt import api

        if name in api.__all__:
            return getattr(api, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
