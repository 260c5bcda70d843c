"""What a finished run of a scene tells about others of it: its PSNR, and how long its jobs took."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dav_gswt.cli.estimate import COSTS, describe_work, estimate_seconds
from dav_gswt.cli.forecast import BASELINE
from dav_gswt.cli.machine_speed import MachineSpeed
from dav_gswt.files import read_json
from dav_gswt.paths import RESULTS, TREE, encode_branch, stage_folder


@dataclass(frozen=True)
class FinishedRun:
    """A run of the scene with a preset.

    psnr: dB, at the preset's own size. slowness: how many times as long its jobs took as the estimate has it; None:
    they were not timed.
    """

    preset: str
    psnr: float
    slowness: float | None


def find_finished_run(config: Mapping[str, Any], speed: MachineSpeed) -> FinishedRun | None:
    """The run of the config's scene with the baseline's preset, or else with any other; None: there is none."""
    names = sorted(config["presets"], key=lambda name: name != BASELINE)
    scene = config["scenes"][config["scene"]]
    for name in names:
        values = encode_branch(config, config["scene"], changes={"preset": name}) | {"seed": config["seeds"][0]}
        path = stage_folder("round", values) / "metrics.json"
        if scene["kind"] != "field" and path.is_file():
            psnr = read_json(path)["psnr_colour_corrected" if scene["kind"] == "photos" else "psnr"]
            if psnr is not None:
                return FinishedRun(name, float(psnr), _measure_slowness(config, name, values, speed))
    return None


def _measure_slowness(
    config: Mapping[str, Any], preset: str, values: Mapping[str, Any], speed: MachineSpeed
) -> float | None:
    """Seconds of the run's jobs over those that the estimate has for them."""
    work, taken, expected = describe_work(config, preset), 0.0, 0.0
    places = [stage_folder(stage, values).relative_to(RESULTS) for stage in ("active", "coarse")]
    for path in sorted(path for place in places for path in Path(TREE["benchmarks"], place).rglob("*.tsv")):
        seconds = _read_seconds(path) if path.stem in COSTS else None
        if seconds is not None:
            taken += seconds
            expected += estimate_seconds({path.stem: 1}, work, speed)
    return taken / expected if expected else None


def _read_seconds(path: Path) -> float | None:
    """Seconds of a job by its benchmark; None: the file does not say."""
    try:
        with path.open(newline="", encoding="utf-8") as text:
            return float(next(csv.DictReader(text, delimiter="\t"))["s"])
    except (OSError, StopIteration, KeyError, ValueError, TypeError):
        return None
