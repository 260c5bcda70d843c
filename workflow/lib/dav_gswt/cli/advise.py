"""`dav-gswt advise`: which preset for a scene, by the time, the loss or the size that one can bear.

Seconds are estimated for this machine, and are of a whole run; losses are forecast from the measured table of presets.
"""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dav_gswt.cli import forecast
from dav_gswt.cli.estimate import count_jobs, describe_work, estimate_seconds, format_duration
from dav_gswt.cli.finished_run import FinishedRun, find_finished_run
from dav_gswt.cli.forecast import Forecast, Measured
from dav_gswt.cli.machine_speed import MachineSpeed, measure_speed
from dav_gswt.cli.run import load_config
from dav_gswt.errors import InputError
from dav_gswt.files import locate_path
from dav_gswt.images.image_files import list_photos
from dav_gswt.paths import stage_folder


@dataclass(frozen=True)
class Choice:
    """A preset for the scene. seconds: of a whole run; mb: of the bundle, by the Gaussians of the table's."""

    forecast: Forecast
    seconds: float
    mb: float

    @property
    def preset(self) -> str:
        return self.forecast.preset


@dataclass(frozen=True)
class Limits:
    """What one can bear; None: as much as there is.

    seconds: of a run. psnr: dB, at least; loss: dB under the best preset. mb: of the bundle, megabytes.
    """

    seconds: float | None = None
    psnr: float | None = None
    loss: float | None = None
    mb: float | None = None

    def excess(self, choice: Choice) -> float:
        """How far a choice is beyond the limits: 0 within all of them, else the sum of its shares beyond."""
        pairs = [(choice.seconds, self.seconds), (choice.mb, self.mb), (choice.forecast.loss, self.loss)]
        over = [max(0.0, value / limit - 1) for value, limit in pairs if limit is not None]
        short = 0.0 if self.psnr is None else max(0.0, self.psnr - choice.forecast.psnr)
        return sum(over) + short


def add_command(commands) -> None:
    """Add the command to a parser's commands."""
    about = "which preset for a scene, by time, loss or size (docs/settings.md)"
    parser = commands.add_parser("advise", help=about, description=__doc__)
    parser.add_argument("--scene", help="a scene of config/scenes or config/config.yaml (default: its `scene`)")
    parser.add_argument("--seconds", type=_parse_positive, help="most that a whole run may take on this machine")
    parser.add_argument("--loss", type=_parse_positive, help="most dB of PSNR under the best preset")
    parser.add_argument("--psnr", type=_parse_positive, help="least PSNR; wants a finished run of the scene")
    parser.add_argument("--mb", type=_parse_positive, help="most megabytes of the bundle")
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--configfile", nargs="+", type=Path, default=[], help="override config/config.yaml, in order")
    parser.set_defaults(run=run_advise)


def run_advise(options: argparse.Namespace) -> int:
    """Print the presets and the advised one; exit status 1 where none is within the limits.

    Raises: InputError: no such scene, no table of presets, or a PSNR is wanted and no run of the scene is finished.
    """
    config = load_config(options.configfile, {"scene": options.scene} if options.scene else {})
    front, speed = forecast.read_front(), measure_speed(options.cores)
    known = find_finished_run(config, speed)
    if options.psnr is not None and known is None:
        raise InputError(
            f"{config['scene']}: no run of it is finished, so its PSNR is not known beforehand; make one (`draft` is "
            "the fastest), or ask by --loss"
        )
    choices = list_choices(config, front, known, speed)
    limits = Limits(options.seconds, options.psnr, options.loss, options.mb)
    best = choose(choices, limits)
    lines = [*format_choices(choices, known), "", describe_choice(config, best, limits)]
    print("\n".join([*lines, describe_trust(front, known and known.preset)]))
    return int(limits.excess(best) > 0)


def list_choices(
    config: Mapping[str, Any], front: list[Measured], known: FinishedRun | None, speed: MachineSpeed
) -> list[Choice]:
    """The presets of both config and table, fastest first. Raises: InputError: there is none."""
    sizes = {name: entry["size"] for name, entry in config["presets"].items()}
    lost = measure_scene(config, set(sizes.values()), front[0].size if front else 1)
    level, times = (known.preset, known.psnr) if known else None, (known.preset, known.slowness) if known else None
    found = forecast.forecast_presets(front, {name: lost[size] for name, size in sizes.items()}, level)
    slowness = forecast.forecast_slowness(front, times)
    if not found:
        raise InputError(f"{forecast.FRONT}: none of the config's presets is in the table ({', '.join(sizes)})")
    choices = [
        Choice(each, slowness[name] * _estimate_run(config, name, speed), _estimate_mb(config, front, name))
        for name, each in found.items()
    ]
    return sorted(choices, key=lambda choice: choice.seconds)


