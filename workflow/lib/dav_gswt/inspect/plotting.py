"""Draw a scene with PyVista: meshes, labels, legend and the first view."""

from typing import Any

import numpy as np
import pyvista as pv
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.inspect.scene import BLACK, ColourBar, ColourKey, Label, Layer, Scene

BACKGROUND = "white"
VIEW = 30.0  # degrees: of the picture's height
PAGE = 1.2, 0.85  # assumed width over height of a browser's window, and the share of it below the text
FILL = 0.95  # share of the picture that the box fills
ROW, BAR = 50, 320  # pixels: height and width of a colour bar
LINE, LETTER, POINTS = 20, 8, 14  # pixels a line and a letter, points of letters


def make_plotter(scene: Scene, size: tuple[int, int], off_screen: bool, legend: bool = True) -> pv.Plotter:
    """A plotter with the whole scene in its first view. legend: draw title, notes and colours, too."""
    plotter: Any = pv.Plotter(off_screen=off_screen, window_size=list(size))
    plotter.set_background(BACKGROUND)
    for layer in scene.layers:
        _add_layer(plotter, layer)
    for label in scene.labels:
        plotter.add_mesh(_make_letters(label, scene), color=_to_unit(BLACK), lighting=False)
    if legend:
        _add_legend(plotter, scene, size)
    _set_camera(plotter, scene, size, legend)
    return plotter


def make_mesh(layer: Layer) -> pv.PolyData:
    """A layer as VTK's polygons, lines or points, with its colours as the array `rgb` where there are several."""
    if layer.cells is None:
        mesh = pv.PolyData(layer.points)
    else:
        rows = np.column_stack([np.full(len(layer.cells), layer.cells.shape[1]), layer.cells]).ravel()
        cells: dict[str, Any] = {"lines" if layer.kind == "lines" else "faces": rows}
        mesh = pv.PolyData(layer.points, **cells)
    if not isinstance(layer.colours, tuple):
        (mesh.point_data if layer.cells is None else mesh.cell_data)["rgb"] = layer.colours
    if layer.picture is not None:
        mesh.active_texture_coordinates = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    return mesh


def _add_layer(plotter: pv.Plotter, layer: Layer) -> None:
    how: dict[str, Any] = {"lighting": False, "show_scalar_bar": False}
    if layer.picture is not None:
        texture = pv.Texture(np.ascontiguousarray(layer.picture))
        plotter.add_mesh(make_mesh(layer), texture=texture, **how)
        return
    if isinstance(layer.colours, tuple):
        how["color"] = _to_unit(layer.colours)
    else:
        how |= {"scalars": "rgb", "rgb": True}
    if layer.kind == "lines":
        how["line_width"] = layer.width
    if layer.kind == "points":
        how |= {"style": "points", "point_size": layer.width}
    plotter.add_mesh(make_mesh(layer), **how)


def _to_unit(colour: tuple[int, int, int]) -> tuple[float, ...]:
    return tuple(c / 255 for c in colour)


def _make_letters(label: Label, scene: Scene) -> pv.PolyData:
    """Letters as a mesh: a page has no other text inside the scene."""
    flat = np.array([scene.viewer[0], scene.viewer[1], 0.0])
    normal = tuple(flat / np.linalg.norm(flat)) if label.upright and flat.any() else (0.0, 0.0, 1.0)
    shape = pv.Text3D(label.text, depth=0.0)
    low, high = np.array(shape.bounds).reshape(3, 2).T
    centred = (np.asarray(shape.points) - (low + high) / 2) * (label.height / _digit_height())
    across = np.cross([0.0, 0.0, 1.0], normal) if label.upright and flat.any() else np.array([1.0, 0.0, 0.0])
    upright = np.stack([across, np.cross(normal, across), normal])
    shape.points = (centred @ upright + label.place).astype(np.float32)
    return shape


def _digit_height() -> float:
    """Height of a digit in the letters' own unit."""
    low, high = np.array(pv.Text3D("0", depth=0.0).bounds).reshape(3, 2).T
    return float((high - low)[1])


