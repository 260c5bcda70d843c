"""How long a run will take: seconds of each rule by the size of its work, times the speed of this machine.

The coefficients are fitted to benchmarks of runs on the reference machine (`machine_speed`), and their growth to the
settings of docs/research/data/tradeoff.csv: docs/research/lab-notes.md. Work is counted before anything is known of the
photos; the aim is a factor of 1.5.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dav_gswt.cli.machine_speed import MachineSpeed
from dav_gswt.config.base import LARGEST_SIDE
from dav_gswt.errors import InputError
from dav_gswt.files import locate_path
from dav_gswt.images.image_files import SUFFIXES, read_size
from dav_gswt.photos.view_split import count_tests
from dav_gswt.reconstruction.fitting import plan
from dav_gswt.views.policies import PRIOR_POLICIES

LONG = 600.0  # seconds: a run that takes longer is told of a faster preset
PER_JOB = 1.6  # seconds to start a job: Snakemake, Python, imports
PHOTO_SHAPE = 0.75  # shorter over longer side, of photos that cannot be read
SH_COST = {0: 1.0, 1: 1.6, 2: 2.2, 3: 3.0}  # of a step, by the degree of the spherical harmonics
FAMILY_COST = {"flowers": 3.5, "grass": 4.0, "meadow": 1.5, "oasis": 1.8}  # of rendering a photo: of many plants
PER_PIXEL = 2.5  # Gaussians that a fit ends with, at most, for each pixel of a photo


@dataclass(frozen=True)
class Work:
    """What jobs of a scene have to do.

    Attributes:
        start, new, tests, total: photos to start from, of a round, that test, and all that are registered or rendered.
        rounds: of view selection.
        photo_pixels, fit_pixels: of a photo, and of a photo as the fit sees it.
        gaussians: of the field.
        step_cost: relative, by the degree of the spherical harmonics.
        steps, steps_per_photo, level_steps: of the optimiser.
        scratch: whether each round fits all photos anew.
        candidates: poses that are scored.
        samples: denoising steps of all samples of a pose; 0 without a prior.
        still_pixels: of a still.
        features: relative cost of structure from motion, by the scene's `sfm`.
        rendered: whether captured photos are rendered.
        scene_cost: of rendering a photo, relative, by the synthetic family.
        choosing: the work of the preset that chooses the photos, where it is another one.
    """

    start: int
    new: float
    tests: int
    total: int
    rounds: int
    photo_pixels: float
    fit_pixels: float
    gaussians: float
    step_cost: float
    steps: int
    steps_per_photo: int
    level_steps: int
    scratch: bool
    candidates: int
    samples: int
    still_pixels: float
    features: float
    rendered: bool
    scene_cost: float
    choosing: "Work | None" = None

    @property
    def all_photos(self) -> int:
        """Photos of the last round."""
        return self.start + round(self.new * self.rounds)

    @property
    def all_steps(self) -> int:
        """Steps of a fit to all of them."""
        return self.steps + round(self.steps_per_photo * self.new * self.rounds)

    @property
    def mean_photos(self) -> float:
        """Photos of a fit in a round, the mean over the rounds."""
        return self.start + self.new * (self.rounds + 1) / 2

    @property
    def update_steps(self) -> float:
        """Steps of a fit in a round, the mean over the rounds."""
        if not self.scratch:
            return float(self.steps_per_photo * self.new)
        return self.steps + self.steps_per_photo * self.new * (self.rounds + 1) / 2

    @property
    def step_seconds(self) -> float:
        """One step of a fit: forward, loss, backward, Adam."""
        return self.step_cost * (1.05e-7 * self.gaussians + 8.4e-8 * self.fit_pixels)

    @property
    def observation_seconds(self) -> float:
        """Plane sweep, colours and uncertainty, for each photo of a fit."""
        return 1.6e-6 * self.fit_pixels

    @property
    def field_size(self) -> float:
        """Gaussians of the field, 1 for those of the preset draft."""
        return self.gaussians / 140_000


@dataclass(frozen=True)
class Cost:
    """Seconds of a job on the reference machine: in the rasterizer, and in all else."""

    general: float
    raster: float = 0.0


OTHER_RULE = Cost(0.8)
# with `choose_with`: rules whose jobs are those of the preset that chooses, and those that there are besides
CHOOSING = ("fit_coarse", "evaluate_coarse", "score_coarse", "select_poses", "update_field")
CHOSEN = ("copy_chosen_photos", "fit_chosen_photos")
COSTS: dict[str, Callable[[Work], Cost]] = {
    "register_photos": lambda work: Cost(3 + 1.9 * work.features * work.total),
    "render_photos": lambda work: Cost(work.scene_cost * (10 + 1.9e-5 * work.photo_pixels * (work.total + work.tests))),
    "fit_coarse": lambda work: Cost(1.2 + work.observation_seconds * work.start, work.step_seconds * work.steps),
    "evaluate_coarse": lambda work: Cost(1.6 + 1e-6 * work.fit_pixels * work.tests),
    "evaluate_round": lambda work: Cost(1.6 + 1e-6 * work.fit_pixels * work.tests),
    "evaluate_inpainted": lambda work: Cost(1.6 + 2e-6 * work.fit_pixels * work.tests),
    "score_coarse": lambda work: Cost(1 + work.candidates * (0.018 + 0.012 * work.samples)),
    "score_round": lambda work: Cost(1 + work.candidates * (0.018 + 0.012 * work.samples)),
    "capture_views": lambda work: Cost(
        work.scene_cost * (7.2 + 1.3e-5 * work.photo_pixels * work.new) if work.rendered else 1.5
    ),
    "update_field": lambda work: Cost(
        1.2 + work.observation_seconds * work.mean_photos, work.step_seconds * work.update_steps
    ),
    "fit_chosen_photos": lambda work: Cost(
        1.2 + work.observation_seconds * work.all_photos, work.step_seconds * work.all_steps
    ),
    "select_poses": lambda work: Cost(1.2 + 0.0005 * work.candidates + 0.8 * work.field_size),
    "report_photos": lambda work: Cost(1.0 + 0.055 * work.total),
    "inpaint_field": lambda work: Cost(15.0),
    "find_materials": lambda work: Cost(8.0 + 2.3 * work.field_size),
    "make_levels": lambda work: Cost(0.7, 1.4 * (0.5 + work.level_steps / 120) * (0.5 + 0.5 * work.field_size)),
    "cut_tiles": lambda work: Cost(1.2 + 2.3 * work.field_size),
    "bundle_tiles": lambda work: Cost(12.0 + 1.3 * work.field_size),
    "render_terrain": lambda work: Cost(26.0, 5e-7 * work.still_pixels),
}


def estimate_seconds(jobs: Mapping[str, int], work: Work, speed: MachineSpeed) -> float:
    """Seconds of a run. jobs: how many of each rule."""
    cost = add_costs(jobs, work)
    return cost.general * speed.general + cost.raster * speed.raster


def add_costs(jobs: Mapping[str, int], work: Work) -> Cost:
    """The cost of all jobs, their starts included. jobs: how many of each rule."""
    general = raster = 0.0
    for rule, count in jobs.items():
        done = work.choosing if work.choosing and rule in CHOOSING else work
        cost = COSTS[rule](done) if rule in COSTS else OTHER_RULE
        general += count * (PER_JOB + cost.general)
        raster += count * cost.raster
    return Cost(general, raster)


def count_jobs(config: Mapping[str, Any], preset: str | None = None) -> dict[str, int]:
    """Jobs of each rule that `make run` has for the config's scene, if nothing of it is made yet.

    preset: instead of the scene's own.
    """
    scene = config["scenes"][config["scene"]]
    once = ["make_levels", "cut_tiles", "bundle_tiles", "render_terrain", "make_page"]
    once += ["find_materials"] if scene.get("materials", "one") != "one" else []
    if scene["kind"] == "field":
        return dict.fromkeys([*once, "prepare_external_field"], 1)
    once += ["register_photos" if scene["kind"] == "photos" else "render_photos", "report_photos", "split_views"]
    jobs: dict[str, int] = dict.fromkeys([*once, "fit_coarse", "evaluate_coarse", "score_coarse"], 1)
    for rule in ("select_poses", "capture_views", "update_field", "evaluate_round", "score_round"):
        jobs[rule] = config["rounds"]
    return replace_chosen(jobs, describe_work(config, preset))


def replace_chosen(jobs: Mapping[str, int], work: Work) -> dict[str, int]:
    """Jobs with those of CHOSEN as a preset's work has them."""
    once = dict(zip(CHOSEN, (work.rounds, 1), strict=True)) if work.choosing else {}
    return {rule: count for rule, count in jobs.items() if rule not in CHOSEN} | once


