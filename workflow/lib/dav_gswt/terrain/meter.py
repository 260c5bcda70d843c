"""What drawing a picture takes: milliseconds of each part, and Gaussians."""

import time
from contextlib import contextmanager
from dataclasses import dataclass, field


@dataclass
class Meter:
    """Adds up while a picture is drawn. milliseconds: by part; gaussians: that were laid out for it."""

    milliseconds: dict[str, float] = field(default_factory=dict)
    gaussians: int = 0

    @contextmanager
    def of(self, part: str):
        """The time of this block counts as a part's."""
        start = time.perf_counter()
        yield
        self.milliseconds[part] = self.milliseconds.get(part, 0.0) + 1e3 * (time.perf_counter() - start)
