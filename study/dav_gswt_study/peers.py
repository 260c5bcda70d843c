"""Other programs that fit Gaussians, beside ours: the same photos, the same test views, quality over seconds.

OpenSplat is a program of the user's (AGPL, nothing of it is here). It sees the photos at the size of our fit as a
COLMAP project, with the same points to start from, leaves one out, and draws it every ten steps. gsplat's fits need
CUDA, its reference in PyTorch included: they are compared where there is a GPU.
"""

import shutil
import subprocess
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from dav_gswt.errors import InputError
from dav_gswt.images import figures, image_files
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import backends
from dav_gswt_study import markdown
from dav_gswt_study.figures import OKABE_ITO
from dav_gswt_study.fit_profile import PhotoSet, find_time_to, measure_quality

OPENSPLAT, GSPLAT = "opensplat", "gsplat"
OURS = "dav-gswt"
LEVELS = (28.0, 31.0, 33.0, 34.0)  # dB of the test photos, colour-corrected
OFTEN = 0.05  # seconds between looks at the program
RENDERS = "renders"
SETTLED = 0.5  # seconds before the end from which a file may not be whole


def select_photos(photos: PhotoSet) -> PhotoSet:
    """The photos with one test photo, the middle one: OpenSplat looks at one only."""
    tests = next(iter(photos.tests.values()))
    return replace(photos, tests={"test": [tests[len(tests) // 2]]})


def write_project(photos: PhotoSet, folder: Path | str) -> None:
    """The photos, the test photo included, as a COLMAP project: images/ and sparse/0, without tracks."""
    folder = Path(folder)
    for part in ("images", "sparse/0", RENDERS):
        (folder / part).mkdir(parents=True, exist_ok=True)
    none, views = np.zeros(0, int), [*photos.train, test_photo(photos)]
    names = tuple(_file_name(view) for view in views)
    for name, view in zip(names, views, strict=True):
        image_files.write_png(folder / "images" / name, view.image)
    points = photos.model.points, photos.model.colours
    model = ColmapModel(names, tuple(v.camera for v in views), *points, none, none, np.zeros((0, 2)))
    write_colmap_model(model, folder / "sparse/0")


def test_photo(photos: PhotoSet) -> TrainingView:
    """The photo that no program fits."""
    (view,) = next(iter(photos.tests.values()))
    return view


def find_program(name: str) -> str | None:
    """The path of OpenSplat; None without it, where gsplat can be compared with.

    Raises: InputError: neither of the two is there.
    """
    path = shutil.which(name)
    if path is None and (why := backends.explain_unavailable("cuda")):
        raise InputError(
            f"study: compare: opensplat: there is no program {name!r}; build OpenSplat and call "
            f"make compare OPENSPLAT=<its path>, or compare with gsplat on a GPU ({why})"
        )
    return path


def profile_others(program: str | None, photos: PhotoSet, asked: dict, scratch: Path) -> dict[str, list[dict]]:
    """The curves of OpenSplat, if it is there, and of gsplat, if a GPU is. scratch: where a folder may be made."""
    curves = {}
    if program:
        with tempfile.TemporaryDirectory(dir=scratch) as folder:
            write_project(photos, folder)
            drawn = run_opensplat(program, Path(folder), _file_name(test_photo(photos)), asked["seconds"])
            curves[OPENSPLAT] = judge_drawn(drawn, photos)
    if not backends.explain_unavailable("cuda"):
        from dav_gswt_study import gsplat_fit  # deferred: it needs gsplat

        curves[GSPLAT] = gsplat_fit.profile_gsplat(photos, asked["gsplat_steps"], asked["every"])
    return curves


def run_opensplat(program: str, project: Path, photo: str, seconds: float) -> list[tuple[float, int, Path]]:
    """Run OpenSplat for some seconds without a photo; list seconds, step and file of its own pictures of that photo.

    At full size from the start (`--num-downscales 0`): its schedule would see small photos for 3000 steps.
    Raises: InputError: it drew nothing.
    """
    asked = ["--cpu", "--keep-crs", "--num-downscales", "0", "--num-iters", "1000000", "--val", "--val-image", photo]
    command = [program, str(project), *asked, "--val-render", str(project / RENDERS), "-o", str(project / "splat.ply")]
    begin = time.time()
    with (project / "opensplat.log").open("wb") as log:
        process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
        while process.poll() is None and time.time() - begin < seconds:
            time.sleep(OFTEN)
        ended = process.poll()
        process.kill()
        process.wait()
    found = [(path.stat().st_mtime - begin, int(path.stem), path) for path in (project / RENDERS).glob("*.png")]
    whole = [each for each in sorted(found) if ended is not None or each[0] < seconds - SETTLED]
    if not whole:
        last = (project / "opensplat.log").read_text(errors="replace").splitlines()[-3:]
        raise InputError(f"study: compare: opensplat: {program} drew nothing in {seconds:g} s: {' / '.join(last)}")
    return whole


def judge_drawn(drawn: list[tuple[float, int, Path]], photos: PhotoSet) -> list[dict]:
    """Rows as of `fit_profile.profile_fit`, without Gaussians, of pictures of the test photo."""
    rows = []
    for seconds, step, path in drawn:
        seen = image_files.read_photo(path)
        quality = measure_quality(lambda _, seen=seen: seen, [test_photo(photos)])
        rows.append({"seconds": seconds, "step": step, "gaussians": None} | quality)
    return rows


def _file_name(view: TrainingView) -> str:
    return f"{Path(view.name).stem}.png"


def plot_programs(rows: list[dict], path: Path | str) -> None:
    """PSNR of the test photo over seconds, a line a program."""
    figure = figures.make_figure(6.4, 4.0)
    axes = figure.add_subplot()
    for program, colour in zip(dict.fromkeys(row["program"] for row in rows), OKABE_ITO, strict=False):
        own = [row for row in rows if row["program"] == program]
        x, y = ([row[name] for row in own] for name in ("seconds", "psnr_colour_corrected"))
        axes.semilogx(x, y, "o-", markersize=3, color=colour, label=program)
    axes.set_xlabel("seconds")
    axes.set_ylabel("PSNR of the test photo, colour-corrected (dB)")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(frameon=False)
    figures.save_figure(figure, path)


def describe(rows: list[dict], photos: PhotoSet, asked: dict, made: dict) -> dict:
    """The values of the page study/report/fitters.md."""
    body = []
    for program in dict.fromkeys(row["program"] for row in rows):
        own = [row for row in rows if row["program"] == program]
        best, last = max(own, key=lambda row: row["psnr_colour_corrected"]), own[-1]
        body.append(
            [
                program,
                *(_time_to(own, level) for level in LEVELS),
                f"{best['psnr_colour_corrected']:.2f} after {best['seconds']:.0f} s",
                "" if last["gaussians"] is None else f"{last['gaussians']:.0f}",
                f"{(last['seconds'] - own[0]['seconds']) / max(1, last['step'] - own[0]['step']):.3f}",
            ]
        )
    head = ["program", *(f"s to {level:g} dB" for level in LEVELS), "best", "Gaussians at the end", "s a step"]
    return {
        "version": made["version"],
        "renderer": ", ".join(str(value) for value in made["renderer"].values()),
        "processor": f"{made['cores']} cores of {made['processor']}",
        "scene": asked["scene"],
        "size": asked["fit_size"],
        "seconds": f"{asked['seconds']:g}",
        "train": len(photos.train),
        "photo": Path(test_photo(photos).name).stem,
        "table": markdown.format_table(head, body),
    }


def _time_to(curve: list[dict], level: float) -> str:
    found = find_time_to(curve, level)
    return "never" if found is None else f"{found:.1f}"
