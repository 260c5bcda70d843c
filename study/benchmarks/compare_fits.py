"""Our fit and OpenSplat's on the CPU: the same photos, points and test photo, PSNR over seconds.

`PYTHONPATH=study:tests python study/benchmarks/compare_fits.py OPENSPLAT SCENE=PHOTOS ...` with the program, which you
build yourself (github.com/pierotofy/OpenSplat, AGPL, `-DGPU_RUNTIME=CPU`), and folders such as
results/copr_dunes/photos. Writes data/comparison_fits.csv and figures/comparison_fits.png of study/docs.

Both programs see photos of SIZE pixels from the first step on. OpenSplat renders the test photo itself: its pictures
are nearer to the photo than renders of its files by other programs. Processor seconds are summed over all threads:
other jobs of the machine change them much less than seconds.
"""

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil

from dav_gswt.files import write_table
from dav_gswt.images import figures, image_files
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.photos.training_views import TrainingView
from dav_gswt_study.figures import OKABE_ITO
from dav_gswt_study.fit_profile import FitSettings, PhotoSet, measure_quality, profile_fit, read_photo_set

SIZE = 256  # pixels of the longer side
OURS = FitSettings(fit_size=SIZE, spacing=1.5, max_gaussians=350_000, steps=1000, steps_per_photo=1)
SECONDS = 600  # processor seconds of OpenSplat
ARGUMENTS = ["--cpu", "--keep-crs", "--num-downscales", "0", "--num-iters", "1000000", "--val"]
EVERY = 5  # of its pictures that are measured
DOCS = Path(__file__).resolve().parents[1] / "docs"


def main() -> None:
    program, *scenes = sys.argv[1:]
    rows = []
    for scene, folder in (given.split("=") for given in scenes):
        photos = read_photo_set(folder, SIZE)
        photos = replace(photos, tests=photos.tests[len(photos.tests) // 2 :][:1])
        for name in ("DAV-GSWT", "OpenSplat"):
            begun = os.getloadavg()[0]
            curve = profile_fit(photos, OURS) if name == "DAV-GSWT" else profile_opensplat(program, photos)
            load = max(begun, os.getloadavg()[0])
            print(f"{scene} {name}: load {load:.1f}, {curve[-1]}", flush=True)
            rows += [{"scene": scene, "program": name, "load": round(load, 1)} | row for row in curve]
        write_table(DOCS / "data/comparison_fits.csv", rows)
    plot_curves(rows, DOCS / "figures/comparison_fits.png")


def profile_opensplat(program: str, photos: PhotoSet) -> list[dict]:
    """Rows of OpenSplat's own pictures of the test photo, as of `profile_fit`, without the number of Gaussians.

    Raises: SystemExit: there is no picture.
    """
    (test,) = photos.tests
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        write_project(photos, folder)
        with (folder / "log").open("wb") as log:
            asked = [
                "--val-image",
                name_file(test),
                "--val-render",
                str(folder / "seen"),
                "-o",
                str(folder / "splat.ply"),
            ]
            process = subprocess.Popen([program, str(folder), *ARGUMENTS, *asked], stdout=log, stderr=subprocess.STDOUT)
            begun, used, found = time.perf_counter(), 0.0, {}
            while process.poll() is None and used < SECONDS:
                used = sum(psutil.Process(process.pid).cpu_times()[:2])
                spent = {"seconds": time.perf_counter() - begun, "processor_seconds": used}
                found |= {path: spent for path in (folder / "seen").glob("*.png") if path not in found}
                time.sleep(0.1)
            process.kill()
            process.wait()
        rows = []
        for path in sorted(found, key=lambda path: int(path.stem))[:-1:EVERY]:  # the last one may be half written
            seen = image_files.read_photo(path)
            quality = measure_quality(lambda _, seen=seen: seen, [test])
            rows.append(found[path] | {"step": int(path.stem), "gaussians": None} | quality)
        if not rows:
            raise SystemExit(f"{program} drew nothing: {(folder / 'log').read_text()[-500:]}")
        return rows


def name_file(view: TrainingView) -> str:
    return f"{Path(view.name).stem}.png"


def write_project(photos: PhotoSet, folder: Path) -> None:
    """All photos and points as a COLMAP project, without tracks."""
    (folder / "images").mkdir()
    (folder / "sparse/0").mkdir(parents=True)
    views, none = [*photos.train, *photos.tests], np.zeros(0, int)
    for view in views:
        image_files.write_png(folder / "images" / name_file(view), view.image)
    names, cameras = tuple(map(name_file, views)), tuple(view.camera for view in views)
    model = ColmapModel(names, cameras, photos.model.points, photos.model.colours, none, none, np.zeros((0, 2)))
    write_colmap_model(model, folder / "sparse/0")


def plot_curves(rows: list[dict], path: Path) -> None:
    """PSNR of the test photo over processor seconds: a panel a scene, a line a program."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    figure = figures.make_figure(4.0 * len(scenes), 3.4)
    for k, scene in enumerate(scenes):
        axes = figure.add_subplot(1, len(scenes), k + 1, title=scene, xlabel="processor seconds")
        for program, colour in zip(dict.fromkeys(row["program"] for row in rows), OKABE_ITO, strict=False):
            own = [row for row in rows if (row["scene"], row["program"]) == (scene, program)]
            x, y = ([row[name] for row in own] for name in ("processor_seconds", "psnr_colour_corrected"))
            axes.semilogx(x, y, "o-", markersize=3, color=colour, label=program)
        axes.grid(True, which="both", alpha=0.3)
    figure.axes[0].set_ylabel("PSNR of the test photo (dB)")
    figure.axes[-1].legend(frameon=False, loc="lower right")
    figures.save_figure(figure, path)


if __name__ == "__main__":
    main()
