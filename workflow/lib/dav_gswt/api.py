"""The library's front: from photos with known cameras to an endless terrain, in a dozen functions.

`import dav_gswt` offers all of them. Each one calls the functions that the rules of the workflow call; the packages
below `dav_gswt` have everything else. docs/python.md shows them in one example.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.field import GaussianField, read_field, write_field
from dav_gswt.geometry.cameras import Camera, pinhole
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.lod.store import Levels
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.reconstruction.coarse import Reconstruction
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.tiles.build import TileSet
from dav_gswt.views.scoring import ScoringResult

if TYPE_CHECKING:
    from dav_gswt.cli.make import Made

__all__ = [
    "cut_tiles",
    "fit_field",
    "look_at",
    "make",
    "make_levels",
    "open_terrain",
    "read_field",
    "read_photos",
    "render",
    "score_poses",
    "write_bundle",
    "write_field",
]


@dataclass(frozen=True)
class Photos:
    """Photos with their cameras over a ground frame: z up, the ground at z = 0.

    folder: `images/`, `sparse/` (a COLMAP model) and `ground.json`, as `results/<scene>/photos` has them.
    """

    folder: Path
    frame: SceneFrame
    views: list[TrainingView]


@dataclass(frozen=True)
class Terrain:
    """An endless terrain, and the manifest of its bundle (sky, lowest eye, unit of length)."""

    endless: EndlessTerrain
    manifest: Manifest


def make(source: Path | str, out: Path | str | None = None, **options: Any) -> "Made":
    """Make a terrain of photos, a video, a splat or a project, as `dav-gswt make` does; returns where its files are.

    out: a folder; None: NAME-terrain here. options: of the command line, such as preset="draft" or budget=16.
    Raises: InputError: the input is not understood or cannot give a terrain.
    """
    from dav_gswt.cli.make import make_terrain  # here, not above: the command line stands over this front

    return make_terrain(Path(source), Path(out) if out else None, **options)


def read_photos(folder: Path | str, size: int = 768, names: list[str] | None = None) -> Photos:
    """Read the photos of a scene.

    Args:
        folder: See `Photos`; the workflow writes one for each scene.
        size: Longer side of the photos in pixels. Photos are never enlarged.
        names: File names of the photos to read; by default all photos of the model.
    Raises: InputError: a file is missing or cannot be read.
    """
    from dav_gswt.geometry.scene_frame import read_scene_frame
    from dav_gswt.photos.colmap_model import read_colmap_model
    from dav_gswt.photos.training_views import read_training_views

    folder = Path(folder)
    chosen = list(read_colmap_model(folder / "sparse").names) if names is None else names
    views = read_training_views(folder / "images", folder / "sparse", chosen, [], size)
    return Photos(folder, read_scene_frame(folder / "ground.json"), views)


def fit_field(
    photos: Photos, *, spacing: float = 1.25, max_gaussians: int = 140_000, steps: int = 360, seed: int = 0
) -> Reconstruction:
    """Fit a Gaussian field of the ground and of the objects on it. The defaults are those of the preset `draft`.

    Args:
        spacing: Distance of the ground's Gaussians, in pixels of a photo on the ground.
        max_gaussians: Most Gaussians of the field.
        steps: Optimiser steps, for eight photos or fewer; 28 more for each further photo.
    Returns: `field`, `grid` (the ground's height field) and `report`.
    """
    from dav_gswt.reconstruction.coarse import fit_coarse_field, read_start_views
    from dav_gswt.reconstruction.fitting.plan import FitSettings

    size = max(max(view.camera.width, view.camera.height) for view in photos.views)
    settings = FitSettings(fit_size=size, spacing=spacing, max_gaussians=max_gaussians, steps=steps, steps_per_photo=28)
    start = read_start_views(photos.frame, photos.views, photos.folder / "sparse", photos.folder / "images", False)
    return fit_coarse_field(start, settings, np.random.default_rng(seed))


def score_poses(fitted: Reconstruction, photos: Photos, count: int = 250) -> ScoringResult:
    """Score poses on an orbit by what the field does not know there: where should the next photos be taken?

    Args:
        count: Number of poses.
    Returns: `scores.poses`, and by `scores.term("opacity")` and `scores.term("coverage")` one value for each pose:
        mean uncertainty in the view, and new ground and directions that a photo would add.
    """
    from dav_gswt.views import candidates, scoring

    scene = {"agent": "handheld", "candidates": count, "poses": "orbit"}
    listed = candidates.list_poses(scene, photos.frame, photos.views[0].camera)
    free = candidates.filter_feasible(listed, fitted.field, fitted.grid, photos.frame.flying_height)
    return scoring.score_poses(fitted.field, fitted.grid, free, photos.views, photos.frame)


def make_levels(fitted: Reconstruction, levels: int | str = "auto", steps: int = 60, seed: int = 0) -> Levels:
    """Fit ever coarser levels of detail of the exemplar, the square of ground that the photos show.

    Args:
        levels: Number of levels, or `auto`.
        steps: Optimiser steps of each level.
    """
    from dav_gswt.lod import build, merge

    field, grid = merge.crop_to_blocks(fitted.field, fitted.grid, 1)
    return build.build_levels(field, grid, levels, steps, seed)


def cut_tiles(
    levels: Levels, *, tile: float | str = "auto", strip: float | str = "auto", variants: int = 2, seed: int = 0
) -> TileSet:
    """Cut sixteen Wang tiles a variant from the exemplar, along minimum cuts of colour and segments.

    Args:
        tile: Side of a tile as a share of the exemplar's, or `auto`: by the scale of the ground's texture.
        strip: Half the width of the strips along borders, as a share of the tile's side, or `auto`.
        variants: Centres of each colouring of the edges.
    Raises: InputError: the exemplar is too small for such tiles.
    """
    from dav_gswt.tiles import build

    options = build.TilingOptions(share=tile, strip=strip, variants=variants, levels=levels.wanted)
    return build.cut_materials([levels], options, None, lambda number: np.random.default_rng([seed, number]))[0]


def write_bundle(tiles: TileSet, folder: Path | str, *, tau: float = 0.6, unit: str = "flying height") -> Manifest:
    """Write the tiles as a bundle, which the page and `open_terrain` read.

    Args:
        tau: Tiles with at least this mean uncertainty keep the pre-sorted draw orders of all directions, the others
            about half.
        unit: Name of the unit of length: `metre` where the scale is known.
    """
    from dav_gswt.bundle import build
    from dav_gswt.provenance import record_provenance
    from dav_gswt.terrain.fit_cover import gather_content

    options = build.BundleOptions(tau=tau, unit=unit)
    return build.write_bundle(gather_content([tiles], None, 0), folder, options, record_provenance({}, {"tau": tau}))


def open_terrain(folder: Path | str, heights: dict[str, Any] | None = None) -> Terrain:
    """Open the endless terrain of a bundle or of a page.

    Args:
        heights: The surface that the tiles lie on, as the config's `heights`; level ground by default.
    Raises: InputError: the folder holds no bundle, or a file of it is damaged.
    """
    from dav_gswt.bundle.store import read_bundle
    from dav_gswt.terrain.endless import terrain_from_bundle, terrain_from_page

    bundle = read_bundle(Path(folder))
    terrain = terrain_from_bundle(bundle, heights) if heights else terrain_from_page(bundle)
    return Terrain(terrain, bundle.manifest)


def look_at(
    eye: Sequence[float | int],
    target: Sequence[float | int],
    width: int = 960,
    height: int = 540,
    fov: float | int = 60,
) -> Camera:
    """Make a camera at the place `eye` that looks at `target`, with z up. fov: horizontal field of view in degrees."""
    return pinhole(eye, target, width, height, fov)


def render(
    shown: GaussianField | Terrain, camera: Camera, hour: float | None = None
) -> Float32[Array, "h w 3"] | Float[Array, "h w 3"]:
    """Render a field or a terrain: colours in sRGB, 0 to 1, the first row at the top.

    hour: Solar time, 6 to 18, of a terrain whose page has a sun; by default its light is the captured one.
    """
    if isinstance(shown, Terrain):
        from dav_gswt.terrain.light import light_of
        from dav_gswt.terrain.stills import render_view

        manifest = shown.manifest
        return render_view(shown.endless, camera, manifest.sky, manifest.ground_colour, light=light_of(manifest, hour))
    from dav_gswt import raster

    return raster.render(shown, camera).colour