def describe_work(config: Mapping[str, Any], preset: str | None = None) -> Work:
    """The work of the config's scene. preset: instead of the scene's own."""
    scene, chosen = config["scenes"][config["scene"]], config["presets"]
    entry = chosen[preset or scene.get("preset")]
    photographed, chooser = scene["kind"] != "field", entry.get("choose_with")
    photos, (longest, shape) = count_photos(scene), measure_photos(scene)
    size = min(scene.get("size", entry["size"]), longest)
    seen = min(size, entry["size"])
    most = entry["max_gaussians"]
    tests, start, new = _count_parts(config, scene, photos)
    settings = config["priors"][config["prior"]] if config["policy"] in PRIOR_POLICIES else None
    replayed = max(0, photos - start)
    return Work(
        start=start,
        new=new,
        tests=tests,
        total=photos,
        rounds=config["rounds"],
        photo_pixels=shape * float(size) ** 2,
        fit_pixels=shape * float(seen) ** 2,
        gaussians=float(min(most, PER_PIXEL * seen**2) if photographed else most / 2),
        step_cost=SH_COST[entry["sh_degree"]],
        steps=plan.count_first_steps(entry["steps"], entry["steps_per_photo"], start),
        steps_per_photo=entry["steps_per_photo"],
        level_steps=entry["level_steps"],
        scratch=entry["update"] == "scratch",
        candidates=replayed if scene.get("agent") == "replay" else scene.get("candidates", 0),
        samples=settings["samples"] * settings["steps"] if settings else 0,
        still_pixels=3.0 * config["stills"]["width"] * config["stills"]["height"],
        features=5.0 if scene.get("sfm") == "careful" else 1.0,
        rendered=scene.get("agent") == "render",
        scene_cost=FAMILY_COST.get(scene.get("family"), 1.0),
        choosing=describe_work(config, chooser) if chooser and photographed and config["rounds"] else None,
    )


