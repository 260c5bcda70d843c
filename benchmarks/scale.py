"""How costs grow: exponents of a fit's seconds over photos and pixels, and what 46 and 200 photos take.

The cells are made by the workflow (`snakemake scale`, half an hour) if they are not there yet. Every figure goes to
results/bench.json.
"""

import subprocess
import sys

from dav_gswt.study.scale import growth
from record import report_figures

from dav_gswt import csv_tables

TABLE = "docs/research/data/scale.csv"
TARGETS = {"fit_200_photos_memory_mb": 2000.0, "standard_46_photos_seconds": 120.0}


def main() -> None:
    subprocess.run([sys.executable, "-m", "snakemake", "--cores", "2", "--quiet", "all", "--", "scale"], check=True)
    rows = csv_tables.read_table(TABLE, texts=("kind",))
    exponents = growth.fit_exponents(rows)
    photos = {row["photos"]: row for row in rows if row["kind"] == "photos"}
    found = {
        "fit_photos_exponent": exponents["photos"]["seconds"],
        "fit_pixels_exponent": exponents["pixels"]["seconds"],
        "render_gaussians_exponent": exponents["gaussians"]["seconds"],
        "score_candidates_exponent": exponents["candidates"]["seconds"],
        "fit_200_photos_memory_mb": photos[200]["peak_mb"],
        "standard_46_photos_seconds": photos[46]["seconds"],
    }
    report_figures(found, TARGETS)


if __name__ == "__main__":
    main()
