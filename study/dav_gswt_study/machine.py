"""The machine that a measurement was made on."""

import os
import platform
from pathlib import Path


def describe_machine() -> dict:
    """The processor's name and how many cores it has: what seconds are to be read with."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return {"processor": names[0] if names else platform.processor() or platform.machine(), "cores": os.cpu_count()}
