"""Show a scene in a window, or save it as a picture or as a page without external resources."""

import html
import io
import json
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

from jinja2 import Template

from dav_gswt.errors import InputError
from dav_gswt.files import atomic_file
from dav_gswt.inspect.scene import ColourBar, ColourKey, Scene

WINDOWS = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")  # VTK's off-screen windows
PACKAGES = "libegl1 libgl1-mesa-dri"  # for the first window; the second needs libosmesa6
VARIABLE = "VTK_DEFAULT_OPENGL_WINDOW"  # environment variable of VTK that selects one of them
PROBE = """
import sys
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.AddRenderer(vtkRenderer())
window.Render()
sys.exit(not (window.IsA(sys.argv[1]) and window.SupportsOpenGL()))
"""
STOPS = 16  # of a colour bar's gradient
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' blob:; worker-src blob:; connect-src blob: data:; "
    "img-src blob: data:; style-src 'unsafe-inline'"
)
ADDRESS = r'(?<=")[0-9a-f]{16}(?=["-])|(?<=\$\{)[0-9a-f]{16}(?=[}-])'  # in names of VTK's objects
ICON = "https://kitware.github.io/vtk-js/icon/favicon-"  # which the viewer would request
STAGE = '<div class="content" style="position:fixed;inset:0"></div>'  # what the viewer fills
OVERLAY = Path(__file__).with_name("overlay.html")  # Jinja2 template
STAMP = (1980, 1, 1, 0, 0, 0)


def has_display() -> bool:
    """Whether a window can be opened here."""
    return sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def prepare_rendering() -> None:
    """Choose an off-screen window of VTK; to be called before VTK is loaded.

    Each is tested in a process of its own, since VTK may end a process that cannot draw.
    Raises: InputError: none works here; the message names the packages to install.
    """
    if sys.platform != "linux":
        return
    tried = [os.environ[VARIABLE]] if VARIABLE in os.environ else WINDOWS
    for window in tried:
        environment = os.environ | {VARIABLE: window}
        command = [sys.executable, "-c", PROBE, window]  # VTK alone would fall back on the other one with an error
        done = subprocess.run(command, env=environment, capture_output=True, check=False)
        if done.returncode == 0:
            os.environ[VARIABLE] = window
            return
    raise InputError(
        f"--save: nothing draws off screen here ({' and '.join(tried)} do not); on Debian or Ubuntu: "
        f"sudo apt install {PACKAGES}"
    )


def save_scene(scene: Scene, path: Path, size: tuple[int, int]) -> None:
    """Write a .png or a .html file; it appears whole or not at all."""
    from dav_gswt.inspect import plotting  # here, not above: it loads VTK

    with atomic_file(path) as part:
        if path.suffix == ".png":
            plotter = plotting.make_plotter(scene, size, off_screen=True)
            plotter.screenshot(str(part))
        else:
            plotter = plotting.make_plotter(scene, size, off_screen=True, legend=False)
            part.write_text(format_page(scene, plotter.render_window), encoding="utf-8")
        plotter.close()


def open_window(scene: Scene, size: tuple[int, int]) -> None:
    """Show until the window is closed."""
    from dav_gswt.inspect import plotting  # here, not above: it loads VTK

    plotting.make_plotter(scene, size, off_screen=False).show(title=scene.title)


def format_page(scene: Scene, render_window) -> str:
    """A page with the scene and VTK's viewer for browsers; its content security policy forbids all requests."""
    from trame_vtk.tools.vtksz2html import write_html

    render_window.Render()
    text = io.StringIO()
    write_html(_pack_scene(render_window), text)
    head = (
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}" />\n<title>{html.escape(scene.title)}</title>'
    )
    text = re.sub(r"<title>.*?</title>", lambda _: head, text.getvalue().replace(ICON, "data:,"), count=1, flags=re.S)
    before, body, after = text.rpartition("</body>")
    return f"{before}{STAGE}\n{_format_overlay(scene)}\n{body}{after}"


def _pack_scene(render_window) -> bytes:
    """The scene as VTK's viewer reads it: the same bytes for the same scene."""
    from trame_vtk.modules.vtk import serializers as vtk

    vtk.initialize_serializers()
    context = vtk.SynchronizationContext()
    state = vtk.serialize(None, render_window, vtk.reference_id(render_window), context, 1)
    arrays = {
        entry["hash"]: entry | {"content": context.get_cached_data_array(entry["hash"], False)}
        for entry in vtk.extract_array_hash(state)
    }
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        entry = zipfile.ZipInfo("index.json", STAMP)
        entry.compress_type = zipfile.ZIP_DEFLATED
        archive.writestr(entry, json.dumps({"hashes": arrays, "scene": _renumber(state)}))
    return packed.getvalue()


def _renumber(state: Any) -> dict:
    """The state with objects numbered in order of appearance instead of by address, and without times of change."""
    text = json.dumps(state)
    numbers: dict[str, str] = {}
    text = re.sub(ADDRESS, lambda m: numbers.setdefault(m[0], f"{len(numbers):016x}"), text)
    return json.loads(re.sub(r'"mtime": \d+', '"mtime": 1', text))


def _format_overlay(scene: Scene) -> str:
    """Title, notes and legend, above the picture."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    bars = [entry for entry in scene.legend if isinstance(entry, ColourBar)]
    keys = [entry for entry in scene.legend if isinstance(entry, ColourKey)]
    gradients = [[to_hex(colour) for colour in colormaps[bar.colours].resampled(STOPS)(range(STOPS))] for bar in bars]
    template = Template(OVERLAY.read_text(encoding="utf-8"), autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return template.render(scene=scene, bars=bars, keys=keys, gradients=gradients)