def measure_scene(config: Mapping[str, Any], sizes: set[int], size: int) -> dict[int, float]:
    """What the scene's photos lose by shrinking to each size: 0 for those that are not yet rendered."""
    scene = config["scenes"][config["scene"]]
    placed = stage_folder("photos", {"scene": config["scene"]}) / "images"
    folder = placed if placed.is_dir() else locate_path(scene.get("folder", ""))
    if not (placed.is_dir() or "folder" in scene):
        return dict.fromkeys(sizes, 0.0)
    return forecast.measure_shrinking(list_photos(folder), sizes, min(size, scene.get("size", size)))


def _parse_positive(text: str) -> float:
    value = float(text)
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is no number above 0")
    return value


def _estimate_run(config: Mapping[str, Any], preset: str, speed: MachineSpeed) -> float:
    """Seconds of a whole run, before the table's scenes are asked how much longer runs take than that."""
    return estimate_seconds(count_jobs(config, preset), describe_work(config, preset), speed)


def _estimate_mb(config: Mapping[str, Any], front: list[Measured], preset: str) -> float:
    """Megabytes of a bundle: the table's for each Gaussian, times the Gaussians expected."""
    rows = [row for row in front if row.preset == preset]
    each = sum(row.bundle_mb / row.gaussians for row in rows) / len(rows)
    return each * describe_work(config, preset).gaussians


def choose(choices: list[Choice], limits: Limits) -> Choice:
    """The best of those within the limits: by PSNR where time is limited, else by time. None within: the nearest."""
    within = [choice for choice in choices if limits.excess(choice) == 0]
    if not within:
        return min(choices, key=limits.excess)
    timed = limits.seconds is not None or limits == Limits()
    return min(within, key=lambda choice: (choice.forecast.loss, choice.seconds) if timed else (choice.seconds, 0.0))


def format_choices(choices: list[Choice], known: FinishedRun | None) -> list[str]:
    """Lines of a table."""
    level = f", expected (known: {known.preset}, {known.psnr:.2f} dB)" if known else ""
    lines = [f"{'preset':<12}{'a whole run':<20}{'under the best':<17}{'LPIPS over it':<16}{'bundle':<10}PSNR{level}"]
    for c in choices:
        psnr = f"{c.forecast.psnr:.1f} dB" if known else "unknown"
        lines.append(
            f"{c.preset:<12}{format_duration(c.seconds):<20}{c.forecast.loss:<4.1f} dB{'':<10}{c.forecast.lpips:<16.3f}"
            f"{c.mb:<4.0f} MB   {psnr}"
        )
    return lines


def describe_choice(config: Mapping[str, Any], best: Choice, limits: Limits) -> str:
    """The advice in words: what to set, and what it loses."""
    where = f"`preset: {best.preset}` of the scene {config['scene']!r}"
    if limits.excess(best) > 0:
        return (
            f"No preset is within these limits; nearest is {where}: {format_duration(best.seconds)}, {best.mb:.0f} MB."
        )
    lost = (
        f"loses {best.forecast.loss:.1f} dB to the best" if best.forecast.loss > 0.05 else "loses nothing to the others"
    )
    return f"Advice: {where}. It takes {format_duration(best.seconds)} and {lost}."


def describe_trust(front: list[Measured], known: str | None = None) -> str:
    """How far off forecasts were on the table's own scenes, each left out in turn. known: preset of a finished run."""
    left_out = [row for row in forecast.leave_one_out(front, known) if row.preset != known]  # that one is no forecast
    off, late = [abs(row.off) for row in left_out], [abs(row.late) for row in left_out if row.late is not None]
    scenes = len({row.scene for row in front})
    if not off:
        return (
            "Losses are those of one scene (docs/research/results/presets.md): how right they are elsewhere is unknown."
        )
    return (
        f"Losses are forecast from {scenes} scenes (docs/research/results/presets.md); on each of them, left out, they "
        f"were off by {sum(off) / len(off):.1f} dB in the mean, {max(off):.1f} at most"
        + (f", and seconds by {sum(late) / len(late):.0%}, {max(late):.0%} at most." if late else ".")
    )
