"""Errors of the page's approximations: pre-sorted orders, objects drawn after the ground, levels and rounding.

The reference of a view is drawn from the tiles as they were cut and the objects as they were fitted, at their finest
level, all Gaussians sorted by depth.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.bundle import orders
from dav_gswt.bundle.content import BundleContent
from dav_gswt.bundle.store import Bundle
from dav_gswt.images import figures
from dav_gswt.logs import progress
from dav_gswt.terrain import endless, stills
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.stills import SHOTS, Shot

VIEWS = (Shot("near", (0.5, 0.5), 1.0, 40.0, 60.0), *SHOTS[:2])  # walker and oblique: the stills'
APPROXIMATIONS = ("presorting", "objects", "levels", "rounding", "all")
WIDTH, HEIGHT = 640, 360
REACH = 16  # radius of the terrain in tile sides, limited by the Gaussians of the finest level
TARGET_PSNR = 40.0  # dB

Picture = Float32[Array, "h w 3"]


def measure_approximations(content: BundleContent, bundle: Bundle) -> list[dict]:
    """A row for each view and approximation: `psnr` (None for equal pictures) and `change`, the largest difference in
    8-bit steps.

    presorting: the ground in the tiles' orders, against sorted exactly, both with levels and rounding. objects: the
    same with objects, which the page draws after their ground and depth puts partly under it; no row without objects.
    levels: against the finest level alone. rounding: read from the bundle, against what it was made of. all: the page's
    picture against the reference. The terrain is flat.
    """
    rows = []
    for shot in progress(VIEWS, "measure approximations"):
        for approximation, pair in _render_pairs(content, bundle, shot).items():
            row = {"view": shot.name, "shortcut": approximation, "psnr": orders.compute_psnr([pair])}
            rows.append(row | {"change": 255 * float(np.abs(pair[0] - pair[1]).max())})
    return rows


def _render_pairs(content: BundleContent, bundle: Bundle, shot: Shot) -> dict[str, tuple[Picture, Picture]]:
    """Pictures with each approximation and without it."""
    manifest, flat = bundle.manifest, {"kind": "flat"}
    rounded = replace(endless.terrain_from_bundle(bundle, flat), reach=REACH)
    tiles = [content.tile_fields(level) for level in range(content.levels)]
    objects = [each.fields for each in content.objects]
    cut = replace(endless.terrain_from_fields(tiles, manifest, flat, objects), reach=REACH)

    def render(terrain: EndlessTerrain, exact: bool) -> Picture:
        camera = stills.shot_camera(shot, terrain, manifest.eye_floor, WIDTH, HEIGHT)
        return stills.render_view(terrain, camera, manifest.sky, manifest.ground_colour, exact)

    page, sorted_, levels, reference = (
        render(rounded, False),
        render(rounded, True),
        render(cut, True),
        render(keep_finest(cut), True),
    )
    ground = {"presorting": (page, sorted_)}
    if objects:
        bare = replace(rounded, scatter=None, objects=[], extents=[])
        ground = {"presorting": (render(bare, False), render(bare, True)), "objects": (page, sorted_)}
    return ground | {"levels": (levels, reference), "rounding": (sorted_, levels), "all": (page, reference)}


def keep_finest(terrain: EndlessTerrain) -> EndlessTerrain:
    """The terrain with its finest level alone."""
    tiles = {(level, tile): f for (level, tile), f in terrain.tiles.items() if level == 0}
    return replace(terrain, tiles=tiles, switches=[np.inf], bands=[0.0])


def write_presort_plot(path: Path | str, rows: list[dict]) -> None:
    """A panel for each view, a group of bars for each approximation, a bar for each scene; rows hold text."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    figure = figures.make_figure(11.0, 3.6)
    for axes, shot in zip(figure.subplots(1, len(VIEWS), sharey=True), VIEWS, strict=True):
        for k, scene in enumerate(scenes):
            mine = {r["shortcut"]: r["psnr"] for r in rows if (r["scene"], r["view"]) == (scene, shot.name)}
            places = np.arange(len(APPROXIMATIONS)) + (k + 0.5) / (len(scenes) + 1) - 0.5
            heights = [float(mine.get(name) or "nan") for name in APPROXIMATIONS]
            axes.bar(places, heights, 1 / (len(scenes) + 1), align="edge", label=scene)
        axes.axhline(TARGET_PSNR, color="0.3", linewidth=1, linestyle="--")
        axes.set_xticks(range(len(APPROXIMATIONS)), APPROXIMATIONS)
        axes.set_title(shot.name)
    figure.axes[0].set_ylabel("PSNR (dB)")
    figure.axes[0].legend(frameon=False)
    figures.save_figure(figure, path)
