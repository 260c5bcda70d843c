"""Draw a scene with PyVista: in a window, as a picture, or as a page that makes no requests."""

import html
import io
import json
import os
import re
import subprocess
import sys
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from jaxtyping import Float, UInt8
from jinja2 import Template
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.files import atomic_file
from dav_gswt.views.policies import HIGHEST

Colour = tuple[int, int, int]
PROBE = "import pyvista; plotter = pyvista.Plotter(off_screen=True); plotter.show(); assert plotter.image is not None"
UNCERTAINTY_MAP = "coolwarm"  # blue: certain, red: uncertain
UNKNOWN = (150, 150, 150)  # the colour of NaN
BLACK = (25, 25, 25)
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' blob:; worker-src blob:; connect-src blob: data:; "
    "img-src blob: data:; style-src 'unsafe-inline'"
)
ICON = "https://kitware.github.io/vtk-js/icon/favicon-"  # the viewer would request it
STAGE = '<div class="content" style="position:fixed;inset:0"></div>'  # the viewer fills it
OVERLAY = Path(__file__).with_name("overlay.html")  # Jinja2 template


def make_bar(low: float, high: float, colours: str = UNCERTAINTY_MAP) -> pv.LookupTable:
    """Colours that stand for numbers; one unit wide if `low` and `high` are the same."""
    return pv.LookupTable(colours, scalar_range=(low, high if high > low else low + 1.0))


def fit_bar(values: Float[Array, "*n"], colours: str = UNCERTAINTY_MAP) -> pv.LookupTable:
    """A bar from the least value to the quantile HIGHEST."""
    known = values[np.isfinite(values)]
    low, high = np.quantile(known, [0.0, HIGHEST]).tolist() if known.size else (0.0, 1.0)
    return make_bar(low, high, colours)


def map_colours(bar: pv.LookupTable, values: Float[Array, "*n"]) -> UInt8[Array, "*n 3"]:
    """The colours of values; UNKNOWN where they are not finite."""
    known = np.isfinite(values)
    colours = np.asarray(bar(np.where(known, values, 0.0).ravel()))[:, :3]
    return np.where(known[..., None], to_bytes(colours).reshape(*values.shape, 3), np.array(UNKNOWN, np.uint8))


@dataclass
class Scene:
    """Content of a window, picture or page.

    Attributes:
        notes: lines below the title.
        meshes: meshes, each with the options with which PyVista draws it.
        bars, names: the legend: what colours mean, by its title.
        box: lowest and highest corner of what the first view shows; None: all meshes.
        viewer: direction from the box to the viewer. (0, 0, 1): pictures, seen straight on.
    """

    title: str
    notes: list[str]
    meshes: list[tuple[pv.DataSet, dict[str, Any]]] = field(default_factory=list)
    bars: dict[str, pv.LookupTable] = field(default_factory=dict)
    names: dict[str, Colour] = field(default_factory=dict)
    box: Float[Array, "2 3"] | None = None
    viewer: tuple[float, float, float] = (-0.45, -1.0, 0.75)

    def add(self, mesh: pv.DataSet, colours: UInt8[Array, "n 3"] | Colour = BLACK, **how: Any) -> None:
        """Add a mesh. colours: one for all, or one for each cell, or for each point of a mesh without faces."""
        if isinstance(colours, tuple):
            how["color"] = colours
        else:
            data = mesh.cell_data if len(colours) == mesh.n_cells else mesh.point_data
            data["rgb"] = colours
            how |= {"scalars": "rgb", "rgb": True}
        self.meshes.append((mesh, how))

    def add_picture(
        self, rows: UInt8[Array, "h w 3"], corner: Float[Array, "3"], right: Float[Array, "3"], down: Float[Array, "3"]
    ) -> None:
        """Add a picture on a parallelogram, from its top left corner along its upper and its left border."""
        mesh = pv.Quadrilateral(np.array([corner, corner + right, corner + right + down, corner + down]))
        mesh.active_texture_coordinates = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
        self.meshes.append((mesh, {"texture": pv.Texture(np.ascontiguousarray(rows))}))

    def add_label(self, text: str, place: Float[Array, "3"], height: float, upright: bool = False) -> None:
        """Add letters as a mesh, since a page has no other text. upright: facing the first view; else lying flat."""
        letters = pv.Text3D(text, depth=0.0, height=height)
        if upright:
            turn = np.degrees(np.arctan2(self.viewer[0], -self.viewer[1]))
            letters = letters.rotate_x(90.0, inplace=False).rotate_z(float(turn), inplace=False)
        self.add(letters.translate(place, inplace=False))