def _add_legend(plotter: pv.Plotter, scene: Scene, size: tuple[int, int]) -> None:
    for i, line in enumerate([scene.title, *scene.notes], 1):
        _add_text(plotter, _shorten(line, size[0]), (8, size[1] - i * LINE), BLACK)
    bars = [entry for entry in scene.legend if isinstance(entry, ColourBar)]
    for i, bar in enumerate(bars):
        _add_bar(plotter, bar, i, size)
    named = [pair for entry in scene.legend if isinstance(entry, ColourKey) for pair in entry.named.items()]
    left = size[0] - 50 - LETTER * max((len(name) for name, _ in named), default=0)
    for i, (name, colour) in enumerate(reversed(named)):
        swatch = _add_text(plotter, "MM", (left, 10 + i * LINE), colour)
        swatch.prop.background_color, swatch.prop.background_opacity = _to_unit(colour), 1.0
        _add_text(plotter, name, (left + 38, 10 + i * LINE), BLACK)


def _add_text(plotter: Any, text: str, at: tuple[int, int], colour: tuple[int, int, int]) -> pv.Text:
    """Letters at pixels from the lower left."""
    letters = pv.Text(text)
    letters.prop.font_size, letters.prop.color = POINTS, _to_unit(colour)
    letters.SetPosition(*at)
    plotter.add_actor(letters, render=False)
    return letters


def _shorten(text: str, width: int) -> str:
    """A line that fits; of a long path the end is kept."""
    most = max(20, width // LETTER)
    return text if len(text) <= most else f"...{text[3 - most :]}"


def _add_bar(plotter: Any, bar: ColourBar, place: int, size: tuple[int, int]) -> None:
    """Bars stand side by side along the lower border."""
    mapper = pv.DataSetMapper()
    mapper.lookup_table = pv.LookupTable(bar.colours, n_values=256, scalar_range=(bar.low, bar.high))
    plotter.add_scalar_bar(
        title=f"{bar.title}{' ' * place}",  # a title is also a key: two bars may not share one
        mapper=mapper,
        color=_to_unit(BLACK),
        n_labels=2,
        fmt="%.3g",
        title_font_size=POINTS,
        label_font_size=POINTS,
        vertical=False,
        width=BAR / size[0],
        height=ROW / size[1],
        position_x=(30 + place * (BAR + 60)) / size[0],
        position_y=10 / size[1],
    )


def _set_camera(plotter: pv.Plotter, scene: Scene, size: tuple[int, int], legend: bool) -> None:
    """The first view: the whole box of the scene, from its viewer's direction, between title and legend."""
    middle, half = (scene.low + scene.high) / 2, (scene.high - scene.low) / 2
    up = (0.0, 1.0, 0.0) if scene.flat else (0.0, 0.0, 1.0)
    towards = np.array(scene.viewer) / np.linalg.norm(scene.viewer)
    above = LINE * (len(scene.notes) + 1) * legend
    below = (ROW + 14) * (legend and any(isinstance(entry, ColourBar) for entry in scene.legend))
    aspect, share = (size[0] / size[1], max(0.3, (size[1] - above - below) / size[1])) if legend else PAGE
    away = _fit_distance(half, towards, up, aspect, share)
    plotter.camera_position = [tuple(middle + away * towards), tuple(middle), up]
    plotter.camera.view_angle = VIEW
    plotter.camera.SetWindowCenter(0.0, (above - below) / size[1])
    plotter.reset_camera_clipping_range()


def _fit_distance(
    half: Float[Array, "3"], towards: Float[Array, "3"], up: tuple[float, ...], aspect: float, share: float
) -> float:
    """The distance from which a box fills FILL of the picture's width or of a share of its height."""
    across = np.cross(up, towards)
    across = across / np.linalg.norm(across)
    upward = np.cross(towards, across)
    corners = half * np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1]), -1).reshape(-1, 3)
    tangent = np.tan(np.radians(VIEW) / 2) * FILL
    wide = np.abs(corners @ across) / (tangent * aspect) + corners @ towards
    tall = np.abs(corners @ upward) / (tangent * share) + corners @ towards
    return float(max(wide.max(), tall.max(), 1e-6))
