"""Our fit and OpenSplat's on the CPU: the same photos, points and test photos, PSNR over seconds.

`PYTHONPATH=study:tests python study/benchmarks/compare_fits.py OPENSPLAT SCENE=PHOTOS ...` with the program, which you
build yourself (github.com/pierotofy/OpenSplat, AGPL, `-DGPU_RUNTIME=CPU`), and folders such as
results/copr_dunes/photos. Writes data/comparison_fits.csv and figures/comparison_fits.png of study/docs.

Both programs see photos of SIZE pixels from the first step on. OpenSplat saves its Gaussians again and again, and the
core renders them over OpenSplat's background. Processor seconds are those of all threads: other jobs of the machine
change them much less than seconds.
"""

import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import psutil

from dav_gswt import raster
from dav_gswt.field import read_field
from dav_gswt.files import write_table
from dav_gswt.images import figures, image_files
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt_study.figures import OKABE_ITO
from dav_gswt_study.fit_profile import PhotoSet, measure_quality, profile_fit, read_photo_set

SIZE = 256  # pixels of the longer side
OURS = FitSettings(fit_size=SIZE, spacing=1.5, max_gaussians=350_000, steps=1000, steps_per_photo=1)
SECONDS, EVERY = 600, 100  # processor seconds of OpenSplat; steps from one saved file to the next
ARGUMENTS = ["--cpu", "--keep-crs", "--num-downscales", "0", "--num-iters", "1000000", "--save-every", str(EVERY)]
BACKGROUND = (0.6130, 0.0101, 0.3984)  # OpenSplat's, model.hpp
DOCS = Path(__file__).resolve().parents[1] / "docs"


def main() -> None:
    program, *scenes = sys.argv[1:]
    rows = []
    for scene, folder in (given.split("=") for given in scenes):
        photos = read_photo_set(folder, SIZE)
        for name in ("DAV-GSWT", "OpenSplat"):
            begun = os.getloadavg()[0]
            curve = profile_fit(photos, OURS) if name == "DAV-GSWT" else profile_opensplat(program, photos)
            load = max(begun, os.getloadavg()[0])
            print(f"{scene} {name}: load {load:.1f}, {curve[-1]}", flush=True)
            rows += [{"scene": scene, "program": name, "load": round(load, 1)} | row for row in curve]
        write_table(DOCS / "data/comparison_fits.csv", rows)
    plot_curves(rows, DOCS / "figures/comparison_fits.png")


def profile_opensplat(program: str, photos: PhotoSet) -> list[dict]:
    """Rows of OpenSplat, as of `profile_fit`. Raises: SystemExit: it saved nothing."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        write_project(photos, folder)
        with (folder / "log").open("wb") as log:
            command = [program, str(folder), *ARGUMENTS, "-o", str(folder / "splat.ply")]
            begun, used, seen = time.perf_counter(), 0.0, {}
            process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
            while process.poll() is None and used < SECONDS:
                used = sum(psutil.Process(process.pid).cpu_times()[:2])
                spent = time.perf_counter() - begun, used
                done = re.findall(r"Wrote \S+_(\d+)\.ply\n", (folder / "log").read_text())
                seen |= {int(step): spent for step in done if int(step) not in seen}
                time.sleep(0.1)
            process.kill()
            process.wait()
        if not seen:
            raise SystemExit(f"{program} saved nothing: {(folder / 'log').read_text()[-500:]}")
        return [measure_saved(folder / f"splat_{step}.ply", step, *spent, photos) for step, spent in seen.items()]


def write_project(photos: PhotoSet, folder: Path) -> None:
    """The training photos and all points as a COLMAP project, without tracks."""
    names = tuple(f"{Path(view.name).stem}.png" for view in photos.train)
    (folder / "images").mkdir()
    (folder / "sparse/0").mkdir(parents=True)
    for name, view in zip(names, photos.train, strict=True):
        image_files.write_png(folder / "images" / name, view.image)
    cameras, none = tuple(view.camera for view in photos.train), np.zeros(0, int)
    model = ColmapModel(names, cameras, photos.model.points, photos.model.colours, none, none, np.zeros((0, 2)))
    write_colmap_model(model, folder / "sparse/0")


def measure_saved(path: Path, step: int, seconds: float, used: float, photos: PhotoSet) -> dict:
    """A row of Gaussians that OpenSplat saved."""
    field = read_field(path)
    row = {"seconds": seconds, "processor_seconds": used, "step": step, "gaussians": len(field)}
    return row | measure_quality(lambda view: raster.render(field, view.camera, BACKGROUND).colour, photos.tests)


def plot_curves(rows: list[dict], path: Path) -> None:
    """PSNR of the test photos over processor seconds: a panel a scene, a line a program."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    figure = figures.make_figure(4.0 * len(scenes), 3.4)
    for k, scene in enumerate(scenes):
        axes = figure.add_subplot(1, len(scenes), k + 1, title=scene, xlabel="processor seconds")
        for program, colour in zip(dict.fromkeys(row["program"] for row in rows), OKABE_ITO, strict=False):
            own = [row for row in rows if (row["scene"], row["program"]) == (scene, program)]
            x, y = ([row[name] for row in own] for name in ("processor_seconds", "psnr_colour_corrected"))
            axes.semilogx(x, y, "o-", markersize=3, color=colour, label=program)
        axes.grid(True, which="both", alpha=0.3)
    figure.axes[0].set_ylabel("PSNR of the test photos (dB)")
    figure.axes[-1].legend(frameon=False, loc="lower right")
    figures.save_figure(figure, path)


if __name__ == "__main__":
    main()
