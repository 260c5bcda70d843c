"""Figures of all benchmarks in one file, results/bench.json: name: value. Running this module does nothing."""

from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.files import read_json, write_json
from dav_gswt.images import lpips_weights

PATH = Path(__file__).resolve().parents[1] / "results" / "bench.json"


def report_figures(values: dict[str, float | None], targets: dict[str, float]) -> None:
    """Print figures, each beside its target, and record them. None: never reached."""
    for name, value in values.items():
        shown = "never" if value is None else f"{value:.4g}"
        print(f"{name}: {shown}" + (f" (target {targets[name]:g})" if name in targets else ""))
    merge_figures(values)


def merge_figures(values: dict[str, float | None]) -> None:
    """Merge figures into the file, which appears whole or not at all; those of other benchmarks stay."""
    before = read_json(PATH) if PATH.exists() else {}
    write_json(PATH, dict(sorted((before | values).items())))


def read_installed_lpips() -> lpips_weights.Weights | None:
    """LPIPS's published weights, or None, said in a line, where they are not installed."""
    try:
        return lpips_weights.read(lpips_weights.locate_weights("installed"))
    except InputError as error:
        print(f"lpips: skipped ({error})")
        return None
