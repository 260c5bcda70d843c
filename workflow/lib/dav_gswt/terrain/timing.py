"""Time and size of one rendered picture: milliseconds of each stage, and the number of Gaussians."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field


@dataclass
class FrameTiming:
    """Accumulates while a picture is rendered. milliseconds: by stage; gaussians: placed for the picture."""

    milliseconds: dict[str, float] = field(default_factory=dict)
    gaussians: int = 0

    @contextmanager
    def measure(self, stage: str) -> Iterator[None]:
        """Add the time of this block to a stage."""
        start = time.perf_counter()
        yield
        self.milliseconds[stage] = self.milliseconds.get(stage, 0.0) + 1e3 * (time.perf_counter() - start)
