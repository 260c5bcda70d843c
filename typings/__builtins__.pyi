"""What Snakemake injects into scripts."""

from typing import Any

snakemake: Any
