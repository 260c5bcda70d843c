"""A made-up scene in the folders of the result tree."""

from dataclasses import dataclass
from pathlib import Path

import made_up_tiles
import numpy as np

from dav_gswt import cameras, field, images
from dav_gswt.active import maps, scores
from dav_gswt.active.poses import Pose, place, to_json
from dav_gswt.active.scores import Scores
from dav_gswt.active.uncertainty import Scales
from dav_gswt.coarse import ground
from dav_gswt.coarse.ground import Ground
from dav_gswt.files import write_json
from dav_gswt.levels import store as levels
from dav_gswt.levels.build import Levels
from dav_gswt.photos import model, rigs
from dav_gswt.photos.model import Model
from dav_gswt.tiles import store as tiles

FRAME = {
    "unit": "metre",
    "flying_height": 5.0,
    "exemplar": {"west": made_up_tiles.WEST, "south": made_up_tiles.SOUTH, "side": 12.0},
    "extent": {"west": -5.0, "south": 5.0, "east": 11.0, "north": 21.0},
}
MIDDLE = np.array([made_up_tiles.WEST + 6.0, made_up_tiles.SOUTH + 6.0, 0.0])
CANDIDATES, CHOSEN = 12, (4, 9)
BRANCH = "active_w2-lpips_terrain_pdrop0.15_lam0.1_k2"


@dataclass(frozen=True)
class Tree:
    """Folders of a scene's results."""

    photos: Path
    start: Path
    coarse: Path
    scored: Path
    round: Path

    @property
    def tiles(self) -> Path:
        return self.round / "tiles_semantic"


def write(scene: Path) -> Tree:
    """A round's results in `scene`, as the workflow lays them."""
    fit = scene / "seed0" / "draft"
    coarse, branch = fit / "coarse", fit / BRANCH
    found = Tree(scene / "photos", fit.parent, coarse, coarse / "scores_terrain_pdrop0.15", branch / "iter1")
    _write_photos(found)
    _write_scores(found)
    _write_round(found)
    return found


def poses() -> list[Pose]:
    return [Pose(f"pose_{i:04d}", *at) for i, at in enumerate(rigs.hemisphere(CANDIDATES, 30.0, 5.0))]


def camera(pose: Pose):
    return cameras.pinhole(MIDDLE + place(pose), MIDDLE, 24, 16, 60.0)


def _write_photos(to: Tree) -> None:
    names = ("view_00.png", "view_01.png", "test_00.png")
    seen = tuple(
        camera(Pose("", elevation, azimuth, 5.0)) for elevation, azimuth in ((60.0, 0.0), (70.0, 120.0), (50.0, 240.0))
    )
    (to.photos / "sparse").mkdir(parents=True)
    for i, name in enumerate(names):
        images.write(to.photos / "images" / name, np.full((16, 24, 3), 0.2 + 0.3 * i, np.float32))
    points = MIDDLE + np.array([[1.0, 0, 0], [0, 1.0, 0], [-1.0, -1.0, 0.2]])
    pixels = np.concatenate([[one.project(points[k : k + 1])[0][0] for one in seen] for k in range(3)])
    of, by = np.repeat(np.arange(3), 3), np.tile(np.arange(3), 3)
    colours = np.eye(3, dtype=np.float32)
    model.write(Model(names, seen, points, colours, of, by, pixels), to.photos / "sparse")
    write_json(to.photos / "ground.json", FRAME)
    write_json(to.start / "views.json", {"start": list(names[:2]), "pool": [], "test": list(names[2:])})


def _write_scores(to: Tree) -> None:
    values = np.linspace(0.0, 2.0, CANDIDATES)
    terms = {"opacity": values, "w2_sq": values[::-1].copy()}
    table = Scores(poses(), terms, Scales(dict.fromkeys(terms, 1.0)), np.ones(CANDIDATES, int))
    to.scored.mkdir(parents=True)
    scores.write(to.scored / "scores.csv", table)
    to.round.mkdir(parents=True)
    write_json(to.round / "poses.json", to_json([poses()[i] for i in CHOSEN], "w2-lpips", 2))
    asked = [(f"{poses()[i].name}.png", cameras.to_json(camera(poses()[i]))) for i in CHOSEN]
    write_json(to.round / "capture/capture.json", {"shots": [{"name": name, "got": got} for name, got in asked]})
    for name, _ in asked:
        images.write(to.round / "capture" / name, np.full((16, 24, 3), 0.5, np.float32))


def _write_round(to: Tree) -> None:
    made = made_up_tiles.exemplar()
    finest = made.levels[0]
    grid = Ground(-3.0, 7.0, 0.125, 0, 0, 96, made.height, np.ones((96, 96), bool))
    for folder in (to.coarse, to.round):
        field.write(finest, folder / "field.ply")
        ground.write(grid, folder / "ground.exr")
    grids = [grid, Ground(-3.0, 7.0, 0.25, 0, 0, 48, made_up_tiles.halved(made.height), np.ones((48, 48), bool))]
    levels.write(Levels(made.levels[:2], grids, 2, ""), to.round / "levels", {})
    doubt = np.linspace(0, 1, len(finest), dtype=np.float32)
    opacity = np.random.default_rng(0).random((CANDIDATES, 8, 12), np.float32)
    shown = maps.PoseMaps([pose.name for pose in poses()], opacity, None)
    maps.write(to.round / "maps.npz", shown, doubt)
    above = np.zeros((96, 96), np.float32)
    above[0] = 1  # the northern row
    part = ({"opacity": np.eye(8, dtype=np.float32)}, {"elevation": "30.0"})
    images.write_exr_parts(to.round / "uncertainty.exr", {"above": ({"uncertainty": above}, {}), "pose_0003": part})
    tiles.write(made_up_tiles.tiles_of(made), to.tiles / "tiles", to.tiles / "seams.json", {})
