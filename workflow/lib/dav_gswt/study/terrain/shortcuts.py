"""What the page's shortcuts do to a picture: pre-sorted orders, levels and rounding, each by itself and all at once.

The reference of a view is drawn from the tiles as they were cut, at their finest level, all Gaussians sorted by depth.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.bundle import order_directions
from dav_gswt.bundle.store import Bundle
from dav_gswt.logs import progress
from dav_gswt.study import figures
from dav_gswt.terrain import endless, stills
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.stills import SHOTS, Shot
from dav_gswt.tiles.build import TileSet

VIEWS = (Shot("near", (0.5, 0.5), 1.0, 40.0, 60.0), *SHOTS[:2])  # walker and oblique: the stills'
SHORTCUTS = ("presorting", "levels", "rounding", "all")
WIDTH, HEIGHT = 640, 360
REACH = 16  # tile sides that are laid: at the finest level no more fit into a picture's Gaussians
WANTED = 40.0  # dB

Picture = Float32[Array, "h w 3"]


def rows(tiles: TileSet, bundle: Bundle) -> list[dict]:
    """One row a view and shortcut: `psnr`, and `change`, the largest difference in 8-bit steps; None: equal pictures.

    presorting: drawn in the tiles' orders and as the page draws them, against sorted exactly, levels and rounding
    being there in both. levels: against the finest level alone. rounding: read from the bundle, against the tiles.
    all: the page's picture against the reference. Ground is flat, and laid REACH tile sides far.
    """
    found = []
    for shot in progress(VIEWS, "measure shortcuts"):
        for shortcut, pair in zip(SHORTCUTS, _pairs(tiles, bundle, shot), strict=True):
            row = {"view": shot.name, "shortcut": shortcut, "psnr": order_directions.compute_psnr([pair])}
            found.append(row | {"change": 255 * float(np.abs(pair[0] - pair[1]).max())})
    return found


def _pairs(tiles: TileSet, bundle: Bundle, shot: Shot) -> list[tuple[Picture, Picture]]:
    """Pictures with each shortcut and without it."""
    told, flat = bundle.manifest, {"kind": "flat"}
    rounded = replace(endless.terrain_from_bundle(bundle, flat), reach=REACH)
    cut = replace(endless.terrain_from_fields(tiles.fields, told, flat), reach=REACH)

    def drawn(terrain: EndlessTerrain, exact: bool) -> Picture:
        camera = stills.shot_camera(shot, terrain, told.eye_floor, WIDTH, HEIGHT)
        return stills.render_view(terrain, camera, vars(told.sky), told.ground_colour, exact)

    page, sorted_, levels, reference = (
        drawn(rounded, False),
        drawn(rounded, True),
        drawn(cut, True),
        drawn(finest(cut), True),
    )
    return [(page, sorted_), (levels, reference), (sorted_, levels), (page, reference)]


def finest(terrain: EndlessTerrain) -> EndlessTerrain:
    """The same with its finest level alone."""
    tiles = {(level, tile): f for (level, tile), f in terrain.tiles.items() if level == 0}
    return replace(terrain, tiles=tiles, switches=[np.inf], bands=[0.0])


def write_plot(path: Path | str, found: list[dict]) -> None:
    """A bar a scene, a panel a view, a group a shortcut; rows have text, an empty `psnr` is an equal picture."""
    scenes = list(dict.fromkeys(row["scene"] for row in found))
    figure = figures.blank(11.0, 3.6)
    for axes, shot in zip(figure.subplots(1, len(VIEWS), sharey=True), VIEWS, strict=True):
        for k, scene in enumerate(scenes):
            mine = {r["shortcut"]: r["psnr"] for r in found if (r["scene"], r["view"]) == (scene, shot.name)}
            places = np.arange(len(SHORTCUTS)) + (k + 0.5) / (len(scenes) + 1) - 0.5
            heights = [float(mine.get(name) or "nan") for name in SHORTCUTS]
            axes.bar(places, heights, 1 / (len(scenes) + 1), align="edge", label=scene)
        axes.axhline(WANTED, color="0.3", linewidth=1, linestyle="--")
        axes.set_xticks(range(len(SHORTCUTS)), SHORTCUTS)
        axes.set_title(shot.name)
    figure.axes[0].set_ylabel("PSNR (dB)")
    figure.axes[0].legend(frameon=False)
    figures.save(figure, path)
