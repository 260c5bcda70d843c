"""A scene in a window, as a picture, or as a page that needs nothing else."""

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

from dav_gswt.errors import InputError
from dav_gswt.files import atomic_file
from dav_gswt.inspect.scene import ColourBar, ColourKey, Scene, to_bytes

WINDOWS = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")  # what VTK can draw in where there is no display
PACKAGES = "libegl1 libgl1-mesa-dri"  # for the first; libosmesa6 for the second, with the same pictures
VARIABLE = "VTK_DEFAULT_OPENGL_WINDOW"  # VTK's own: which of them it takes
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
ICON = "https://kitware.github.io/vtk-js/icon/favicon-"  # that the viewer would fetch
STAGE = '<div class="content" style="position:fixed;inset:0"></div>'  # what the viewer fills
STAMP = (1980, 1, 1, 0, 0, 0)


def has_display() -> bool:
    """Whether a window can be opened here."""
    return sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def prepare_rendering() -> None:
    """Choose how VTK draws without a display; to be called before VTK is loaded.

    Raises: InputError: this machine has no way to, with the packages that bring one. It is tried out in a process of
    its own: VTK may end one that has no way to draw.
    """
    if sys.platform != "linux":
        return
    tried = [os.environ[VARIABLE]] if VARIABLE in os.environ else WINDOWS
    for window in tried:
        surroundings = os.environ | {VARIABLE: window}
        command = [sys.executable, "-c", PROBE, window]  # VTK would fall back on the other one, and complain
        done = subprocess.run(command, env=surroundings, capture_output=True, check=False)
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
            drawn = plotting.make_plotter(scene, size, off_screen=True)
            drawn.screenshot(str(part))
        else:
            drawn = plotting.make_plotter(scene, size, off_screen=True, legend=False)
            part.write_text(format_page(scene, drawn.render_window), encoding="utf-8")
        drawn.close()


def open_window(scene: Scene, size: tuple[int, int]) -> None:
    """Show until the window is closed."""
    from dav_gswt.inspect import plotting  # here, not above: it loads VTK

    plotting.make_plotter(scene, size, off_screen=False).show(title=scene.title)


def format_page(scene: Scene, render_window) -> str:
    """The scene in a page of its own, VTK's viewer for browsers in it; the policy in its head forbids all requests."""
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
    """Objects numbered as they come, in place of their addresses in memory; without the times of their changes."""
    text = json.dumps(state)
    numbers: dict[str, str] = {}
    text = re.sub(ADDRESS, lambda m: numbers.setdefault(m[0], f"{len(numbers):016x}"), text)
    return json.loads(re.sub(r'"mtime": \d+', '"mtime": 1', text))


def _format_overlay(scene: Scene) -> str:
    """Title, notes and legend, above the picture."""
    lines = [
        f"<b>{html.escape(scene.title)}</b>",
        *map(html.escape, scene.notes),
        "drag to turn, shift-drag to move, wheel to zoom",
    ]
    for entry in scene.legend:
        lines += [_format_bar(entry)] if isinstance(entry, ColourBar) else _format_keys(entry)
    style = "position:fixed;left:8px;top:8px;z-index:9;font:13px sans-serif;color:#191919;pointer-events:none"
    return f'<div id="about" style="{style}">{"<br>".join(lines)}</div>'


def _format_bar(bar: ColourBar) -> str:
    from matplotlib import colormaps

    stops = ",".join(
        _format_colour(c) for c in to_bytes(colormaps[bar.colours].resampled(STOPS)(range(STOPS))[:, :3]).tolist()
    )
    look = f"display:inline-block;width:140px;height:10px;background:linear-gradient(90deg,{stops})"
    return f'{html.escape(bar.title)}: {bar.low:.3g} <span style="{look}"></span> {bar.high:.3g}'


def _format_keys(keys: ColourKey) -> list[str]:
    box = "display:inline-block;width:10px;height:10px;background:"
    return [f'<span style="{box}{_format_colour(c)}"></span> {html.escape(name)}' for name, c in keys.named.items()]


def _format_colour(colour) -> str:
    return "rgb({},{},{})".format(*colour)
