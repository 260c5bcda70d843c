"""DAV-GSWT: Gaussian-splat Wang tiles from a few photos.

The functions of `dav_gswt.api` are offered here: `dav_gswt.read_field(path)`. One subpackage a stage has the rest.
"""

from importlib import import_module
from typing import Any

__version__ = "0.2.0"


def __getattr__(name: str) -> Any:
    """Load a function of `dav_gswt.api` when it is first used: loading takes time, and jobs use none.

    By name: an `import` would make the code of every job depend on all of the library (`code_digest`).
    """
    if not name.startswith("_") and name != "api":
        api = import_module(f"{__name__}.api")
        if name in api.__all__:
            return getattr(api, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
