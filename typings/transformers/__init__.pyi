"""Of this package the type checker reads nothing: it is large, and its names are used without types."""

from typing import Any

def __getattr__(name: str) -> Any: ...
