"""The paper's uncertainty sphere: scores of the candidates of each round, and the chosen poses.

The hemisphere is seen from above, by Lambert's projection: equal areas of it are equal areas of the figure, so that
candidates spread evenly over it lie evenly in the figure. Source: DAV-GSWT, figure on active-view uncertainty.
"""

from dataclasses import dataclass
from math import ceil

import numpy as np
from jaxtyping import Float64
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import Pose, pose_of_camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images import figures
from dav_gswt.views.policies import HIGHEST, candidate_values
from dav_gswt.views.scores import Scores

WIDE, TALL = 9.0, 4.5  # inches: the figure, a row of its panels
BESIDE = 2  # panels of a row: with more, stars hide their neighbours
KEY = 1.4  # inches: what is under the panels
RING = 15  # degrees of elevation between rings
NUMBERED = 24  # poses of a round, above which stars have no numbers
CROWDED = 4000.0  # square points that all dots cover together, where they are many
LARGEST = 42.0  # square points: a dot, where they are few
NUMBER = {"fontsize": 11, "weight": "bold"}
PHOTO = {"marker": "s", "facecolors": "none", "edgecolors": "black", "linewidths": 1.6}
STAR = {"marker": "*", "edgecolors": "black", "linewidths": 1.2}


@dataclass(frozen=True)
class Round:
    """The candidates of a round and its choice.

    values: of the candidates, shown as colours. candidates, taken: angle and radius in the figure (`project_poses`);
    taken are the photos before the round. chosen: indices of candidates, in order of choice. lowest: least elevation of
    all, degrees.
    """

    number: int
    values: Float64[Array, "n"]
    candidates: Float64[Array, "n 2"]
    taken: Float64[Array, "m 2"]
    chosen: list[int]
    lowest: float


def project_poses(poses: list[Pose]) -> Float64[Array, "n 2"]:
    """Where poses lie in the figure: azimuth (radians, from east to north) and r = sqrt(1 - sin(elevation)).

    r is 0 straight above and 1 at the horizon, and r^2, as the area of a cap, grows by equal steps of height.
    """
    elevation, azimuth = (np.radians([getattr(p, name) for p in poses]) for name in ("elevation", "azimuth"))
    return np.stack([azimuth, np.sqrt(1 - np.sin(elevation))], -1)


def build_round(
    number: int, scores: Scores, chosen: list[Pose], taken: list[Camera], frame: SceneFrame, lam: float
) -> Round:
    """Build the figure's data of a round.

    scores: of the candidates before the round. chosen: poses of the round. taken: cameras of all photos before.

    Raises: InputError: a pose was chosen that is not among the candidates.
    """
    photos = [pose_of_camera("", camera, frame) for camera in taken]
    index = {name: i for i, name in enumerate(scores.names)}
    names = [pose.name for pose in chosen]
    if strange := [name for name in names if name not in index]:
        raise InputError(f"poses.json of round {number}: {strange[0]} is not among the scored poses; make it again")
    lowest = min((pose.elevation for pose in scores.poses + photos), default=0.0)
    rows = [index[name] for name in names]
    return Round(
        number, candidate_values(scores, lam)[1], project_poses(scores.poses), project_poses(photos), rows, lowest
    )


def draw_figure(rounds: list[Round], label: str):
    """A panel a round: each candidate a dot, its colour on one scale for all rounds; photos taken before the round are
    hollow squares, the poses it chose are stars, numbered as they were chosen."""
    from matplotlib.cm import ScalarMappable

    rows, columns = ceil(len(rounds) / BESIDE), min(BESIDE, len(rounds))
    figure = figures.make_figure(WIDE, rows * TALL + KEY, w_pad=0.06, h_pad=0.06)
    panels = figure.subplots(rows, columns, squeeze=False, subplot_kw={"projection": "polar"})
    rim = RING * int(min(one.lowest for one in rounds) // RING)
    colours = {"norm": _colour_scale(rounds), "cmap": "viridis"}
    for axes, one in zip(panels.flat, rounds, strict=False):
        _draw_panel(axes, one, rim, colours)
    for empty in panels.flat[len(rounds) :]:
        empty.set_axis_off()
    bar = figure.colorbar(
        ScalarMappable(**colours), ax=panels, location="bottom", extend="max", shrink=0.6, aspect=40, pad=0.02
    )
    bar.set_label(label, fontsize=11)
    bar.ax.tick_params(labelsize=11)
    about = (
        f"from above: azimuth around; elevation 90° in the middle, {RING}° less at each ring, {rim}° at the outermost"
    )
    key = {"frameon": False, "fontsize": 11, "title_fontsize": 11}
    figure.legend(*panels.flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, title=about, **key)
    return figure


def _colour_scale(rounds: list[Round]):
    """Colours from the least value of all rounds to nearly the greatest."""
    from matplotlib.colors import Normalize

    values = np.concatenate([one.values for one in rounds])
    low, high = (values.min(), np.quantile(values, HIGHEST)) if len(values) else (0.0, 1.0)
    return Normalize(float(low), float(high) if high > low else float(low) + 1.0)


def _draw_panel(axes, one: Round, rim: int, colours: dict) -> None:
    from matplotlib.patheffects import withStroke

    edge = float(np.sqrt(1 - np.sin(np.radians(rim))))
    axes.set_ylim(0, 1.04 * edge)
    axes.set_yticks(np.sqrt(1 - np.sin(np.radians(np.arange(rim, 90, RING)))), [])
    axes.set_xticks(np.radians([0, 90, 180, 270]), ["0°", "90°", "180°", "270°"], fontsize=11)
    axes.tick_params(pad=3)
    axes.grid(color="0.8", linewidth=0.8)
    axes.set_axisbelow(True)
    dot = min(LARGEST, CROWDED * BESIDE / max(1, len(one.values)))
    axes.scatter(*one.candidates.T, c=one.values, s=dot, linewidths=0, label="candidate", **colours)
    axes.scatter(*one.taken.T, s=min(60, max(30, 2 * dot)), label="photo taken", **PHOTO)
    numbered = len(one.chosen) <= NUMBERED
    stars, star = one.candidates[one.chosen], min(260, max(120, 8 * dot)) if numbered else 70
    said = "chosen, numbered in order"
    axes.scatter(*stars.T, c=one.values[one.chosen], s=star, zorder=3, label=said, **STAR, **colours)
    if numbered and one.chosen:
        for order, at in enumerate(stars, 1):
            label = axes.annotate(f"{order}", at, (8, 0), textcoords="offset points", va="center", zorder=4, **NUMBER)
            label.set_path_effects([withStroke(linewidth=2.5, foreground="white")])
    chosen = f"{len(one.chosen)} of {len(one.values)} poses" if one.chosen else "no pose"
    photos = "1 photo" if len(one.taken) == 1 else f"{len(one.taken)} photos"
    axes.set_title(f"round {one.number}: {chosen}, after {photos}", fontsize=12)