def _count_parts(config: Mapping[str, Any], scene: Mapping[str, Any], photos: int) -> tuple[int, int, float]:
    """Photos that test, that start, and that a round takes on the average: of a folder no more than it has."""
    new = float(config["k"] * scene.get("burst", 1))
    if scene["kind"] != "photos" or not photos:
        tests = scene.get("test", max(1, photos // 10)) + scene.get("oblique", 0) + scene.get("walkers", 0)
        return tests, scene.get("start") or photos, new
    tests = count_tests(photos)
    start = min(scene.get("start") or photos, photos - tests)
    if scene.get("agent") == "replay":
        new = min(new, (photos - tests - start) / max(1, config["rounds"]))
    return tests, start, new


def count_photos(scene: Mapping[str, Any]) -> int:
    """Photos of a scene: those that are rendered, or the files in its folder (0 where it is missing)."""
    if scene["kind"] == "synthetic":
        return scene["photos"]
    return len(_list_files(scene))


def measure_photos(scene: Mapping[str, Any]) -> tuple[int, float]:
    """The longer side of a folder's first photo, pixels, and the shorter one over it; LARGEST_SIDE and PHOTO_SHAPE
    where there is none that can be read. Rendered photos are square.
    """
    for path in _list_files(scene)[:1]:
        try:
            size = read_size(path)
        except InputError:  # the run itself tells of it
            break
        return max(size), min(size) / max(size)
    return LARGEST_SIDE, PHOTO_SHAPE if scene["kind"] == "photos" else 1.0


def _list_files(scene: Mapping[str, Any]) -> list[Path]:
    folder = locate_path(scene.get("folder", ""))
    if scene["kind"] != "photos" or not folder.is_dir():
        return []
    photos = (path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES and path.is_file())
    return sorted(path for path in photos if not path.name.startswith("."))


def describe_estimate(
    config: Mapping[str, Any], jobs: Mapping[str, int], speed: MachineSpeed, presets: Collection[str]
) -> str:
    """One line: how long the run takes, and, where that is long, a preset that takes less.

    presets: those that may be named; the study's are no user's. It is the slowest of those that stay below LONG, or
    else the fastest of all.
    """
    own = config["scenes"][config["scene"]]["preset"]
    seconds = estimate_seconds(jobs, describe_work(config), speed)
    text = f"It will take {format_duration(seconds)} on this machine"
    if seconds <= LONG or not {"fit_coarse", "fit_chosen_photos", "prepare_external_field"} & set(jobs):
        return text
    works = {name: describe_work(config, name) for name in presets if name != own}
    others = {name: estimate_seconds(replace_chosen(jobs, work), work, speed) for name, work in works.items()}
    faster = {name: other for name, other in others.items() if other < 0.8 * seconds}
    if not faster:
        return text
    fitting = {name: other for name, other in faster.items() if other <= LONG}
    name = max(fitting, key=fitting.__getitem__) if fitting else min(faster, key=faster.__getitem__)
    return f"{text}; with preset: {name} {format_duration(faster[name])} (a key of the scene {config['scene']!r})"


def format_duration(seconds: float) -> str:
    """About how long, in words: no more digits than an estimate has."""
    if seconds < 55:
        return f"about {max(10, round(seconds, -1)):.0f} seconds"
    if seconds < 100:
        return "about a minute"
    minutes = seconds / 60
    if minutes < 60:
        step = 1 if minutes < 15 else 5
        return f"about {step * round(minutes / step)} minutes"
    return f"about {minutes / 60:.1f} hours"
