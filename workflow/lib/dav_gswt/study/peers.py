"""Other programs that fit Gaussians, beside ours: the same photos, the same test views, quality over seconds.

OpenSplat is a program of the user's (AGPL, nothing of it is here). It sees the training photos at the size of our fit
as a COLMAP project, with the same points to start from, and saves its field every so many steps; each is rendered by
our rasterizer. gsplat's fits need CUDA, its reference in PyTorch included: they cannot be compared on a CPU.
"""

import shutil
import subprocess
import time
from pathlib import Path

import numpy as np

from dav_gswt import raster
from dav_gswt.errors import InputError
from dav_gswt.field import read_field
from dav_gswt.images import figures, image_files
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.study import markdown
from dav_gswt.study.fit_profile import PhotoSet, find_time_to, measure_quality

OPENSPLAT = "opensplat"
OURS = "dav-gswt"
LEVELS = (28.0, 31.0, 33.0, 34.0)  # dB of the test photos, colour-corrected
OFTEN = 0.05  # seconds between looks for a new file
SETTLED = 0.5  # seconds before the end from which a file may not be whole


def write_project(photos: PhotoSet, folder: Path | str) -> None:
    """The training photos as a COLMAP project: images/ and sparse/0, without tracks."""
    folder = Path(folder)
    for part in ("images", "sparse/0"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    none = np.zeros(0, int)
    names = tuple(f"{Path(view.name).stem}.png" for view in photos.train)
    for name, view in zip(names, photos.train, strict=True):
        image_files.write_png(folder / "images" / name, view.image)
    cameras = tuple(view.camera for view in photos.train)
    points = photos.model.points, photos.model.colours
    write_colmap_model(ColmapModel(names, cameras, *points, none, none, np.zeros((0, 2))), folder / "sparse/0")


def find_program(name: str) -> str:
    """The path of a program. Raises: InputError: there is none."""
    if (path := shutil.which(name)) is None:
        raise InputError(
            f"study: compare: opensplat: there is no program {name!r}; build OpenSplat and call "
            "make compare OPENSPLAT=<its path>"
        )
    return path


def run_opensplat(program: str, project: Path, seconds: float, every: int) -> list[tuple[float, int, Path]]:
    """Run OpenSplat for some seconds, and list seconds, step and file of each field that it saved.

    At full size from the start (`--num-downscales 0`): its schedule would see small photos for 3000 steps.
    Raises: InputError: it saved nothing.
    """
    asked = ["--cpu", "--keep-crs", "--num-downscales", "0", "--save-every", str(every), "--num-iters", "1000000"]
    command = [program, str(project), *asked, "-o", str(project / "splat.ply")]
    begin = time.time()
    with (project / "opensplat.log").open("wb") as log:
        process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
        while process.poll() is None and time.time() - begin < seconds:
            time.sleep(OFTEN)
        ended = process.poll()
        process.kill()
        process.wait()
    found = [(path.stat().st_mtime - begin, int(path.stem.split("_")[1]), path) for path in project.glob("splat_*.ply")]
    whole = [each for each in sorted(found) if ended is not None or each[0] < seconds - SETTLED]
    if not whole:
        last = (project / "opensplat.log").read_text(errors="replace").splitlines()[-3:]
        raise InputError(f"study: compare: opensplat: {program} saved no field in {seconds:g} s: {' / '.join(last)}")
    return whole


def judge_saved(saved: list[tuple[float, int, Path]], photos: PhotoSet) -> list[dict]:
    """Rows as of `fit_profile.profile_fit`, of fields that another program saved."""
    tests, rows = next(iter(photos.tests.values())), []
    for seconds, step, path in saved:
        field = read_field(path)
        quality = measure_quality(lambda view, field=field: raster.render(field, view.camera).colour, tests)
        rows.append({"seconds": seconds, "step": step, "gaussians": len(field)} | quality)
    return rows


def plot_programs(rows: list[dict], path: Path | str) -> None:
    """PSNR of the test photos over seconds, a line a program."""
    figure = figures.make_figure(6.4, 4.0)
    axes = figure.add_subplot()
    for program, colour in zip(dict.fromkeys(row["program"] for row in rows), figures.OKABE_ITO, strict=False):
        own = [row for row in rows if row["program"] == program]
        x, y = ([row[name] for row in own] for name in ("seconds", "psnr_colour_corrected"))
        axes.semilogx(x, y, "o-", markersize=3, color=colour, label=program)
    axes.set_xlabel("seconds")
    axes.set_ylabel("PSNR of test photos, colour-corrected (dB)")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(frameon=False)
    figures.save_figure(figure, path)


def describe(rows: list[dict], photos: PhotoSet, asked: dict, made: dict) -> dict:
    """The values of the page workflow/report/fitters.md."""
    body = []
    for program in dict.fromkeys(row["program"] for row in rows):
        own = [row for row in rows if row["program"] == program]
        best, last = max(own, key=lambda row: row["psnr_colour_corrected"]), own[-1]
        body.append(
            [
                program,
                *(_time_to(own, level) for level in LEVELS),
                f"{best['psnr_colour_corrected']:.2f} after {best['seconds']:.0f} s",
                f"{last['gaussians']:.0f}",
                f"{(last['seconds'] - own[0]['seconds']) / max(1, last['step'] - own[0]['step']):.3f}",
            ]
        )
    head = ["program", *(f"s to {level:g} dB" for level in LEVELS), "best", "Gaussians at the end", "s a step"]
    return {
        "version": made["version"],
        "renderer": ", ".join(str(value) for value in made["renderer"].values()),
        "processor": f"{made['cores']} cores of {made['processor']}",
        "scene": asked["scene"],
        "size": asked["size"],
        "seconds": f"{asked['seconds']:g}",
        "train": len(photos.train),
        "tests": len(next(iter(photos.tests.values()))),
        "table": markdown.format_table(head, body),
    }


def _time_to(curve: list[dict], level: float) -> str:
    found = find_time_to(curve, level)
    return "never" if found is None else f"{found:.1f}"