def to_bytes(colours: Float[Array, "*n 3"]) -> UInt8[Array, "*n 3"]:
    """Colours in [0, 1] as bytes; values outside are clipped."""
    return np.rint(np.clip(colours, 0, 1) * 255).astype(np.uint8)


def require_rendering() -> None:
    """Raises: InputError: nothing draws off screen here; the message names the packages to install.

    It is tested in a process of its own, since VTK may end a process that cannot draw.
    """
    if sys.platform == "linux":
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")  # VTK falls back on OSMesa
    if subprocess.run([sys.executable, "-c", PROBE], capture_output=True, check=False).returncode:
        how = "on Debian or Ubuntu: sudo apt install libegl1 libgl1-mesa-dri (or libosmesa6)"
        raise InputError(f"--save: nothing draws off screen here; {how}")


def show(scene: Scene, size: tuple[int, int], path: Path | None) -> None:
    """Show a scene until its window is closed, or write a .png or .html file, whole or not at all."""
    plotter = make_plotter(scene, size, off_screen=path is not None, legend=path is None or path.suffix == ".png")
    if path is None:
        plotter.show(title=scene.title)
        return
    with atomic_file(path) as part:
        if path.suffix == ".png":
            plotter.screenshot(str(part))
        else:
            part.write_text(format_page(scene, plotter.render_window), encoding="utf-8")
    plotter.close()


def make_plotter(scene: Scene, size: tuple[int, int], off_screen: bool, legend: bool = True) -> pv.Plotter:
    """A plotter with the whole scene in its first view. legend: draw title, notes and colours, too."""
    plotter: Any = pv.Plotter(off_screen=off_screen, window_size=list(size))
    plotter.set_background("white")
    for mesh, how in scene.meshes:
        plotter.add_mesh(mesh, lighting=False, show_scalar_bar=False, **how)
    if legend:
        text = "\n".join(line if len(line) <= 110 else f"...{line[-107:]}" for line in [scene.title, *scene.notes])
        plotter.add_text(text, position="upper_left", font_size=8, color=BLACK)
        for i, (title, bar) in enumerate(scene.bars.items()):
            mapper = pv.DataSetMapper()
            mapper.lookup_table = bar
            where = {"width": 0.25, "height": 0.06, "position_x": 0.02 + 0.28 * i, "position_y": 0.01}
            text = {"title_font_size": 14, "label_font_size": 14, "n_labels": 2, "fmt": "%.3g", "color": BLACK}
            plotter.add_scalar_bar(title, mapper=mapper, vertical=False, **where, **text)
        left = size[0] - 20 - 9 * max(map(len, scene.names), default=0)
        for i, (name, colour) in enumerate(reversed(scene.names.items())):
            plotter.add_text(name, position=(left, 10 + 20 * i), font_size=9, color=colour)
    plotter.view_vector(scene.viewer, (0.0, 1.0, 0.0) if scene.viewer[:2] == (0.0, 0.0) else (0.0, 0.0, 1.0))
    plotter.reset_camera(bounds=None if scene.box is None else scene.box.T.ravel().tolist())
    return plotter


def format_page(scene: Scene, render_window: Any) -> str:
    """A page with the scene and VTK's viewer for browsers. Its content security policy forbids all requests."""
    from trame_vtk.tools.vtksz2html import write_html

    render_window.Render()
    text = io.StringIO()
    write_html(_pack_scene(render_window), text)
    head = (
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}" />\n<title>{html.escape(scene.title)}</title>'
    )
    page = re.sub(r"<title>.*?</title>", lambda _: head, text.getvalue().replace(ICON, "data:,"), count=1, flags=re.S)
    template = Template(OVERLAY.read_text(encoding="utf-8"), autoescape=True, trim_blocks=True, lstrip_blocks=True)
    stops = {title: [pv.Color(row).hex_rgb for row in bar.values[8::16]] for title, bar in scene.bars.items()}
    before, body, after = page.rpartition("</body>")
    return f"{before}{STAGE}\n{template.render(scene=scene, stops=stops)}\n{body}{after}"


def _pack_scene(render_window: Any) -> bytes:
    """The scene as VTK's viewer reads it."""
    from trame_vtk.modules.vtk import serializers as vtk

    vtk.initialize_serializers()
    context = vtk.SynchronizationContext()
    state = vtk.serialize(None, render_window, vtk.reference_id(render_window), context, 1)
    arrays = {
        entry["hash"]: entry | {"content": context.get_cached_data_array(entry["hash"], False)}
        for entry in vtk.extract_array_hash(state)
    }
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("index.json", json.dumps({"hashes": arrays, "scene": state}))
    return packed.getvalue()
